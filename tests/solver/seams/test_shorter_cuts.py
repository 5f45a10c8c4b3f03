"""A cut that shears less than was asked gives back what it does not need, step by step, and never more than that."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.solver.progress import drain
from omt_uv.solver.seams import rehearsal


@dataclass(frozen=True)
class Found:
    """A cut as a rehearsal has it, of which its spread alone counts here."""

    task: SimpleNamespace
    cut: SimpleNamespace


@dataclass(frozen=True)
class Task:
    bound: float = 0.0


def shortened(monkeypatch, sheared, asked, shear_of, spread=0.01):
    """The spread and shear of the cut that was kept, and the bounds that were tried."""
    bounds = []

    def trimmed(task, _cut):
        bounds.append(task.bound)
        return SimpleNamespace(spread=task.bound)

    def of(cut):
        yield from ()
        return shear_of(cut.cut.spread)

    monkeypatch.setattr(rehearsal, "trimmed", trimmed)
    start = Found(Task(), SimpleNamespace(spread=spread))
    steps = rehearsal.Rehearsal._shorter(SimpleNamespace(of=of), start, sheared, asked)
    found, value = drain(steps)
    return found.cut.spread, value, bounds


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("sheared", [0.02, 0.05, 0.08])
def test_each_step_goes_as_far_as_the_shear_says_and_halfway_to_where_it_was_too_short(monkeypatch, power, sheared):
    asked, spread = 0.09, 0.01
    most = spread * 4.0
    kept, value, bounds = shortened(monkeypatch, sheared, asked, lambda s: sheared * (s / spread) ** power)
    assert value <= asked and value == pytest.approx(sheared * (kept / spread) ** power)
    assert kept >= spread and len(bounds) <= 4
    now, shear, above = spread, sheared, most
    for bound in bounds:
        expected = min(np.sqrt(now * above), now * (asked / shear) ** rehearsal.SPREAD_BY_SHEAR)
        assert bound == pytest.approx(expected)
        after = sheared * (bound / spread) ** power
        if after > asked:
            above = bound
        else:
            now, shear = bound, after
    assert kept == pytest.approx(now)


@pytest.mark.parametrize("sheared", [None, 0.09, 0.2])
def test_a_cut_that_is_near_enough_or_has_no_map_stays(monkeypatch, sheared):
    assert shortened(monkeypatch, sheared, 0.09, lambda s: 0.0) == (0.01, sheared, [])


def test_what_is_flat_goes_halfway_and_what_has_no_map_is_too_short(monkeypatch):
    kept, value, bounds = shortened(monkeypatch, 0.0, 0.09, lambda s: None)
    assert kept == 0.01 and value == 0.0 and len(bounds) == 4
    above = 0.01 * 4.0
    for bound in bounds:
        assert bound == pytest.approx(np.sqrt(0.01 * above))
        above = bound
