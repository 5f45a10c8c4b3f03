"""What solvers, pipelines and writers warn of arrives where somebody reads it, once, and with the object that it is of.

Everything that comes with warnings has one more: `warnings_arrive.tsv` has which of these are told by every command and
every operator, and of whom. Those of trials that come to nothing are no loss, and are not in it. OMT_UV_ACCEPT=1 writes
the table anew.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import command_runs
import front_runs
import pytest
import recorded_calls
import scenes
import twin_scenes
from marked_warnings import Marking, marks_in

TABLE = Path(__file__).with_name("warnings_arrive.tsv")
ACCEPT = bool(os.environ.get("OMT_UV_ACCEPT"))
# Files with two objects, so that it shows whom a warning is of.
FILES = ("two.blend", "in.blend", "", "plain.obj")
# What takes longest, and warns of nothing of its own.
LEFT_OUT = {"average", "library", "signature", "compare", "object.omt_distance"}
# Operators without a solver, or a file, that could warn.
QUIET = ("density", "measure", "regions", "worst", "histogram", "attributes", "overlay", "layout", "checker", "weights",
         "strain", "landmarks")  # fmt: skip
COMMANDS = [(name, next(f for f in FILES if f in files), more) for name, files, more in front_runs.COMMANDS
            if name not in LEFT_OUT and "curvature" not in more and "--csv" not in more]  # fmt: skip
COMMANDS += [("unwrap", "plain.obj", ""), ("unwrap", "plain.glb", ""), ("stack", "plain.ply", "")]
OPERATORS = {f"{name} {k}": (name, objects, more) for k, (name, objects, more) in enumerate(front_runs.OPERATORS)
             if name not in LEFT_OUT and not name.partition("omt_")[2].startswith(QUIET)}  # fmt: skip


@contextlib.contextmanager
def marking() -> Iterator[Marking]:
    """A context in which everything that comes with warnings has one more."""
    record = Marking()
    everything = [*recorded_calls.modules(), *recorded_calls.front_modules()]
    with recorded_calls.watching(record, everything, private=True):
        yield record


def _rows(run: str, lines: list[str]) -> set[str]:
    return {"\t".join([run, name, whom]) for name, whom in marks_in(lines)}


def commanded(package, capfd, there: Path) -> set[str]:
    """Rows of all commands."""
    rows = set()
    for name, file, more in COMMANDS:
        words = [*command_runs.words(name, there, file), *more.split()]
        if file.startswith("plain"):
            words = [w.with_suffix(Path(file).suffix) if isinstance(w, Path) and w.stem == "out" else w for w in words]
        scenes.open_empty()
        capfd.readouterr()
        package("cli").main([str(word) for word in words])
        lines = capfd.readouterr().err.splitlines()
        rows |= _rows(f"{name} {file} {more}".strip(), lines)
    return rows


def operated(capfd, folder: Path) -> set[str]:
    """Rows of all operators."""
    rows = set()
    for run, (name, objects, arguments) in OPERATORS.items():
        twin_scenes.begin(folder, objects)
        _, lines = twin_scenes.told(capfd, name, arguments)
        rows |= _rows(run, lines)
    return rows


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="marks are put into the sources")
def test_warnings_arrive_as_the_table_says(package, capfd, monkeypatch, tmp_path):
    def run(*words):
        return (package("cli").main([str(word) for word in words]),)

    front_runs.prepare(tmp_path, run)
    monkeypatch.chdir(tmp_path)
    with marking():
        rows = operated(capfd, tmp_path) | commanded(package, capfd, tmp_path / "commands")
    if ACCEPT:
        TABLE.write_text("".join(f"{row}\n" for row in sorted(rows)))
    told = set(TABLE.read_text().splitlines())
    assert len(told) > 500
    lost = sorted(told - rows)
    assert not lost, "\n".join([*lost, "OMT_UV_ACCEPT=1 accepts this"])
