"""One round of all commands and operators: what they print, report and leave, and what public functions of all rooms
but the solver give on the way, as a few figures of each in `told.tsv`.

Where these change, what is told or written has changed, and that is on purpose or a bug; OMT_UV_ACCEPT=1 writes the
table anew, each row with how exact it is: as far as it moves with the last digits of the meshes. OMT_UV_ACCEPT=fewer
leaves out rows that do not hold here.
"""

from __future__ import annotations

import os
from pathlib import Path

import front_runs
import numpy as np
import pytest
import recorded_calls
import scenes

TOLD = Path(__file__).with_name("told.tsv")
ACCEPT = os.environ.get("OMT_UV_ACCEPT", "")
# Calls of each function in a run that are counted.
MOST = 20


@pytest.fixture
def round_of_all(package, capfd, monkeypatch):
    """Figures by names of runs and functions, of files in a new folder."""
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 2000)

    def run(*words):
        return package("cli").main([str(word) for word in words])

    def figures(folder):
        folder.mkdir()
        front_runs.prepare(folder, lambda *words: (run(*words),))
        record = recorded_calls.Told(MOST)
        with recorded_calls.watching(record, recorded_calls.front_modules()):
            for name, left in front_runs.told(folder, run, capfd):
                record.next_run()
                record.add(name, left)
        return record.figures

    return figures


def shaken(add, seed):
    """`scenes.add` with positions that differ in the last digit of Blender's numbers."""
    rng = np.random.default_rng(seed)
    return lambda points, *args, **kwargs: add(
        np.asarray(points) * (1 + 1e-7 * rng.normal(size=np.shape(points))), *args, **kwargs
    )


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
def test_what_is_told_and_left_is_that_of_the_table(round_of_all, tmp_path, monkeypatch):
    rows = round_of_all(tmp_path / "0")
    if ACCEPT == "1":
        others, add = [], scenes.add
        for seed in (1, 2, 3):
            monkeypatch.setattr(scenes, "add", shaken(add, seed))
            others.append(round_of_all(tmp_path / str(seed)))
        TOLD.write_text("".join(f"{line}\n" for line in recorded_calls.lines_of(rows, others)))
    lines = TOLD.read_text().splitlines()
    other = list(recorded_calls.unlike(lines, rows))
    if ACCEPT == "fewer":
        TOLD.write_text("".join(f"{line}\n" for line in lines if line not in other))
        return
    now = [f"{line} is now {rows.get(line.split(chr(9))[0])}" for line in other]
    assert not other, "\n".join([*now, "OMT_UV_ACCEPT=1 accepts this"])
