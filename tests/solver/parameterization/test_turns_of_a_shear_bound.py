"""Rounds of a search for seams of a bounded shear, written in advance: which follow each other, what each asks for, and
which is the result."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.parameterization import shear_bound
from omt_uv.solver.parameterization.shear_bound import bound_shear


@dataclass
class Made:
    """A round: its name, by how much it misses the bound, whether in the mean, and whether it hardly helped."""

    name: str
    excess: float = 0.0
    mean_missed: bool = True
    hardly: bool = False
    nothing: bool = False
    shares_asked: list = field(default_factory=list)
    slits: dict = field(default_factory=dict)

    @property
    def searched(self):
        return [0] if self.excess else []

    @property
    def mean(self):
        return np.array([2.0 if self.mean_missed and self.excess else 1.0])

    bound = np.array([1.5])

    @property
    def cuts(self):
        return SimpleNamespace(edges=self.name)

    def settled_where_searched(self, search, all_of_them):
        assert not all_of_them
        return self

    def is_hardly_better(self, other):
        return self.hardly

    def changes(self, rounds):
        return {"adding": rounds > 1}

    def to_be_searched(self, apart):
        return [] if self.nothing or apart else [0]

    def shares(self, missed, promised, margin):
        self.shares_asked.append((missed, promised.tolist(), round(margin, 9)))
        return np.array([0.5]), np.array([0.25])

    def with_slits(self, found):
        self.slits |= found
        return self

    def with_what_is_better(self, search, new, worse):
        return new, worse


@pytest.fixture
def bounded(monkeypatch):
    """The result of rounds that are written, and what each was asked for."""

    def run(*rounds, apart=(), crossed=(), spared=None, crossing="crossing", ask_end=None, pieces=False, may_part=True):
        asked, rest, parts, crossings = [], list(rounds[1:]), list(apart), list(crossed)
        joined, halved, creased = [], [], []

        def halves(search, last, map_charts, early, stuck):
            halved.append((last.name, stuck))
            return worked(last)

        def creases(search, last, map_charts, early):
            creased.append(last.name)
            return worked(last)

        def first(search, prepared, maps, map_charts, free, early):
            asked.append(("first", free))
            return worked(rounds[0])

        def parting(search, last, crossing, k, worse):
            asked.append(("apart", last.name, crossing is not None, k))
            found = parts.pop(0) if parts else {}
            flag = crossings.pop(0) if crossings else False
            return worked((found, [], flag))

        def of(last, missed, apart, flat, spread, changes, tried):
            return SimpleNamespace(
                missed=missed, apart=apart, spread=spread.tolist(), changes=changes, tried=sorted(tried)
            )

        def anew(search, last, request, map_charts, early):
            asked.append(("cut", last.name, request))
            new = rest.pop(0) if rest else None
            if ask_end == len([a for a in asked if a[0] == "cut"]):
                early.is_asked = True
            return worked(last if new == "same" else new)

        def spare(search, last, map_sparing, early):
            asked.append(("spared", last.name))
            return worked(spared or last)

        def shorter(search, best, map_charts, map_sparing, early):
            asked.append(("shorter", best.name))
            return worked(best)

        def again(search, begun, last, map_charts, early):
            joined.append((begun.name, last.name))
            yield from ()
            return last

        class Early:
            is_asked = False

        monkeypatch.setattr(shear_bound, "EarlyEnd", Early)
        monkeypatch.setattr(shear_bound, "unless_ended", lambda steps, early: steps)
        monkeypatch.setattr(shear_bound, "edge_set", lambda edges: edges)
        monkeypatch.setattr(shear_bound, "_first_round", first)
        monkeypatch.setattr(shear_bound, "come_apart", parting)
        monkeypatch.setattr(shear_bound.Asked, "of", staticmethod(of))
        monkeypatch.setattr(shear_bound, "_cut_anew", anew)
        monkeypatch.setattr(shear_bound, "_with_areas_spared", spare)
        monkeypatch.setattr(shear_bound, "_made_shorter", shorter)
        monkeypatch.setattr(shear_bound, "_joined_again", again)
        monkeypatch.setattr(shear_bound, "_in_halves", halves)
        monkeypatch.setattr(shear_bound, "_along_all_creases", creases)
        monkeypatch.setattr(shear_bound, "JOINING", 0.0)

        def result(best, search, warnings, early, is_short):
            asked.extend([] if is_short else [("long", best.name)])
            return best.name, early.is_asked

        monkeypatch.setattr(shear_bound, "_result", result)
        search = SimpleNamespace(first_spread=lambda: np.array([8.0]), count=1)
        prepared = SimpleNamespace(warnings=())
        monkeypatch.setattr(shear_bound, "may_come_in_pieces", lambda *_: pieces)
        fractions, steps = [], bound_shear(search, prepared, [], None, crossing, may_part=may_part)
        try:
            while True:
                fractions.append(next(steps).fraction)
        except StopIteration as stop:
            found = stop.value
        # Charts are joined at the very end, of what there is then, unless somebody waits for it.
        assert joined == ([] if found[1] else [(rounds[0].name, found[0])])
        assert halved == [(rounds[0].name, True)]
        assert creased == [one.name for one in rounds[:1] if one.excess > shear_bound.FAR]
        # A round that is broken off is done anew by what makes the best shorter.
        assert min(fractions) >= 0 and max(fractions) <= 1 + 1e-9
        return found, asked, fractions

    return run


def names(asked, kind):
    return [a[1] for a in asked if a[0] == kind]


def test_what_keeps_the_bound_is_only_made_shorter(bounded):
    found, asked, fractions = bounded(Made("first"))
    assert found == ("first", False) and asked == [("first", True), ("shorter", "first")]
    assert bounded(Made("first"), crossing=None)[1][0] == ("first", False)
    assert fractions == pytest.approx([0, 0, 0, 0, 0, 1])


def test_what_may_come_in_pieces_is_not_made_shorter_before(bounded):
    assert bounded(Made("first"), pieces=True)[1] == [("first", True), ("long", "first")]
    # Not where nobody asks for pieces, or it is cut as long as it may be.
    for given, rounds in (({"may_part": False}, [Made("first")]), ({}, [Made("first", 2.0), None])):
        asked = bounded(*rounds, pieces=True, **given)[1]
        assert names(asked, "shorter") == ["first"] and not names(asked, "long")
    # What was spared is short, and what was broken off stays as it is.
    kept = bounded(Made("first", 2.0, mean_missed=False), spared=Made("spared"), pieces=True)
    assert kept[0][0] == "spared" and not names(kept[1], "long")
    found, asked, _ = bounded(Made("first", 3.0), Made("second", 0.0), ask_end=1, pieces=True)
    assert found == ("second", True) and not names(asked, "long")


def test_rounds_go_on_until_the_bound_is_kept(bounded):
    rounds = Made("first", 3.0), Made("second", 2.0), Made("third")
    found, asked, fractions = bounded(*rounds)
    assert (
        found == ("third", False)
        and names(asked, "cut") == ["first", "second"]
        and names(asked, "shorter") == ["third"]
    )
    requests = [a[2] for a in asked if a[0] == "cut"]
    # A share of the spread that there was is asked for, the more exactly the later.
    spread = [8.0 * 0.5**shear_bound.SPREAD_BY_SHEAR * 1.0]
    assert requests[0].spread == pytest.approx(spread) and requests[1].spread == pytest.approx([spread[0] ** 2 / 8])
    assert [w.changes["adding"] for w in requests] == [False, True] and all(
        w.changes["share"] == [0.5] for w in requests
    )
    assert [w.tried for w in requests] == [["first"], ["first", "second"]]
    margins = [r.shares_asked[0][2] for r in rounds[:2]]
    assert margins == pytest.approx([shear_bound.MARGIN, shear_bound.MARGIN**0.5])
    assert [r.shares_asked[0][1] for r in rounds[:2]] == [[np.inf], [0.25]]
    # Every round takes half of what is left, the last what the search for shorter cuts does.
    assert fractions[6:10] == pytest.approx([0, 0.15, 0.15, 0.5]) and fractions[-2:] == pytest.approx([0.75, 1.0])


def test_no_more_than_so_many_rounds(bounded):
    rounds = [Made(str(k), 9.0 - k) for k in range(9)]
    found, asked, fractions = bounded(*rounds)
    assert len(names(asked, "cut")) == 4 and found == ("4", False)
    assert fractions[-2:] == pytest.approx([1 - 0.5 ** (5 - 1), 1.0])


def test_a_round_that_is_worse_is_no_result_and_what_it_was_told_does_not_hold(bounded):
    rounds = Made("first", 2.0), Made("worse", 5.0), Made("third", 1.0), None
    found, asked, _ = bounded(*rounds)
    # It goes on from the best, without rehearsals; once more it does not try whether it crosses itself.
    assert found == ("third", False) and names(asked, "cut")[:2] == ["first", "first"]
    assert [a[2].changes.get("rehearse", "kept") for a in asked if a[0] == "cut"][:2] == ["kept", None]
    assert [a[2] for a in asked if a[0] == "apart"] == [True, True, True]
    assert [r.shares_asked[-1][1] for r in rounds[:1]] == [[np.inf]]
    found, asked, _ = bounded(*rounds, crossed=[True])
    assert [a[2] for a in asked if a[0] == "apart"] == [True, False, False]


def test_the_last_is_taken_where_it_is_as_good(bounded):
    assert bounded(Made("first", 2.0), Made("second", 2.0), None)[0] == ("second", False)
    assert bounded(Made("first", 2.0), Made("worse", 2.5), None)[0] == ("first", False)


def test_what_was_not_worth_a_map_asks_for_more(bounded):
    found, asked, _ = bounded(Made("first", 2.0), "same", Made("third"))
    assert found == ("third", False) and names(asked, "cut") == ["first", "first"]
    assert [a[2].tried for a in asked if a[0] == "cut"] == [["first"], ["first"]]


def test_a_round_that_hardly_helps_is_the_last_unless_something_comes_apart(bounded):
    # Early ones have a second chance.
    rounds = Made("first", 3.0), Made("second", 2.9, hardly=True), Made("third", 2.8, hardly=True), Made("fourth", 2.0)
    found, asked, _ = bounded(*rounds)
    assert found == ("third", False) and names(asked, "cut") == ["first", "second"]
    found, asked, _ = bounded(*rounds, apart=[{}, {}, {0: "edges"}])
    assert names(asked, "cut") == ["first", "second", "third", "fourth"]


def test_where_nothing_is_left_to_be_cut_it_ends(bounded):
    assert names(bounded(Made("first", 3.0, nothing=True))[1], "cut") == []
    second = Made("second")
    assert names(bounded(Made("first", 3.0, nothing=True), second, apart=[{0: "edges"}])[1], "cut") == ["first"]
    assert second.slits == {0: "edges"}  # which are known from then on


def test_what_is_steep_alone_is_spared_where_areas_may_be_less_exact(bounded):
    steep = Made("second", 1.0, mean_missed=False)
    found, asked, _ = bounded(Made("first", 3.0), steep, spared=Made("spared"))
    assert found == ("spared", False) and asked[-1] == ("spared", "second")
    found, asked, _ = bounded(Made("first", 3.0), steep, Made("third"))
    assert names(asked, "spared") == ["second"] and found == ("third", False)
    # In the first round, too; where the mean is missed, nothing is.
    found, asked, _ = bounded(Made("first", 3.0, mean_missed=False), Made("second"), spared=Made("spared"))
    assert found == ("spared", False) and not names(asked, "cut")
    assert not names(bounded(Made("first", 3.0), Made("second", 2.0), Made("third"))[1], "spared")


def test_an_end_that_is_asked_for_keeps_the_best_as_it_is(bounded):
    found, asked, _ = bounded(Made("first", 3.0), Made("second", 2.0), None, ask_end=2)
    assert found == ("second", True) and not names(asked, "shorter")
