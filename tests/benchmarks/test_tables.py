"""Tables of the benchmarks: printed row by row, written whole."""

from __future__ import annotations

from benchmarks.tables import Table, missed


def test_what_is_written_is_what_was_added(tmp_path):
    table = Table("Title", {"name": 20, "x": 5, "missed goals": 15})
    table.add(name="one", x=1 / 3)
    table.add(name="two", x=7, **missed(area=False, folds=3, time=True))
    table.write(tmp_path / "new" / "table.tsv")
    rows = [line.split("\t") for line in (tmp_path / "new" / "table.tsv").read_text().splitlines()]
    assert rows == [["name", "x", "missed goals"], ["one", "0.3333", ""], ["two", "7", "folds, time"]]


def test_text_stands_to_the_left_and_numbers_to_the_right(capsys):
    table = Table("Title", {"name": 20, "x": 5})
    table.add(name="one", x=1)
    assert capsys.readouterr().out.splitlines()[-1] == "one" + " " * 23 + "1"
