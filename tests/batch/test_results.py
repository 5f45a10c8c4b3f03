"""The results of a batch: figures of reports, table, summary and page."""

from __future__ import annotations

import base64
import csv
import io
import json
import os
import shutil
import subprocess

import numpy as np
import pytest

CHART = {"object": "a", "chart": 0, "faces": 10, "folds": 1, "area_l1": 0.1, "seconds": {"packing": 1.0}, "status": "x"}
REPORT = {
    "quality": "exact",
    "charts": [CHART, {**CHART, "chart": 1, "faces": 30, "area_l1": 0.5}],
    "gate": {"overlap": 0.25},
}
EVIL = "</script><script>document.title='evil'</script><img src=x onerror=alert(1)>.obj"


def row(name, state="done", **more):
    plain = {"name": name, "path": f"/in/{name}", "state": state, "status": 0, "seconds": 2.0, "processor": 1.5,
             "memory": 10**9, "size": 1000, "tries": 1, "host": "h", "version": "1", "message": "", "warnings": "[]",
             "words": json.dumps(["omt", name]), "report": json.dumps(REPORT), "preview": ""}  # fmt: skip
    return {**plain, **more}


@pytest.mark.parametrize("first", ["=", "+", "-", "@", "\t", "a", "'", " ="])
def test_no_name_is_a_formula_in_a_table(package, first):
    """What a program for tables would work out is quoted; numbers, also negative ones, stay numbers."""
    tables = package("batch.tables")
    name = f"{first}1+1"
    (read,) = csv.DictReader(io.StringIO(tables.csv_text([row(name, seconds=-2.5)]), newline=""))
    assert read["name"] == (f"'{name}" if first in ("=", "+", "-", "@", "\t") else name)
    assert read["seconds"] == "-2.5"


@pytest.mark.parametrize("end", [" ", "\t", "\r", "\n", "\r\n", "\x0b", ",", "\xa0"])
def test_a_name_keeps_its_blanks_at_both_ends(package, end):
    """Of the last column as well, where the line ends."""
    tables = package("batch.tables")
    text = tables.csv_lines([["x", f"{end}a{end}"], [f"{end}b{end}"]])
    assert list(csv.reader(io.StringIO(text, newline=""))) == [["x", f"{end}a{end}"], [f"{end}b{end}"]]


@pytest.mark.parametrize("inside", ["\r", "\n", "\r\n", ",", '"'])
def test_a_name_with_the_end_of_a_line_in_it_is_one_row(package, inside):
    tables = package("batch.tables")
    text = tables.csv_text([row(f"a{inside}b"), row(f"x{inside}c{inside}")])
    first, second = csv.DictReader(io.StringIO(text, newline=""))
    assert (first["name"], second["name"]) == (f"a{inside}b", f"x{inside}c{inside}") and text.endswith("\n")


def test_parts_of_a_file_are_one_row(package):
    figures = package("batch.figures").figures_of(json.dumps(REPORT))
    assert figures == {"gate.overlap": 0.25, "charts": 2, "faces": 40, "folds": 2, "seconds.packing": 2.0,
                       "area_l1": pytest.approx(0.4), "area_l1.worst": 0.5}  # fmt: skip
    assert package("batch.figures").figures_of("") == package("batch.figures").figures_of("[1]") == {}


def test_a_table_has_a_line_for_every_file_and_no_formulas(package):
    rows = [row("=cmd|x.obj"), row("b.obj", "failed", status=1, report="", message='has "quotes", and commas')]
    text = package("batch.tables").csv_text(rows)
    assert "\r" not in text
    first, second = csv.DictReader(io.StringIO(text))
    assert first["name"] == "'=cmd|x.obj" and float(first["area_l1"]) == pytest.approx(0.4)
    assert second["message"] == 'has "quotes", and commas' and second["area_l1"] == ""


def test_a_column_has_values_of_one_kind(package):
    same = package("batch.tables")._same_kind
    for values in ([1, 2], [None, "a"], [0.5, None, 1.5], [True, False], [None], []):
        assert same(values) is values
    for values, kind in (([1, 0.5, None], float), ([1, "a", None, 0.5], str), ([True, 2], float), ([True, "a"], str)):
        found = same(values)
        assert found == [None if v is None else kind(v) for v in values]
        assert {type(v) for v in found if v is not None} == {kind}


def test_parquet_has_the_same_columns_with_types(package, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    rows = [row("a.obj"), row("b.obj", "failed", seconds=None, report="")]
    package("batch.tables").write_parquet(tmp_path / "t.parquet", rows)
    table = parquet.read_table(tmp_path / "t.parquet").to_pydict()
    assert table["area_l1"] == [pytest.approx(0.4), None] and table["size"] == [1000, 1000]
    assert list(table) == package("batch.tables").table_of(rows)[0]


def test_without_pyarrow_the_error_names_it(package, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(package("batch.plan").BatchError, match=r"pip install 'omt-uv\[farm\]'"):
        package("batch.tables").write_parquet(tmp_path / "t.parquet", [row("a.obj")])


def test_a_summary_has_percentiles_growth_and_causes(package):
    rows = [row(f"{k}.obj", size=1000 * 2**k, seconds=0.1 * 2 ** (1.5 * k), report="") for k in range(12)]
    for k in range(3):
        rows.append(row(f"x{k}.obj", "failed", status=1, message=f"/in/x{k}.obj: face {k} of {10 * k} is a line."))
    rows.append(row("y.obj", "failed", status=4, message="not done within 5 s"))
    summary = package("batch.statistics").summary_of(rows)
    assert summary.counts == {"done": 12, "failed": 4}
    assert summary.exponent == pytest.approx(1.5) and summary.sizes == "bytes"
    assert summary.causes == {"FILE: face N of N is a line.": 3, "not done within N s": 1}
    assert summary.figures["seconds"][0] == pytest.approx(0.1)
    assert "seconds grow as bytes ^ 1.50" in summary.text() and "3 x FILE" in summary.text()


def test_figures_of_a_summary_stand_below_their_percentiles(package):
    """However long their names are."""
    rows = [row(f"{k}.obj", size=1000 * 2**k, seconds=0.1 * 2**k, report="") for k in range(3)]
    summary = package("batch.statistics").summary_of(rows)
    head, *lines = summary.text().splitlines()[2:]
    assert len(lines) == len(summary.figures) and len({len(line) for line in (head, *lines)}) == 1
    assert head.split() == ["0", "%", "25", "%", "50", "%", "75", "%", "95", "%", "99", "%", "100", "%"]
    width = max(map(len, summary.figures))
    assert [line[:width].rstrip() for line in lines] == list(summary.figures)
    assert all(len(line[width:].split()) == 7 for line in lines)


@pytest.mark.parametrize("power", [0.8, 1.0, 2.0])
def test_what_every_run_takes_does_not_hide_how_seconds_grow(package, power):
    """Small files cost what starting costs; the order of the rows means nothing."""
    sizes = 2.0 ** np.arange(16)
    pairs = [(x, 50.0 + 0.01 * (x if x > 200 else 0) ** power * 1e6) for x in sizes]
    pairs = [pairs[k] for k in np.random.default_rng(0).permutation(16)]
    assert package("batch.statistics").growth_of(pairs) == pytest.approx(power, abs=0.02)


def test_an_empty_batch_has_a_summary_and_a_page(package, tmp_path):
    assert package("batch.statistics").summary_of([]).exponent is None
    assert "<!doctype html>" in package("batch.pages").page_of([], tmp_path, "none")


@pytest.mark.parametrize("name", ["</script><b>", "<!--<script>", "a&lt;b&amp;c", "]]>", "\u2028 '\" \\"])
def test_no_name_of_a_file_ends_or_begins_an_element_of_the_page_and_each_is_read_back(package, tmp_path, name):
    pages, template = package("batch.pages"), package("batch.page_text").PAGE
    text = pages.page_of([row(name, message=name, words=json.dumps([name]))], tmp_path, name)
    begin, end = template.split("DATA_OF_THE_BATCH")
    assert text.startswith(begin) and text.endswith(end)
    data = text[len(begin) : -len(end)]
    assert not set("<>&") & set(data)
    table = json.loads(data)
    assert table["title"] == name and table["words"] == [name] and table["rows"][0][0] == name


@pytest.mark.parametrize(
    "value, shown", [("NaN", None), ("Infinity", None), ("-Infinity", None), ("1.23456789", 1.23457)]
)
def test_a_figure_that_is_no_number_is_none_on_the_page(package, tmp_path, value, shown):
    """JSON has no word for it, and a browser would show nothing of the page."""
    pages, template = package("batch.pages"), package("batch.page_text").PAGE
    rows = [row("a.obj", report=f'{{"rms": {value}, "faces": 3}}'), row("b.obj", report='{"rms": 0.5, "faces": 4}')]
    begin, end = template.split("DATA_OF_THE_BATCH")
    text = pages.page_of(rows, tmp_path, "one")[len(begin) : -len(end)]
    table = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    place = table["columns"].index("rms")
    assert [line[place] for line in table["rows"]] == [shown, 0.5]


@pytest.mark.parametrize("kind, number", [("charts", "chart"), ("levels", "level")])
def test_numbers_of_parts_are_no_figures(package, kind, number):
    parts = [{number: k, "faces": 10, "rms": 0.1 * k} for k in range(3)]
    found = package("batch.figures").figures_of(json.dumps({kind: parts}))
    assert found == pytest.approx({kind: 3, "faces": 30, "rms": 0.1})


# ---- the page, in a browser ---------------------------------------------------------------------------------

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
in_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def page(package, tmp_path_factory):
    """A page of 450 files, one of them with a name that would be a script, 30 of them failed."""
    folder = tmp_path_factory.mktemp("page")
    rows = [
        row(f"m{k:03}.obj", seconds=float((7 * k) % 449), preview=str(folder / "p" / "a b.png")) for k in range(419)
    ]
    rows += [row(f"f{k}.obj", "failed", status=1, seconds=None, message="bad face", report="") for k in range(30)]
    rows.append(row(EVIL))
    path = folder / "out.html"
    path.write_text(package("batch.pages").page_of(rows, folder, EVIL), encoding="utf-8")
    return path


def shown(page, tmp_path, address="", then=""):
    """What the page shows at an address, after a script: rows of texts of cells, and the document."""
    copy = page.with_name("copy.html")
    # Its own script has drawn by then.
    end = """
    <script>THEN
    const seen = { rows: [...document.querySelectorAll('tbody tr')].map(r => [...r.cells].map(c => c.textContent)),
      heads: [...document.querySelectorAll('th')].map(c => c.textContent), title: document.title, hash: location.hash,
      place: document.querySelector('#place').textContent, on: document.querySelector('#on').disabled,
      edge: Math.max(0, ...[...document.querySelectorAll('.message')].map(c => c.getBoundingClientRect().right)),
      pictures: [...document.querySelectorAll('img')].map(i => i.getAttribute('src')) };
    document.documentElement.innerHTML = '<pre></pre>';
    const text = btoa(unescape(encodeURIComponent(JSON.stringify(seen))));
    document.querySelector('pre').textContent = 'SEEN' + text + 'END';
    </script></body>"""
    text = page.read_text(encoding="utf-8")
    copy.write_text(text.replace("</body>", end.replace("THEN", then)), encoding="utf-8")
    words = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}", "--dump-dom",
             "--window-size=1300,1000"]  # fmt: skip
    done = subprocess.run([*words, f"{copy.as_uri()}{address}"], capture_output=True, text=True, timeout=120)
    assert "SEEN" in done.stdout, done.stderr
    return json.loads(base64.b64decode(done.stdout.partition("SEEN")[2].partition("END")[0]))


def column(seen, name):
    at = seen["heads"].index(name)
    return [cells[at] for cells in seen["rows"]]


@in_browser
def test_a_page_sorts_filters_and_turns_pages_by_clicks(page, tmp_path):
    first = shown(page, tmp_path)
    assert len(first["rows"]) == 200 and first["place"] == "450 of 450 files, page 1 of 3" and not first["on"]
    assert first["pictures"][0] == "p/a%20b.png" and first["title"] == "OMT UV: a batch"
    click = "document.querySelector('[data-column=seconds]').click();"
    seconds = [float(x) for x in column(shown(page, tmp_path, then=click), "seconds")]
    assert seconds == sorted(seconds) and seconds[0] == 0
    last = shown(page, tmp_path, then=click + click + "for (const k of [1, 2]) document.querySelector('#on').click();")
    assert last["place"].endswith("page 3 of 3") and last["on"] and len(last["rows"]) == 50
    # What has no figure stays at the end, whichever way it is sorted.
    assert column(last, "seconds")[-30:] == [""] * 30 and float(column(last, "seconds")[0]) >= 0
    assert last["hash"] == "#sort=seconds&down=1&page=3"


@in_browser
def test_an_address_is_a_view(page, tmp_path):
    seen = shown(page, tmp_path, "#state=failed&filter=BAD&sort=name&down=1")
    assert column(seen, "name") == [f"f{k}.obj" for k in range(29, -1, -1)]
    assert {cells[0] for cells in seen["rows"]} == {"bad face"}
    assert shown(page, tmp_path, "#sort=none&page=99")["place"].endswith("page 3 of 3")


@in_browser
def test_long_messages_stay_within_the_window(package, tmp_path):
    """With as many columns as a batch has, and a path that nothing can break but its letters."""
    figures = dict.fromkeys(("area_l1", "angle_mean", "hausdorff", "rms"), 0.123456)
    report = json.dumps({"charts": [{"faces": 10**6, "folds": 10, **figures}], "gate": {"overlap": 0.0}})
    rows = [row(f"a_name_of_a_file_{k}.obj", report=report, preview=str(tmp_path / "none.png")) for k in range(3)]
    rows.append(
        row("b.obj", "failed", status=1, report="", message=f"/{'folder' * 40}/b.obj: " + "face 17 is a line. " * 20)
    )
    path = tmp_path / "out.html"
    path.write_text(package("batch.pages").page_of(rows, tmp_path, "long"), encoding="utf-8")
    seen = shown(path, tmp_path)
    assert 0 < seen["edge"] <= 1300 and "face 17 is a line" in seen["rows"][3][0]


@in_browser
def test_no_name_of_a_file_is_run(page, tmp_path):
    seen = shown(page, tmp_path, "#filter=script")
    assert column(seen, "name") == [EVIL] and seen["title"] == "OMT UV: a batch"


def test_no_name_of_a_file_ends_the_data(page):
    text = page.read_text(encoding="utf-8")
    assert text.count("</script>") == 2 and "onerror=alert(1)>" not in text
    assert os.path.getsize(page) < 450 * 2000


def test_a_table_has_every_value_as_it_is_also_none_at_all(package):
    """No value and a value of nothing are two things."""
    tables = package("batch.tables")
    values = [0, 0.0, False, "0", "", None, 3, 2.5, "text"]
    rows = [row(f"{k}.obj", tries=value, report=json.dumps({"of mine": value})) for k, value in enumerate(values)]
    columns, flat = tables.table_of(rows)
    read = list(csv.DictReader(io.StringIO(tables.csv_text(rows))))
    assert len(read) == len(values) and list(read[0]) == columns
    for line, found, value in zip(read, flat, values, strict=True):
        assert line == {name: "" if found.get(name) is None else str(found[name]) for name in columns}
        assert line["tries"] == ("" if value is None else str(value))
        assert line["of mine"] == (str(value) if isinstance(value, int | float) and value is not False else
                                   "0" if value is False else "")  # fmt: skip


def test_causes_are_those_of_what_has_failed_and_of_nothing_that_waits_or_runs(package):
    states = ("done", "failed", "set aside", "running", "waiting")
    rows = [row(f"{k}{j}.obj", state, message=f"{state} it is") for k, state in enumerate(states) for j in range(k + 1)]
    summary = package("batch.statistics").summary_of(rows)
    assert summary.counts == {state: k + 1 for k, state in enumerate(states)}
    assert summary.causes == {"set aside it is": 3, "failed it is": 2}
