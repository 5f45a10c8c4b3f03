"""Which cut a part gets, with nets, seams and symmetric cuts written in advance."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.cutting import cuts
from omt_uv.solver.progress import drain


class Net:
    """A net of a length, which is taken up to a limit."""

    most, cut, tips, has_teeth = 50.0, "net", "tips", True

    def __init__(self, length, comb, winds=False):
        self.length, self.comb, self.winds, self.asked = length, comb, winds, []

    def is_comb(self, needed):
        return self.comb and needed < 7

    def up_to(self, limit):
        self.asked.append(limit)
        return self if self.length <= limit else None


@pytest.fixture
def best(monkeypatch):
    """The best cut of a part, and what was tried for it."""

    def run(*, length=None, other=10.0, comb=False, winding=False, boundaries=1, needed=5.0, **given):
        extremities = given.pop("extremities", 6)
        filled, searched, again, search = (
            given.get(n, n == "search") for n in ("filled", "searched", "again", "search")
        )
        tried = []
        made = None if length is None else Net(length, comb, winding)
        monkeypatch.setattr(cuts, "net", lambda component: (tried.append("net"), made)[1])

        def plain(component, topology, k, extremities, outline):
            tried.append(f"cut {extremities} {outline}")
            return np.array([0, 2]), "other tips"

        def searching(self, component, topology, k, finder):
            tried.append("search")
            return worked(("seams", "ends"))

        monkeypatch.setattr(cuts, "cut_component", plain)
        monkeypatch.setattr(cuts._Cutter, "_search_component", searching)
        monkeypatch.setattr(cuts, "_needed", lambda *_: needed)
        finder = SimpleNamespace(is_again=again) if search else None
        topology = SimpleNamespace(boundaries=[boundaries])
        cutter = cuts._Cutter(None, None, None, None, extremities, finder, "outline")
        component = SimpleNamespace(length=np.array([0.6 * other, 99.0, 0.4 * other]))
        found = drain(cutter._best_cut(component, topology, 0, filled, searched))
        return (found[0] if isinstance(found[0], str) else "cut"), tried, made

    return run


def test_a_net_is_taken_that_is_short_by_itself_or_hardly_longer_than_other_cuts(best):
    assert best(length=50.0)[:2] == ("net", ["net"])
    found, tried, net = best(length=50.0 + 1e-9, other=50.0 / 1.5 + 1e-3)
    assert (
        found == "net" and tried == ["net", "cut 6 outline"] and net.asked == pytest.approx([50.0, 50.0 + 1.5 * 1e-3])
    )
    assert best(length=60.0, other=59.0 / 1.5)[0] == "cut" and best()[:2] == ("cut", ["net", "cut 6 outline"])


def test_what_is_searched_has_a_net_or_seams(best):
    assert best(length=50.0, searched=True)[:2] == ("net", ["net"])
    assert best(length=51.0, searched=True)[:2] == best(searched=True)[:2] == ("seams", ["net", "search"])
    # Once its map has missed the bound a net is not asked for.
    assert best(length=1.0, searched=True, again=True)[:2] == ("seams", ["search"])
    assert best(length=1.0, searched=True, search=False)[0] == "net"
    assert best(searched=True, search=False)[1] == ["net", "cut 6 outline"]


def test_combs_are_no_nets_of_what_has_a_boundary_and_is_searched(best):
    assert best(length=50.0, searched=True, comb=True)[:2] == ("seams", ["net", "search"])
    for given in ({"boundaries": 0}, {"needed": 8.0}, {"searched": False}):
        assert best(**{"length": 50.0, "searched": True, "comb": True} | given)[0] == "net"


def test_what_winds_along_a_border_is_no_net_of_what_is_searched(best):
    for boundaries in (0, 1):
        found = best(length=50.0, searched=True, winding=True, boundaries=boundaries)
        assert found[:2] == ("seams", ["net", "search"])
    assert best(length=50.0, winding=True)[0] == "net"


@pytest.mark.parametrize("disk", [True, False])
def test_what_has_to_be_cut_anyway_is_needed(disk, monkeypatch):
    asked = []

    def plain(component, topology, k, extremities):
        asked.append(extremities)
        return np.array([0, 2]), "tips"

    monkeypatch.setattr(cuts, "cut_component", plain)
    component = SimpleNamespace(length=np.array([1.0, 2.0, 4.0]))
    assert cuts._needed(component, SimpleNamespace(is_disk=[disk]), 0) == (0.0 if disk else 5.0)
    assert asked == ([] if disk else [0])


def test_nets_are_for_what_is_cut_to_tips_and_not_filled(best):
    assert best(length=1.0, filled=True)[:2] == ("cut", ["cut 6 outline"])
    assert best(length=1.0, extremities=0)[:2] == ("cut", ["cut 0 outline"])
    assert best(length=1.0, extremities=0, searched=True)[:2] == ("net", ["net"])


@pytest.mark.parametrize(
    ("boundaries", "handles", "disk", "chosen", "based", "cut"),
    [
        (0, 0, False, 3, False, False),
        (0, 0, False, 1, False, True),
        (1, 0, True, 0, False, False),
        (1, 0, True, 1, False, False),
        (2, 0, False, 3, True, False),
        (0, 1, False, 3, True, False),
        (0, 1, False, 1, True, False),
    ],
)
def test_seams_are_searched_with_what_makes_a_disk(boundaries, handles, disk, chosen, based, cut, monkeypatch):
    asked = []

    def plain(component, topology, k, extremities):
        asked.append((component.name, extremities))
        return np.array([component.name == "priced", True, False, False]), "tips"

    component = SimpleNamespace(name="plain", pair=np.zeros(4), cost=np.ones(4))
    priced = SimpleNamespace(name="priced", cost=np.array([-1.0, 5.0, 1.0, 1.0]))

    class Search:
        def priced(self, component):
            return priced

        def __call__(self, component, base):
            asked.append(("search", base.tolist()))
            return worked(np.arange(4) < chosen)

    monkeypatch.setattr(cuts, "cut_component", plain)
    monkeypatch.setattr(cuts, "_tips", lambda component, chosen: ("ends", int(chosen.sum())))
    topology = SimpleNamespace(boundaries=[boundaries], handles=[handles], is_disk=[disk])
    cutter = cuts._Cutter(None, None, None, None, 6, None, False)
    found = drain(cutter._search_component(component, topology, 0, Search()))
    # The cheaper of both cuts by the prices of the search.
    base = [True, True, False, False] if based else [False] * 4
    assert asked == [("priced", 0), ("plain", 0)] * based + [("search", base)] + [("plain", 6)] * cut
    assert found[1] == ("tips" if cut else ("ends", chosen))


def test_tips_are_ends_of_cuts_inside():
    component = SimpleNamespace(
        ends=np.array([[0, 1], [1, 2], [2, 3], [1, 4], [5, 6]]),
        vertex_count=7,
        on_boundary=lambda: np.array([True, False, False, False, False, False, True]),
    )
    assert cuts._tips(component, np.array([True, True, True, True, True])).tolist() == [3, 4, 5]
    assert cuts._tips(component, np.array([False, True, False, False, False])).tolist() == [1, 2]


def test_items_are_put_in_the_order_of_their_parts():
    order, start = cuts._by_component(np.array([2, 0, 2, 3, 0]), 5)
    assert order.tolist() == [1, 4, 0, 2, 3] and start.tolist() == [0, 2, 2, 4, 5, 5]


@pytest.fixture
def symmetric(monkeypatch):
    """Whether a symmetric cut is taken, and what it was asked for; spreads are of the logarithm of the scale."""

    def run(*, halves=True, plain=1.0, spread=1.0, cost=1.0, found=True, extremities=6, outline=False):
        asked = []
        chosen = {"plain": np.array([True, False]), "symmetric": np.array([False, True])}
        monkeypatch.setattr(cuts, "_plain_cut", lambda *_: (chosen["plain"], "plain"))
        monkeypatch.setattr(cuts, "symmetric_halves", lambda component: ["half", "other"] if halves else [])

        def cut(half, extremities, bound):
            asked.append((half, extremities, bound))
            return (chosen["symmetric"], "symmetric") if found else None

        which = lambda cut: plain if cut[0] else spread  # noqa: E731
        monkeypatch.setattr(cuts, "symmetric_cut", cut)
        monkeypatch.setattr(cuts, "outlined_cut", cut)
        monkeypatch.setattr(cuts, "log_scale", lambda component, cut: cut)
        monkeypatch.setattr(cuts, "spread", lambda component, cut: which(cut))
        monkeypatch.setattr(cuts, "outline_spread", lambda component, cut: which(cut))
        component = SimpleNamespace(cost=np.array([1.0, cost]))
        return cuts.cut_component(component, None, 0, extremities, outline)[1], asked

    return run


def test_what_is_its_own_mirror_image_is_cut_alike_on_both_sides(symmetric):
    found, asked = symmetric()
    assert found == "symmetric" and asked == [("half", 6, min(cuts.BEARABLE, 1.1))]
    assert symmetric(halves=False) == ("plain", []) and symmetric(found=False)[0] == "plain"
    # What is hardly steep is as good as flat.
    assert symmetric(plain=0.0)[1][0][2] == pytest.approx(min(cuts.BEARABLE, 1.1 * cuts.UNSEEN))
    assert symmetric(plain=1e9)[1][0][2] == cuts.BEARABLE and symmetric(extremities=0)[1][0][2] == cuts.BEARABLE


@pytest.mark.parametrize("spread", [0.5, 1.0, 1.44])
@pytest.mark.parametrize(("share", "taken"), [(0.999, True), (1.001, False)])
def test_symmetry_may_cost_so_much_more_and_less_where_it_is_steeper(share, taken, spread, symmetric):
    cost = share * 1.5 / np.sqrt(max(spread, 1.0))
    assert symmetric(cost=cost, spread=spread)[0] == ("symmetric" if taken else "plain")
    # Without tips nothing is known of how steep it is.
    assert symmetric(cost=share * 1.5, spread=spread, extremities=0)[0] == ("symmetric" if taken else "plain")


@pytest.mark.parametrize(("steeper", "taken"), [(0.999, True), (1.001, False)])
def test_outlines_are_not_much_more_distorted(steeper, taken, symmetric):
    found, asked = symmetric(outline=True, spread=steeper * 1.5, cost=0.1)
    assert found == ("symmetric" if taken else "plain")
    assert asked == [(["half", "other"], 6, min(cuts.BEARABLE, 1.5))]


@pytest.mark.parametrize(
    ("given", "begins"),
    [
        ((False, 0, 0, 0, 0), []),
        ((True, 0, 0, 0, 0), ["A part with many handles was taken apart"]),
        ((False, 1, 0, 0, 0), ["A face looks to the other side than the faces around"]),
        ((False, 3, 0, 0, 0), ["3 faces look to the other side"]),
        ((False, 0, 1, 0, 0), ["Where a surface has one side only, a face looks"]),
        ((False, 0, 2, 0, 0), ["Where a surface has one side only, 2 faces look"]),
        ((False, 0, 0, 4, 0), [cuts.sieved(4)]),
        ((False, 0, 0, 0, 5), ["5 boundary vertices lie on one another"]),
        ((True, 1, 1, 1, 1), ["A part", "A face", "Where", cuts.sieved(1), "1 boundary"]),
    ],
)
def test_what_was_done_to_a_surface_is_told(given, begins):
    found = list(cuts._warnings(*given))
    assert len(found) == len(begins) and all(a.startswith(b) for a, b in zip(found, begins, strict=True))
