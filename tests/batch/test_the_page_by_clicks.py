"""The page of a batch under any order of clicks, in a JavaScript engine with the few elements that it asks for, against
what its columns, filters and pages are to show: a browser is on few machines."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from urllib.parse import parse_qs

import numpy as np
import pytest

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="no JavaScript engine")
# As much of a document as the page has.
DOCUMENT = """
const made = tag => ({
  tag, children: [], text: "", className: "", dataset: {},
  get textContent() { return this.text + this.children.map(c => c.textContent).join(""); },
  set textContent(text) { this.text = String(text); this.children = []; },
  append(...more) { this.children.push(...more.map(c => typeof c === "string" ? { textContent: c } : c)); },
  replaceChildren(...more) { this.children = []; this.text = ""; this.append(...more); },
});
const known = {};
const find = name => known[name] ??= made(name);
find("#data").textContent = JSON.stringify(GIVEN);
globalThis.document = { getElementById: id => find("#" + id), querySelector: find, createElement: made };
globalThis.location = { hash: HASH };
globalThis.history = { replaceState: (a, b, hash) => { location.hash = hash; } };
globalThis.window = {};
const seen = () => ({
  rows: find("tbody").children.map(r => ({ cells: r.children.map(c => c.textContent), title: r.title,
    kinds: r.children.map(c => c.className), state: r.className,
    links: r.children[0].children.filter(c => c.tag === "a").map(a => [a.href, a.children[0].src]) })),
  heads: find("thead tr").children.map(c => [c.textContent, c.className]),
  place: find("#place").textContent, hash: location.hash, ends: [find("#back").disabled, find("#on").disabled],
  fields: [find("#filter").value, find("#state").value], title: find("h1").textContent,
  states: find("#state").children.map(c => [c.value, c.textContent]),
  boxes: find("#choice").children.map(l => [l.textContent.trim(), l.children[0].checked]),
});
const acts = {
  click: name => find("thead tr").children.find(c => c.dataset.column === name)?.onclick(),
  filter: text => find("#filter").oninput({ target: { value: text } }),
  state: name => find("#state").onchange({ target: { value: name } }),
  on: () => find("#on").disabled || find("#on").onclick(),
  back: () => find("#back").disabled || find("#back").onclick(),
  box: name => {
    const box = find("#choice").children.find(l => l.textContent.trim() === name).children[0];
    box.checked = !box.checked;
    box.onchange();
  },
  address: hash => { location.hash = hash; window.onhashchange(); },
};
new Function(SCRIPT)();
const found = [seen()];
for (const [act, what] of ACTS) { acts[act](what); found.push(seen()); }
console.log(JSON.stringify(found));
"""
COLUMNS = ["name", "state", "seconds", "memory", "message", "rms"]
SHOWN = 4


@pytest.fixture(scope="module")
def script(package):
    """The script of the page, which comes after its data."""
    return re.findall(r"<script>(.*?)</script>", package("batch.page_text").PAGE, re.DOTALL)[0]


def table(count, seed=0):
    """Rows some of which have no figure, many with equal ones."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(count):
        state = ["done", "done", "done", "failed", "waiting"][rng.integers(5)]
        done = state == "done"
        rows.append([f"m{rng.permutation(count)[k]}.obj", state, float(rng.integers(9)) / 4 if done else None,
                     int(rng.integers(5)) * 10**9 if done else None, "Bad face" if state == "failed" else "",
                     0.123456 * int(rng.integers(4)) if done else None])  # fmt: skip
    pictures = ["p/a%20b.png" if row[1] == "done" else "" for row in rows]
    words = [f"omt {row[0]}" for row in rows]
    return {"title": "A & B", "columns": COLUMNS, "shown": SHOWN, "rows": rows, "pictures": pictures, "words": words}


def played(script, data, acts, address=""):
    code = DOCUMENT
    for name, value in (("GIVEN", data), ("HASH", address), ("ACTS", acts), ("SCRIPT", script)):
        code = code.replace(name, json.dumps(value))
    done = subprocess.run([NODE, "-"], input=code, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


class View:
    """What is to be seen after some acts."""

    def __init__(self, data):
        self.data, self.sort, self.down, self.filter, self.state, self.page = data, "", False, "", "", 0
        self.columns = set(COLUMNS[:SHOWN])

    def act(self, act, what):
        if act == "click" and what in self.columns:
            self.down, self.sort, self.page = self.sort == what and not self.down, what, 0
        elif act in ("filter", "state"):
            setattr(self, act, what)
            self.page = 0
        elif act in ("on", "back"):
            self.page += {"on": 1, "back": -1}[act]
        elif act == "box":
            self.columns ^= {what}
        self.page = min(max(self.page, 0), self.pages() - 1)

    def chosen(self):
        rows = self.data["rows"]
        found = [k for k, row in enumerate(rows) if not self.state or row[1] == self.state]
        text = self.filter.lower()
        found = [k for k in found if not text or any(text in self.plain(x) for x in rows[k])]
        if self.sort:
            at = COLUMNS.index(self.sort)
            there = [k for k in found if rows[k][at] is not None]
            there.sort(key=lambda k: natural(rows[k][at]), reverse=self.down)
            if self.down:
                # Equal ones stay in their order.
                there = [k for key in dict.fromkeys(natural(rows[k][at]) for k in there)
                         for k in sorted(k for k in there if natural(rows[k][at]) == key)]  # fmt: skip
            found = there + [k for k in found if rows[k][at] is None]
        return found

    def plain(self, value):
        return "" if value is None else f"{value:g}" if isinstance(value, float) else str(value).lower()

    def pages(self):
        return max(1, -(-len(self.chosen()) // 200))


def natural(value):
    """What orders a figure or a name, whose numbers count as such."""
    if not isinstance(value, str):
        return value
    return tuple((0, int(x), "") if x.isdigit() else (1, 0, x) for x in re.findall(r"\d+|\D+", value))


def check(seen, view):
    found, columns = view.chosen(), [name for name in COLUMNS if name in view.columns]
    here = found[200 * view.page : 200 * (view.page + 1)]
    rows = view.data["rows"]
    assert [row["title"] for row in seen["rows"]] == [view.data["words"][k] for k in here]
    for row, k in zip(seen["rows"], here, strict=True):
        given = [rows[k][COLUMNS.index(name)] for name in columns]
        assert row["state"] == rows[k][1] and row["cells"][0] == rows[k][4]
        assert row["kinds"][1:] == [
            "number" if isinstance(x, (int, float)) else name for name, x in zip(columns, given, strict=True)
        ]
        for name, value, cell in zip(columns, given, row["cells"][1:], strict=True):
            if value is None or isinstance(value, str):
                assert cell == (value or "")
            elif name == "memory":
                assert cell == f"{value / 1e9:.2f} GB"
            else:
                assert float(cell) == float(f"{value:.4g}")
        picture = view.data["pictures"][k]
        assert row["links"] == ([[picture, picture]] if picture else [])
    arrow = "sorted down" if view.down else "sorted"
    assert seen["heads"] == [["", ""], *([name, arrow if name == view.sort else ""] for name in columns)]
    assert seen["place"] == f"{len(found)} of {len(rows)} files, page {view.page + 1} of {view.pages()}"
    assert seen["ends"] == [view.page == 0, view.page == view.pages() - 1]
    assert seen["fields"] == [view.filter, view.state] and seen["title"] == "A & B"
    assert seen["boxes"] == [[name, name in view.columns] for name in COLUMNS]
    told = {"sort": view.sort, "down": "1" * view.down, "filter": view.filter, "state": view.state}
    told["page"] = str(view.page + 1) if view.page else ""
    assert parse_qs(seen["hash"][1:]) == {key: [value] for key, value in told.items() if value}


def some_acts(seed, count=40):
    rng = np.random.default_rng(seed)
    acts = []
    for _ in range(count):
        name = COLUMNS[rng.integers(len(COLUMNS))]
        acts.append([["click", name], ["click", name], ["filter", ["", "M1", "bad", "0.5", ".obj"][rng.integers(5)]],
                     ["state", ["", "done", "failed"][rng.integers(3)]], ["on", ""], ["on", ""], ["back", ""],
                     ["box", name]][rng.integers(8)])  # fmt: skip
    return acts


@pytest.mark.parametrize("count", [0, 1, 200, 450])
def test_whatever_is_clicked_the_page_shows_what_is_chosen_in_order(script, count):
    data = table(count)
    acts = [["box", "rms"], *some_acts(count)]
    # A column twice, and another one after it, which begins upwards; and what begins on the first page again.
    acts += [["click", "name"], ["click", "name"], ["click", "seconds"], ["click", "seconds"], ["click", "seconds"]]
    acts += [["filter", ""], ["state", "done"], ["state", ""], ["on", ""], ["filter", ".OBJ"], ["on", ""]]
    acts += [["state", "done"], ["filter", ""], ["state", ""], ["on", ""], ["click", "name"]]
    view = View(data)
    seen = played(script, data, acts)
    check(seen[0], view)
    assert seen[0]["states"] == [[state, state] for state in sorted({row[1] for row in data["rows"]})]
    for act, found in zip(acts, seen[1:], strict=True):
        view.act(*act)
        check(found, view)


def test_the_address_of_any_view_shows_it_again(script):
    data = table(450)
    acts = [act for act in some_acts(7, 60) if act[0] != "box"]
    seen = played(script, data, acts)
    addresses = list(dict.fromkeys(found["hash"] for found in seen))
    again = played(script, data, [["address", hash] for hash in addresses[1:]], addresses[0])
    at = {found["hash"]: found for found in seen}
    assert len(addresses) > 10
    for address, found in zip(addresses, again, strict=True):
        assert found == at[address]


@pytest.mark.parametrize(("address", "page"), [
    ("#page=99", 2), ("#page=0", 0), ("#page=-3", 0), ("#page=x", 0), ("#sort=none&page=2", 1), ("#", 0), ("", 0),
])  # fmt: skip
def test_addresses_that_nobody_has_sent_show_something(script, address, page):
    data = table(450)
    view = View(data)
    view.page = page
    check(played(script, data, [], address)[0], view)
