"""Which cuts a rehearsal takes, longer or shorter, with what they shear and cost written in advance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.progress import drain
from omt_uv.solver.seams import rehearsal
from omt_uv.solver.seams.rehearsal import Rehearsal


@dataclass(frozen=True)
class Task:
    bound: float = 1.0


@dataclass(frozen=True)
class Cut:
    cost: float
    spread: float = 1.0
    shears: float | None = 1.0


@dataclass(frozen=True)
class Coarse:
    """A cut of a coarse surface beside one of the cost 2."""

    cut: Cut
    task: Task = Task()
    setting: object = field(default_factory=lambda: SimpleNamespace(base_cost=2.0))


def found(cost, shears=1.0, spread=1.0):
    return Coarse(Cut(cost, spread, shears))


@pytest.fixture
def mine(monkeypatch):
    """A rehearsal that tells of every cut what is written on it; the cuts that it was asked about."""
    asked = []

    def of(self, one):
        asked.append(one.cut.cost)
        return worked(one.cut.shears)

    monkeypatch.setattr(Rehearsal, "of", of)
    return Rehearsal(None, None, None, {}), asked


def price(cost, shears, asked):
    return (2 + cost) * max(shears, asked) ** 0.9


@pytest.mark.parametrize(("cost", "shears", "asked"), [(3.0, 0.5, 0.2), (3.0, 0.1, 0.2), (0.0, 1.0, 1.0)])
def test_prices_are_costs_at_the_shear_that_is_asked_for(cost, shears, asked):
    assert rehearsal._price(found(cost), shears, asked) == pytest.approx(price(cost, shears, asked))


def test_the_best_of_several_costs_least_for_what_it_shears(mine, monkeypatch):
    one, asked = mine
    cuts = [found(5.0, 0.2), found(1.0, 2.0), found(3.0, 0.4)]
    best = drain(one.best_of(cuts, 0.1))
    assert best is min(cuts, key=lambda c: price(c.cut.cost, c.cut.shears, 0.1)) and asked == [1.0, 3.0, 5.0]
    assert drain(one.best_of(cuts[:1], 0.1)) is cuts[0] and len(asked) == 3
    # Of even ones the first.
    even = [found(3.0, 0.5), found(3.0, 0.5 * (1 + 0.5 * rehearsal.EVEN))]
    assert drain(one.best_of(even, 0.1)) is even[0] and drain(one.best_of(even[::-1], 0.1)) is even[1]
    # Where one has no map predictions have to do.
    monkeypatch.setattr(rehearsal, "best_of", lambda cuts: "predicted")
    assert drain(one.best_of([*cuts, found(0.5, None)], 0.1)) == "predicted"


def test_what_would_be_too_dear_even_if_it_kept_the_bound_is_not_tried(mine):
    one, asked = mine
    even = 1 + rehearsal.EVEN
    cuts = [found(1.0, 0.5), found(3 * even - 2 - 1e-6, 0.1), found(3 * even - 2 + 1e-6, 0.1)]
    tried = drain(one._worth_trying(cuts[::-1], 0.5))
    assert [t[0].cut.cost for t in tried] == [1.0, cuts[1].cut.cost] and [t[1] for t in tried] == [0.5, 0.1]
    # What has no map makes nothing dear.
    assert len(drain(one._worth_trying([found(1.0, None), found(90.0, 0.5)], 0.5))) == 2


@pytest.fixture
def kept(mine, monkeypatch):
    """What a cut becomes until it keeps what is asked for, where longer ones are written, and by which bounds."""
    one, _ = mine

    def run(first, *longer, asked=0.5):
        bounds, rest = [], list(longer)

        def make(self, one, bound, asked):
            bounds.append(round(bound / one.cut.spread, 9))
            return worked([(c, c.cut.shears) for c in (rest.pop(0) if rest else [])])

        monkeypatch.setattr(Rehearsal, "_longer", make)
        monkeypatch.setattr(
            Rehearsal, "_shorter", lambda self, one, sheared, asked: worked((one, ("shorter", sheared)))
        )
        monkeypatch.setattr(rehearsal, "grow", lambda task, cut, most: ("grown", task.bound, most))
        fractions, steps = [], one.kept(first, asked)
        try:
            while True:
                fractions.append(next(steps).fraction)
        except StopIteration as stop:
            return stop.value, bounds, fractions

    return run


def bound(shears, asked=0.5):
    return round((asked * 0.88 / shears) ** rehearsal.SPREAD_BY_SHEAR, 9)


def test_what_keeps_the_bound_is_only_made_shorter(kept):
    first = found(1.0, 0.5)
    assert kept(first) == ((first, ("shorter", 0.5)), [], pytest.approx([0, 0.1, 0.7, 1.0]))
    assert kept(found(1.0, None))[0][1] == ("shorter", None)


def test_what_does_not_is_made_longer_by_the_best_that_is_not_too_dear(kept):
    first, second, third = found(1.0, 2.0, spread=4.0), found(1.5, 0.9), found(2.0, 0.5)
    result, bounds, fractions = kept(first, [found(9.0, 0.6), second], [third])
    assert result == (third, ("shorter", 0.5)) and bounds == [bound(2.0), bound(0.9)]
    assert fractions == pytest.approx([0, 0.1, 0.1, 0.4, 0.4, 0.7, 0.7, 1.0])
    # No more often than so.
    assert kept(first, [second], [found(1.9, 0.8)], [third])[0][0].cut.cost == 1.9
    # One that shears as much, or costs much more, is none.
    assert kept(first, [found(0.5, 2.0)])[0][0] is first
    worth = 1.2 * price(1.0, 2.0, 0.5)
    for share, taken in ((0.999, True), (1.001, False)):
        other = found(share * worth / 0.5**0.9 - 2, 0.5)
        assert (kept(first, [other])[0][0] is other) == taken


def test_where_none_that_is_longer_has_a_map_predictions_have_to_do(kept):
    (result, sheared), bounds, _ = kept(found(1.0, 2.0, spread=4.0))
    assert sheared is None and result.cut == ("grown", pytest.approx(4 * bounds[0]), rehearsal.MOST_REGROWN)


def test_cuts_are_made_longer_in_three_ways(monkeypatch):
    monkeypatch.setattr(rehearsal, "grow", lambda task, cut, most: f"{cut} {task.bound:g}")
    monkeypatch.setattr(rehearsal, "grown_by_one", lambda task, cut, count: ["best", "second", "third"][: count + 1])
    monkeypatch.setattr(rehearsal, "rerouted", lambda task, cut: f"rerouted {cut}")
    monkeypatch.setattr(rehearsal, "trimmed", lambda task, cut: f"trimmed {cut} to {task.bound:g}")
    found = rehearsal._longer(Task(2.0), "cut")
    assert found == ["cut 2", "second 2", "third 2", f"trimmed rerouted cut {2 * 0.6:g} to 2"]


def test_a_cut_is_made_shorter_until_that_is_enough(mine, monkeypatch):
    one, _ = mine
    bounds = []

    def run(first, sheared, *others):
        bounds.clear()
        rest = list(others)

        def trimmed(task, cut):
            bounds.append(task.bound)
            return rest.pop(0).cut

        monkeypatch.setattr(rehearsal, "trimmed", trimmed)
        return drain(one._shorter(first, sheared, 1.0))

    # Within 6 % of what is asked for it is short enough.
    first = found(9.0, spread=4.0)
    assert run(first, 0.94) == (first, 0.94) and run(first, None) == (first, None) and not bounds
    better = found(5.0, 0.95, spread=6.0)
    assert run(first, 0.5, better) == (replace(first, cut=better.cut), 0.95)
    assert bounds == [pytest.approx(min(4 * 2.0**rehearsal.SPREAD_BY_SHEAR, 4 * 4.0**0.5))]
    # Where that was too short it goes halfway back; flat ones have no spread to go by.
    result = run(first, 0.0, found(1.0, 1.01), found(2.0, None), found(3.0, 1.0))
    assert result[0].cut.cost == 3.0
    most = 4 * 4.0
    want = [np.sqrt(4 * most)]
    want += [np.sqrt(4 * want[0])]
    assert bounds == pytest.approx([*want, np.sqrt(4 * want[1])])
    assert len(run(first, 0.1, *[found(1.0, 5.0)] * 9)) == 2 and len(bounds) == 4


# ---- maps of coarse surfaces --------------------------------------------------------------------------------


@pytest.mark.parametrize("state", ["plain", "dense", "no steps", "no boundary", "no rehearsal", "refused"])
def test_the_same_coarse_surface_is_mapped_once(state, monkeypatch):
    from omt_uv.solver.errors import MeshError

    asked = []
    opening = SimpleNamespace(
        positions=np.eye(3), triangles=np.array([[0, 1, 2]]), seams=np.zeros((0, 2), int), vertex=np.array([2, 0, 1])
    )
    monkeypatch.setattr(rehearsal, "opened", lambda found, near: (asked.append(near.tolist()), opening)[1])

    def sheared(surface, density):
        asked.append(None if density is None else density.tolist())
        if state == "refused":
            raise MeshError("No")
        return worked(0.25)

    log = (lambda coarse: np.array([1.0, 2.0, 3.0])) if state == "dense" else (lambda coarse: None)
    component = SimpleNamespace(ends=np.array([[0, 1], [1, 2]]), positions=np.eye(3) * 1.1)
    one = Rehearsal(component, log, None if state == "no rehearsal" else sheared, {})
    boundary = np.array([state not in ("no boundary", "no steps")])
    coarse = SimpleNamespace(positions=np.eye(3)[[2, 1, 0]], boundary=boundary)
    steps = np.zeros(0 if state == "no steps" else 2, int)
    given = SimpleNamespace(
        setting=SimpleNamespace(coarse=coarse), cut=SimpleNamespace(steps=steps), base=np.array([True, False])
    )
    first, again = drain(one.of(given)), drain(one.of(given))
    if state in ("no steps", "no rehearsal"):
        assert first is again is None and not asked and not one.known
        return
    assert first == again == (None if state == "refused" else 0.25) and len(one.known) == 1
    # The vertices nearest to what was cut before, twice; one map.
    density = [3.0, 1.0, 2.0] if state == "dense" else None
    assert asked == [[[2, 1]], density, [[2, 1]]]
