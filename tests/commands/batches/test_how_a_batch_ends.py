"""What a batch says of its end hangs on how many files are in which state: every mix of a few."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from types import SimpleNamespace

import pytest

STATES = ("done", "failed", "set aside", "running", "waiting")
PLAN = SimpleNamespace(beside=lambda ending: Path("out" + ending))


@pytest.mark.parametrize("received", [0, 2])
@pytest.mark.parametrize("allowed", [False, True])
def test_files_are_counted_by_what_became_of_them(package, capsys, allowed, received):
    command, engine = package("commands.batches.batch"), package("batch.engine")
    for numbers in product((0, 1, 3), repeat=len(STATES)):
        counts = {state: count for state, count in zip(STATES, numbers, strict=True) if count}
        done, failed, aside, *more = numbers
        raised, every, bad = "", sum(numbers), failed + aside
        status = 0
        try:
            command._tell(engine.BatchResult(counts, 2, received), PLAN, allowed)
        except command.SomeFailed as error:
            raised, status = str(error), error.status
        out, told = capsys.readouterr()
        assert out == f"{done} of {every} files done, 2 of all runs now\n"
        words = f"{bad} of {every} files could not be done."
        if received:
            assert raised.startswith(f"ended by a signal, {sum(more)} files are left.")
            assert (status, told) == (package("supervision").INTERRUPTED, "")
        elif allowed or not bad:
            assert (raised, status) == ("", 0) and (words in told) == bool(bad) and bool(told) == bool(bad)
        else:
            assert raised.startswith(words) and status == (7 if done else 1) and not told
