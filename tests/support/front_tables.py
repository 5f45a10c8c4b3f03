"""Tables of what rounds of commands and operators tell and leave, and of what functions of all rooms but the solver are
given, find, and tell on the way."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import recorded_calls
import scenes
import windows

ROOT = Path(__file__).resolve().parents[2]
ACCEPT = os.environ.get("OMT_UV_ACCEPT", "")
# Calls of each function in a run that are counted.
MOST = 20
# What hangs on the clock, and on the machine and who works on it.
ELSEWHERE = (
    "supervision.",
    "batch.",
    "session.run.",
    "session.live.",
    "session.following.",
    "operators.live.",
    # What stands in Blender's lists of handlers hangs on the tests before.
    "display.overlay._handlers",
    "session.last_run._handlers",
    "operators.base.SolverOperator.begin",
    "table ",
    "summary ",
)


class Rounds:
    """Rounds of the runs of a module, which has `prepare` and `told`, each in a new folder."""

    def __init__(self, runs: ModuleType, package, capfd, monkeypatch) -> None:
        self.runs, self.package, self.capfd, self.patch = runs, package, capfd, monkeypatch
        monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 2000)

    def figures(self, folder: Path) -> dict[str, np.ndarray]:
        """Figures by names of runs and functions of one round."""

        def run(*words):
            return self.package("cli").main([str(word) for word in words])

        folder.mkdir()
        self.runs.prepare(folder, lambda *words: (run(*words),))
        record = recorded_calls.Within(MOST)
        with (
            recorded_calls.watching(record, recorded_calls.front_modules(), private=True),
            self.patch.context() as patch,
        ):
            patch.chdir(folder)
            # Processes of ours are begun there.
            patch.setenv("PYTHONPATH", str(ROOT))
            for name, left in self._told(folder, run, patch):
                record.next_run()
                record.add(name, left)
        # What was let be on its way is closed here, and not when Python ends.
        gc.collect()
        return record.figures

    def _told(self, folder: Path, run, patch) -> Iterator[tuple[str, object]]:
        yield from self.runs.told(folder, run, self.capfd)
        if hasattr(self.runs, "in_a_window"):
            windows.in_front(patch, self.package)
            windows.in_single_steps(patch, self.package)
            yield from self.runs.in_a_window(folder)

    def check(self, table: Path, folder: Path) -> set[str]:
        """Compare a round with a table, or write that anew: names of the functions that were called."""
        rows = self.figures(folder / "0")
        if ACCEPT == "1":
            others, add = [], scenes.add
            for seed in (1, 2, 3):
                with self.patch.context() as patch:
                    patch.setattr(scenes, "add", _shaken(add, seed))
                    others.append(self.figures(folder / str(seed)))
            found = [line for line in recorded_calls.lines_of(rows, others) if not line.startswith(ELSEWHERE)]
            table.write_text("".join(f"{line}\n" for line in found))
        recorded_calls.hold(table, rows)
        return {name.partition(" ")[0] for name in rows}


def _shaken(add, seed):
    """`scenes.add` with positions that differ in the last digit of Blender's numbers."""
    rng = np.random.default_rng(seed)
    return lambda points, *args, **kwargs: add(
        np.asarray(points) * (1 + 1e-7 * rng.normal(size=np.shape(points))), *args, **kwargs
    )
