"""The page of a batch but for its data: style, and a script that sorts, filters and turns pages.

What is shown is in the address (sort, down, filter, state, page), so that a view can be sent to somebody. All that
comes from files is set as text, never as HTML.
"""

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>OMT UV: a batch</title>
<style>
  :root { color-scheme: light dark; --line: #8884; --bad: #c22; --soft: #8882 }
  body { font: 14px/1.4 system-ui, sans-serif; margin: 1.2em }
  h1 { font-size: 1.3em; margin: 0 0 .5em }
  nav { display: flex; gap: .8em; flex-wrap: wrap; align-items: center; margin: .6em 0 }
  table { border-collapse: collapse }
  th, td { text-align: left; padding: .25em .7em; border-bottom: 1px solid var(--line); vertical-align: middle }
  th { cursor: pointer; position: sticky; top: 0; background: Canvas; white-space: nowrap }
  th.sorted::after { content: " \\25B2"; font-size: .7em }
  th.sorted.down::after { content: " \\25BC" }
  td.number { text-align: right; font-variant-numeric: tabular-nums }
  tr.failed td { color: var(--bad) }
  .message { max-width: 25em; overflow-wrap: anywhere }
  img { display: block; height: 120px; background: var(--soft) }
  button, input, select { font: inherit }
  details { margin: .4em 0 }
  label { margin-right: 1em; white-space: nowrap }
</style>
</head>
<body>
<h1></h1>
<nav>
  <input id="filter" type="search" placeholder="filter by any text" size="30">
  <select id="state"><option value="">all</option></select>
  <button id="back">&larr;</button><span id="place"></span><button id="on">&rarr;</button>
</nav>
<details><summary>columns</summary><div id="choice"></div></details>
<table><thead><tr></tr></thead><tbody></tbody></table>
<script id="data" type="application/json">DATA_OF_THE_BATCH</script>
<script>
"use strict";
const SIZE = 200;
const data = JSON.parse(document.getElementById("data").textContent);
const at = name => data.columns.indexOf(name);
const find = selector => document.querySelector(selector);
const view = { sort: "", down: false, filter: "", state: "", page: 0,
               columns: new Set(data.columns.slice(0, data.shown)) };

function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  view.sort = data.columns.includes(given.get("sort")) ? given.get("sort") : "";
  view.down = given.get("down") === "1";
  view.filter = given.get("filter") || "";
  view.state = given.get("state") || "";
  view.page = Math.max(0, (parseInt(given.get("page"), 10) || 1) - 1);
}

function writeAddress() {
  const given = new URLSearchParams();
  if (view.sort) given.set("sort", view.sort);
  if (view.down) given.set("down", "1");
  if (view.filter) given.set("filter", view.filter);
  if (view.state) given.set("state", view.state);
  if (view.page) given.set("page", view.page + 1);
  history.replaceState(null, "", "#" + given);
}

function compare(a, b) {
  if (a === b) return 0;
  if (a === null || a === undefined) return 1;
  if (b === null || b === undefined) return -1;
  if (typeof a === "number" && typeof b === "number") return a - b;
  return String(a).localeCompare(String(b), undefined, { numeric: true });
}

function chosen() {
  const text = view.filter.toLowerCase();
  let found = data.rows.map((_, k) => k);
  if (view.state) found = found.filter(k => data.rows[k][at("state")] === view.state);
  if (text) found = found.filter(k => data.rows[k].some(x => String(x ?? "").toLowerCase().includes(text)));
  if (view.sort) {
    const c = at(view.sort), sign = view.down ? -1 : 1;
    const none = x => x === null || x === undefined;
    found.sort((i, j) => {
      const a = data.rows[i][c], b = data.rows[j][c];
      // What has no figure stays at the end, whichever way it is sorted.
      return (none(a) || none(b) ? compare(a, b) : sign * compare(a, b)) || i - j;
    });
  }
  return found;
}

function element(tag, text, kind) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

function shown(name, value) {
  if (value === null || value === undefined) return "";
  if (name === "memory") return (value / 1e9).toFixed(2) + " GB";
  if (typeof value === "number" && !Number.isInteger(value)) return Number(value.toPrecision(4)).toString();
  return String(value);
}

function draw() {
  const found = chosen(), pages = Math.max(1, Math.ceil(found.length / SIZE));
  view.page = Math.min(view.page, pages - 1);
  const columns = data.columns.filter(name => view.columns.has(name));
  const head = find("thead tr"), body = find("tbody");
  head.replaceChildren(element("th", ""), ...columns.map(name => {
    const cell = element("th", name, name === view.sort ? "sorted" + (view.down ? " down" : "") : "");
    cell.dataset.column = name;
    cell.onclick = () => {
      view.down = view.sort === name && !view.down;
      view.sort = name;
      view.page = 0;
      draw();
    };
    return cell;
  }));
  body.replaceChildren(...found.slice(view.page * SIZE, (view.page + 1) * SIZE).map(k => {
    const row = element("tr", undefined, data.rows[k][at("state")]);
    row.title = data.words[k];
    const cell = element("td");
    if (data.pictures[k]) {
      const picture = element("img");
      picture.loading = "lazy";
      picture.src = data.pictures[k];
      picture.alt = "checker, layout and wireframe";
      const link = element("a");
      link.href = data.pictures[k];
      link.append(picture);
      cell.append(link);
    }
    // What failed has no picture: its message stands there, within the window however many columns there are.
    const message = data.rows[k][at("message")];
    if (message) cell.append(element("div", message, "message"));
    row.append(cell, ...columns.map(name => {
      const value = data.rows[k][at(name)];
      return element("td", shown(name, value), typeof value === "number" ? "number" : name);
    }));
    return row;
  }));
  find("#place").textContent = `${found.length} of ${data.rows.length} files, page ${view.page + 1} of ${pages}`;
  find("#back").disabled = view.page === 0;
  find("#on").disabled = view.page === pages - 1;
  find("#filter").value = view.filter;
  find("#state").value = view.state;
  writeAddress();
}

find("h1").textContent = data.title;
for (const state of [...new Set(data.rows.map(row => row[at("state")]))].sort()) {
  const option = element("option", state);
  option.value = state;
  find("#state").append(option);
}
for (const name of data.columns) {
  const label = element("label"), box = element("input");
  box.type = "checkbox";
  box.checked = view.columns.has(name);
  box.onchange = () => { box.checked ? view.columns.add(name) : view.columns.delete(name); draw(); };
  label.append(box, " " + name);
  find("#choice").append(label);
}
find("#filter").oninput = event => { view.filter = event.target.value; view.page = 0; draw(); };
find("#state").onchange = event => { view.state = event.target.value; view.page = 0; draw(); };
find("#back").onclick = () => { view.page -= 1; draw(); };
find("#on").onclick = () => { view.page += 1; draw(); };
window.onhashchange = () => { readAddress(); draw(); };
readAddress();
draw();
</script>
</body>
</html>
"""
