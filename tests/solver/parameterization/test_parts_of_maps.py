"""Parts of what maps charts, and what they decide, one by one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.analysis.straight_paths import TURN
from omt_uv.solver.cutting import component_order
from omt_uv.solver.cutting.cuts import Cuts
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.errors import DensityError, MeshError, PinError
from omt_uv.solver.mesh.charts import Chart, part_of_chart
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops, pair_keys
from omt_uv.solver.parameterization import (
    chart_indices,
    convex_maps,
    initial_map,
    mirrored_charts,
    pieces,
    shear_bound,
    shear_search,
    small_charts,
)
from omt_uv.solver.parameterization.chart_map import FOLDED, ChartMap
from omt_uv.solver.parameterization.options import MapOptions, ShearBound, UnwrapOptions
from omt_uv.solver.parameterization.polygons import convexity, polygon_disk
from omt_uv.solver.progress import EarlyEnd, RunLog, drain
from omt_uv.solver.refinement import batch_refine
from omt_uv.solver.refinement.vertex_sweeps import smoothed_uv
from omt_uv.solver.seams import parting


def chart_of(V, F, faces=None, ids=None):
    """A chart of triangles with corners of its own."""
    faces = np.arange(len(F)) if faces is None else np.asarray(faces)
    ids = np.arange(len(V)) if ids is None else np.asarray(ids)
    return Chart(V, F, np.arange(F.size).reshape(-1, 3), faces, ids)


@dataclass(frozen=True)
class FakePrepared:
    """Charts with the cuts that made them."""

    charts: list
    found_cuts: Cuts
    cuts: object = None


def cuts_of(edges):
    """Cuts along edges, each of length 1."""
    edges = np.array(edges, np.int64).reshape(-1, 2)
    return Cuts(edges, float(len(edges)), (), edges[:0], ())


def map_of(uv, **given):
    """A map with these figures."""
    return ChartMap(uv=uv, **{"area_l1": 0.01, "area_sd": 0.01, "angle_mean": 1.1, "folds": 0} | given)


def steps_of(value):
    def steps(*_, **__):
        return value
        yield

    return steps


# Rounds of a search for a bound of the shear.


def round_of(
    areas, means, pressing=None, searched=None, memory=None, charts=None, maps=None, bound=1.35, edges=(), steep=0.0
):
    means = np.array(means, float)
    pressing = means if pressing is None else np.array(pressing, float)
    areas = np.array(areas, float)
    searched = np.flatnonzero(pressing > bound).tolist() if searched is None else searched
    charts = charts or [SimpleNamespace(faces=np.array([k])) for k in range(len(areas))]
    maps = maps or [SimpleNamespace(failure=None, folds=0) for _ in areas]
    cuts = cuts_of(edges)
    steep = np.broadcast_to(steep, areas.shape)
    return shear_search.Round(charts, maps, cuts, memory or {}, areas, means, steep, pressing, bound, searched)


def cutting(asked, new):
    """In the place of `_cut_anew`: tells what is asked and gives a new round."""

    def cut_anew(search, before, what, map_charts, early):
        asked.append(what)
        return new
        yield

    return cut_anew


def test_what_is_missing_is_the_excess_times_the_area_of_what_is_searched():
    one = round_of([1, 2, 5], [1.3, 1.55, 1.95], searched=[1])
    np.testing.assert_allclose(one.missing, [0, 2 * 0.2, 0])
    assert one.excess == pytest.approx(0.4 / 8)


@pytest.mark.parametrize(
    "now, then, hardly",
    [
        ([1.60], [1.61], True),
        ([1.36], [1.61], False),
        ([1.60], [1.90], False),
        ([1.358], [1.359], False),
    ],
)
def test_a_round_is_hardly_better_where_as_much_misses_the_bound_by_much(now, then, hardly):
    assert round_of([1], now).is_hardly_better(round_of([1], then)) == hardly


def test_a_round_in_which_more_area_keeps_the_bound_is_better():
    # The same excess, on half of the area.
    assert not round_of([1, 1], [1.2, 1.85]).is_hardly_better(round_of([1, 1], [1.6, 1.6]))


@pytest.mark.parametrize(
    "mean, steep, pressing",
    [
        (1.2, 0.0, 1.2),
        (1.2, 0.01, 1.2),
        (1.2, 0.02, 1.5 * 1.02),
        (1.0, 0.5, 1.0),
        (1.9, 0.5, 1.5 * 1.5),
        (3.0, 0.5, 3.0),
    ],
)
def test_what_is_steep_presses_as_if_the_mean_missed_the_bound(mean, steep, pressing):
    assert shear_search.pressing_shear(mean, steep, 1.5) == pytest.approx(pressing)


def test_charts_have_room_below_most_of_the_squared_logarithm():
    bound = 1.35
    shears = [np.exp(np.sqrt(share) * np.log(bound)) for share in (0.84, 0.86, 1.2)]
    assert round_of([1] * 4, [*shears, 1.0]).has_room.tolist() == [True, False, False, False]


def test_what_is_allowed_is_the_bound_over_what_there_is():
    one = round_of([1], [1.1])
    assert one.share_allowed(0) == pytest.approx(0.95 * np.log(1.35) ** 2 / np.log(1.1) ** 2)


@pytest.mark.parametrize("steep, room", [(0.0, True), (0.005, True), (0.009, False), (0.02, False)])
def test_what_is_nearly_too_steep_has_no_room(steep, room):
    one = round_of([1], [1.1], steep=steep)
    assert one.has_room.tolist() == [room]
    most = np.log(1.35) ** 2 / np.log(1.1) ** 2
    assert one.share_allowed(0) <= 0.95 * most and (one.share_allowed(0) < 0.95) == (steep > 0.01)


@pytest.mark.parametrize("rehearsed, mean, slack", [(1.0, 1.1, True), (None, 1.1, True), (1.0, 1.34, False)])
def test_slack_is_where_a_search_asked_for_more_than_the_map_needs(rehearsed, mean, slack):
    memory = {"it": SimpleNamespace(polygons=np.array([0]), rehearsed=rehearsed)}
    assert round_of([1], [mean], memory=memory).has_slack(0) == slack
    # What was not searched has none.
    assert not round_of([1], [mean], memory={}).has_slack(0)
    other = {"it": SimpleNamespace(polygons=np.array([0, 1]), rehearsed=rehearsed)}
    assert not round_of([1, 1], [mean, 1.0], memory=other).has_slack(0)


def test_what_came_apart_or_is_stuck_is_not_searched_again():
    memory = {k: SimpleNamespace(polygons=np.array([k]), is_stuck=k == 1) for k in range(4)}
    one = round_of([1] * 4, [1.5] * 4, memory=memory)
    assert one.to_be_searched({2: np.zeros((1, 2))}) == [0, 3]


@dataclass(frozen=True)
class FoundOnce:
    """What a search has found of polygons (m,)."""

    polygons: np.ndarray
    is_stuck: bool = False


def test_what_a_search_comes_to_again_and_hardly_got_on_with_is_not_asked_for_more():
    one = round_of([1] * 3, [1.5] * 3, memory={k: FoundOnce(np.array([k])) for k in range(3)})
    one.tell_stuck({0: FoundOnce(np.zeros(1)), 1: FoundOnce(np.zeros(1), True), 7: FoundOnce(np.zeros(1), True)})
    assert one.to_be_searched({}) == [0, 2] and sorted(one.memory) == [0, 1, 2]
    assert one.memory[1].polygons == [1]


def test_shares_ask_for_what_is_left_and_for_what_was_promised_and_not_kept():
    maps = [SimpleNamespace(failure=None), SimpleNamespace(failure="none"), SimpleNamespace(failure=None)]
    charts = [
        SimpleNamespace(faces=np.array([0, 1])),
        SimpleNamespace(faces=np.array([2])),
        SimpleNamespace(faces=np.array([3])),
    ]
    one = round_of([1] * 3, [1.6, 1.0, 1.5], charts=charts, maps=maps)
    share, promised = one.shares([0, 1], np.full(4, np.inf), 0.9)
    reached, bound = np.log(1.6) ** 2, np.log(1.35) ** 2
    np.testing.assert_allclose(share, [0.9 * bound / reached] * 2 + [0.5, 1.0])
    np.testing.assert_allclose(promised, [0.9 * bound] * 2 + [np.inf] * 2)
    again, after = one.shares([0], promised, 1.0)
    np.testing.assert_allclose(again[:2], 0.9 * bound / reached * bound / reached)
    np.testing.assert_allclose(after[:2], again[:2] * reached)
    assert again[2] == 1


def test_outlines_are_as_long_as_the_edges_around_both_sides_of_a_slit():
    V, F = meshes.grid(3, 2)
    one = round_of([1, 1], [1, 1], charts=[chart_of(V, F), chart_of(2 * V, F[:1])])
    p = 2 * V[F[0]]
    np.testing.assert_allclose(one.outline_length, [4, sum(np.linalg.norm(p[k] - p[k - 1]) for k in range(3))])


def search_of(**given):
    fields = {
        "surface": triangle_surface(*meshes.grid(5, 1)),
        "faces": None,
        "shear": ShearBound(1.35),
        "target": None,
        "cutting": {},
    }
    return shear_search.ShearSearch(**fields | given)


def test_a_first_spread_goes_with_the_bound():
    found = search_of().first_spread()
    assert found.shape == (10,)
    np.testing.assert_allclose(found, 0.19 * np.log(1.35) ** 2)


@pytest.mark.parametrize("bound, rehearses", [(1.19, False), (1.2, True), (1.5, True)])
def test_searches_are_rehearsed_from_a_bound_on(bound, rehearses):
    found = search_of(shear=ShearBound(bound, True)).search(np.zeros(10))
    assert (found.rehearse is not None) == rehearses and found.further
    assert found.asked == pytest.approx(np.log(bound) ** 2)


def test_a_later_search_knows_what_was_rehearsed_before():
    search = search_of()
    search.search(np.zeros(10)).rehearsed[b"it"] = 0.1
    assert search.search(np.ones(10)).rehearsed == {b"it": 0.1} and search_of().search(np.ones(10)).rehearsed == {}


def test_twins_are_found_by_the_images_of_all_vertices():
    image = np.array([3, 4, 5, 0, 1, 2, 6])
    charts = [SimpleNamespace(vertex_ids=np.array(x)) for x in ([2, 0, 1], [0, 1, 6], [5, 4, 3], [3, 4, 6], [6])]
    exact = SimpleNamespace(exact=image, are_exact=True)
    assert chart_indices.mirror_twins(charts, exact).tolist() == [-1, -1, 0, 1, -1]
    assert chart_indices.mirror_twins(charts[:1], exact).tolist() == [-1]
    assert chart_indices.mirror_twins(charts, SimpleNamespace(exact=image, are_exact=False)).tolist() == [-1] * 5
    assert chart_indices.mirror_twins(charts, None).tolist() == [-1] * 5


def test_only_one_of_two_twins_is_searched_and_both_are_cut(monkeypatch):
    asked = []

    def cut(self, kept, search):
        asked.append((kept.tolist(), search.spread.copy()))
        edges = [[0, 1], [2, 9]] if len(asked) == 1 else [[7, 8]]
        cuts = cuts_of(edges)
        return SimpleNamespace(found_cuts=cuts, cuts=cuts)
        yield

    monkeypatch.setattr(shear_search.ShearSearch, "_cut", cut)
    monkeypatch.setattr(shear_search, "replace", lambda one, **changes: SimpleNamespace(**{**vars(one), **changes}))
    monkeypatch.setattr(shear_search.ShearSearch, "search", lambda self, spread: SimpleNamespace(spread=spread))
    search = search_of()
    search.__dict__["images"] = SimpleNamespace(exact=np.array([3, 4, 5, 0, 1, 2, 6, 7, 8, 9]), are_exact=True)
    charts = [
        SimpleNamespace(vertex_ids=np.array([0, 1, 2]), faces=np.array([0, 1])),
        SimpleNamespace(vertex_ids=np.array([3, 4, 5]), faces=np.array([2, 3])),
    ]
    slits = np.array([[1, 2], [4, 5], [6, 0]])
    for given, more in (((), [[3, 4]]), ((slits,), [[1, 2], [4, 5], [6, 0], [3, 4]])):
        asked.clear()
        found = drain(search.again(np.array([[8, 9]]), charts, np.arange(10.0), {}, *given))
        np.testing.assert_array_equal(asked[0][1], [0, 1] + [np.inf] * 8)
        assert asked[1][0] == [[8, 9], [0, 1], [2, 9], *more] and np.isinf(asked[1][1]).all()
        assert found.cuts.edges.tolist() == [[0, 1], [2, 9], *more, [7, 8]]
    # By itself none has an image, and what was slit is slit again, nothing else.
    asked.clear()
    found = drain(search.again(np.array([[8, 9]]), charts[:1], np.arange(10.0), {}, slits[:1]))
    assert [kept for kept, _ in asked] == [[[8, 9]], [[8, 9], [0, 1], [2, 9], [1, 2]]]
    asked.clear()
    found = drain(search.again(np.array([[8, 9]]), charts[:1], np.arange(10.0), {}))
    assert len(asked) == 1 and found.cuts.edges.tolist() == [[0, 1], [2, 9]]


def test_slits_within_charts_are_known_to_later_rounds():
    slit_open = SimpleNamespace(triangles=np.array([[0, 1, 2], [3, 4, 5]]), vertex_ids=np.array([0, 1, 2, 0, 2, 3]))
    one = replace(round_of([1], [1.0], charts=[slit_open]), cuts=cuts_of([[2, 0], [0, 1], [9, 1]]))
    assert not len(one.slits_within([0])) and one.with_slits({}).slits.tolist() == []
    slit = one.with_slits({0: np.array([[0, 2]])}).with_slits({3: np.array([[1, 9]])})
    assert slit.slits_within([0]).tolist() == [[2, 0]] and not len(slit.slits_within([]))
    assert not len(one.slits)


@pytest.mark.parametrize(
    "mean, late, rounds, may",
    [
        (1.35 * 1.011, True, 1, True),
        (1.35 * 1.009, True, 1, False),
        (1.35 * 1.011, False, 1, False),
        (1.35**1.17, False, 1, True),
        (1.35**1.15, False, 1, False),
        (1.0, False, 3, True),
        (1.0, False, 2, False),
    ],
)
def test_charts_may_cross_themselves_where_they_miss_the_bound_by_much_or_late(mean, late, rounds, may):
    assert pieces._may_cross(round_of([1], [mean]), 0, late, rounds) == may


@pytest.mark.parametrize(
    "pressing, sparing, after, taken",
    [
        (1.35 * 1.04, True, 1.3, True),
        (1.35 * 1.06, True, 1.3, False),
        (1.35 * 1.04, True, 1.39, True),
        (1.35 * 1.04, True, 1.42, False),
        (1.35 * 1.04, False, 1.3, False),
    ],
)
@pytest.mark.parametrize("folds", [0, 2])
def test_areas_are_spared_where_the_bound_is_missed_by_little_and_it_helps(
    folds, pressing, sparing, after, taken, monkeypatch
):
    last = round_of([1, 1], [1.0, pressing])
    last.maps[1].folds = folds
    asked = []

    def spare(charts, starts):
        # They begin where they lie, unless that has folds.
        assert starts == [None if folds else last.maps[1]]
        asked.append(charts)
        return ["spared"]
        yield

    made = []

    def of(search, charts, maps, cuts, memory, settled, slits):
        assert settled is last.settled and slits is last.slits
        made.append(maps)
        return round_of([1, 1], [1.0, after])

    def straightened(search, new, map_charts, early):
        assert map_charts is spare
        return ("straight", new)
        yield

    monkeypatch.setattr(shear_bound.Round, "of", staticmethod(of))
    monkeypatch.setattr(shear_bound, "_straightened", straightened)
    found = drain(shear_bound._with_areas_spared(None, last, spare if sparing else None, EarlyEnd()))
    assert (found is not last) == taken
    # What keeps the bound then is straightened as others are, with maps that are spared as well.
    assert isinstance(found, tuple) == (taken and after <= 1.35)
    if asked:
        assert asked == [[last.charts[1]]] and made == [[last.maps[0], "spared"]]


@pytest.mark.parametrize(
    ("shear", "asked"),
    [
        (1.2, ["_taken_back", "_parts_cut_anew", "_straightened"]),
        (1.38, ["_with_areas_spared"]),
        (1.5, ["_along_all_creases", "_in_halves", "_with_areas_spared"]),
    ],
)
def test_a_round_is_made_shorter_only_within_the_bound(shear, asked, monkeypatch):
    """What misses it by much comes apart before areas are spared."""
    calls = []
    for name in (
        "_along_all_creases",
        "_in_halves",
        "_with_areas_spared",
        "_taken_back",
        "_parts_cut_anew",
        "_straightened",
    ):

        def steps(search, last, *_, name=name):
            calls.append(name)
            return last
            yield

        monkeypatch.setattr(shear_bound, name, steps)
    last = round_of([1], [shear])
    assert drain(shear_bound._made_shorter(None, last, None, None, EarlyEnd())) is last
    assert calls == asked


@pytest.mark.parametrize(("after", "taken"), [(None, False), (1.5, False), (1.49, True), (1.1, True)])
def test_what_misses_its_bound_comes_apart_along_all_creases_where_that_helps(after, taken, monkeypatch):
    """All that was searched is cut anew, from nothing, and creases count as they are drawn."""
    last, new = round_of([1, 1, 1], [1.5, 1.2, 1.5]), None if after is None else round_of([1, 1, 1], [after, 1.2, 1.5])
    asked = []

    monkeypatch.setattr(shear_bound, "_cut_anew", cutting(asked, new))
    monkeypatch.setattr(shear_bound.Round, "kept", lambda self, chosen: ("kept", *chosen))
    search = SimpleNamespace(first_spread=lambda: "spread")
    found = drain(shear_bound._along_all_creases(search, last, None, EarlyEnd()))
    assert found is (new if taken else last)
    assert (asked[0].charts, asked[0].kept, asked[0].spread) == ([0, 2], ("kept", 0, 2), "spread")
    assert asked[0].changes == {"as_drawn": True} and asked[0].is_worth(last.cuts)


@pytest.mark.parametrize(
    ("after", "taken"),
    [
        ([None], 0),
        ([1.6], 0),
        ([1.49], 0),
        ([1.4, 1.6], 1),
        ([1.4, 1.36], 2),
        ([1.45, 1.42, 1.395, 1.3], 3),
        ([1.3], 1),
    ],
)
def test_what_misses_its_bound_by_much_comes_apart_in_halves_as_often_as_that_helps(after, taken, monkeypatch):
    """What is not much better is no help."""
    rounds = [round_of([1, 1, 1], [1.5, 1.2, 1.36])]
    rounds += [None if mean is None else round_of([1, 1, 1], [mean, 1.2, 1.36]) for mean in after]
    asked, made = [], iter(rounds[1:])

    def cut_anew(search, last, task, *_):
        asked.append(task)
        return next(made)
        yield

    monkeypatch.setattr(shear_bound, "_cut_anew", cut_anew)
    monkeypatch.setattr(parting, "halves", lambda chart, cost: np.array([[chart.faces[0], cost]]))
    monkeypatch.setattr(shear_bound.Round, "kept", lambda self, chosen: np.array([[7, 8]]))
    costs = SimpleNamespace(vertex_cost=9)
    search = SimpleNamespace(first_spread=lambda: "spread", costs=lambda: costs, cutting={})
    assert drain(shear_bound._in_halves(search, rounds[0], None, EarlyEnd())) is rounds[taken]
    assert asked[0].charts == [0] and asked[0].kept.tolist() == [[7, 8], [0, 9]] and asked[0].spread == "spread"
    assert asked[0].changes == {} and asked[0].is_worth(rounds[0].cuts)
    # Not where anything is to be kept free.
    search.cutting["avoid"] = np.zeros(3)
    assert drain(shear_bound._in_halves(search, rounds[0], None, EarlyEnd())) is rounds[0]


@pytest.mark.parametrize(
    ("status", "area_error", "halved"),
    [("steps", 0.11, True), ("steps", 0.09, False), ("steps", np.inf, False), ("converged", 0.5, False)],
)
def test_only_maps_that_took_all_steps_and_are_far_from_their_areas_are_halved_at_first(
    status, area_error, halved, monkeypatch
):
    first, made = round_of([1, 1], [1.5, 1.5]), round_of([1, 1], [1.3, 1.5])
    first.maps[:] = [
        SimpleNamespace(status=status, area_l1=area_error),
        SimpleNamespace(status="converged", area_l1=0.2),
    ]
    asked = []
    monkeypatch.setattr(shear_bound, "_cut_anew", lambda search, last, task, *_: worked(asked.append(task) or made))
    monkeypatch.setattr(parting, "halves", lambda chart, cost: np.array([[chart.faces[0], cost]]))
    monkeypatch.setattr(shear_bound.Round, "kept", lambda self, chosen: np.array([[7, 8]]))
    made.maps[:] = [SimpleNamespace(status="converged", area_l1=0.0)] * 2
    costs = SimpleNamespace(vertex_cost=9)
    search = SimpleNamespace(first_spread=lambda: "spread", costs=lambda: costs, cutting={})
    found = drain(shear_bound._in_halves(search, first, None, EarlyEnd(), stuck=True))
    assert [task.charts for task in asked] == ([[0]] if halved else [])
    assert found is (made if halved else first)


@pytest.mark.parametrize(
    "outcomes, kept",
    [
        ([[1.3]], 0),
        ([[1.5], [1.3]], 1),
        ([[1.5], [1.4]], None),
        ([None], None),
        (["last"], None),
    ],
)
def test_shorter_cuts_are_taken_where_they_keep_the_bound(outcomes, kept, monkeypatch):
    memory = {"it": SimpleNamespace(polygons=np.array([0]), rehearsed=1.0)}
    charts = [chart_of(*meshes.single_triangle())]
    last = round_of([1], [1.1], memory=memory, charts=charts, edges=[[0, 1], [1, 2]])
    made, asked = [], []

    def cut_anew(search, before, what, map_charts, early):
        outcome = outcomes[len(asked)]
        asked.append(what)
        made.append(None if outcome is None else last if outcome == "last" else round_of([1], outcome))
        return made[-1]
        yield

    monkeypatch.setattr(shear_bound, "_cut_anew", cut_anew)
    search = SimpleNamespace(
        count=3,
        first_spread=lambda: np.full(3, 0.2),
        surface=SimpleNamespace(positions=np.eye(4)[:, :3]),
        with_images=lambda charts, chosen: chosen,
    )
    found = drain(shear_bound._taken_back(search, last, None, EarlyEnd()))
    assert found is (last if kept is None else made[kept])
    for k, what in enumerate(asked):
        share = last.share_allowed(0) ** [1.0, 0.5][k]
        np.testing.assert_allclose(what.changes["share"], [share, 1, 1])
        np.testing.assert_allclose(what.spread, 0.2 * np.array([share, 1, 1]) ** shear_bound.SPREAD_BY_SHEAR)
        assert what.charts == [0] and what.changes["adding"]
        # Both edges are of length 1.414, or one less is shorter by half.
        assert what.is_worth(np.array([[0, 1]])) and not what.is_worth(np.array([[0, 1], [1, 2]] * 2))


@pytest.mark.parametrize(
    ("mean", "small", "stays"), [(1.4, 0.05, False), (1.3, 0.05, True), (1.4, 0.2, True), (1.3, 0.0, False)]
)
def test_flat_sides_part_where_the_bound_is_missed_though_what_is_left_misses_it_by_more(
    mean, small, stays, monkeypatch
):
    """A small piece that shears by 6 is cut further, instead of the whole around it; what kept the bound stays."""
    first = round_of([1, 1], [mean, 1.2])
    charts = [SimpleNamespace(faces=np.array([k])) for k in (0, 0, 1)]
    new = round_of([1 - small, small, 1], [1.0, 6.0 if small else 1.0, 1.2], charts=charts)
    monkeypatch.setattr(shear_bound.Round, "of", staticmethod(lambda *_: first))
    monkeypatch.setattr(shear_bound.Round, "kept", lambda self, chosen: np.zeros((0, 2), int))
    monkeypatch.setattr(shear_bound.Round, "merged", lambda self, search, other, of, stay: stay.tolist())
    monkeypatch.setattr(shear_bound, "but_within", lambda edges, charts: edges)
    monkeypatch.setattr(parting, "flat_sides", lambda chart, sharp: np.array([[0, 1]])[: chart is first.charts[0]])
    monkeypatch.setattr(shear_bound, "_cut_anew", lambda search, last, asked, *_: worked(new))
    shear = SimpleNamespace(further=True)
    search = SimpleNamespace(
        cutting={}, target=None, shear=shear, memory={}, count=2, surface=None, first_spread=lambda: np.ones(2)
    )
    prepared = SimpleNamespace(charts=first.charts, found_cuts=first.cuts)
    found = drain(shear_bound._first_round(search, prepared, first.maps, None, True, EarlyEnd()))
    # The other chart has no flat sides, and is as it was whatever becomes of it.
    assert found is first if stays else found[0] is False


@pytest.mark.parametrize("settled", [[], [3]])
def test_pieces_that_are_cut_further_stay_whole_in_the_first_round(settled):
    one = replace(round_of([1], [1.5]), settled=np.array(settled, np.int64))
    assert one.changes(1) == {"adding": False, "stays_whole": bool(settled)}
    assert one.changes(2) == {"adding": True, "stays_whole": False}


def test_the_price_of_an_outline_is_its_length_and_its_turns():
    V, F = meshes.quad_patch()
    one = round_of([1], [1.1], charts=[chart_of(V, F)], maps=[map_of(2 * V[:, :2])])
    # Four sides of length 1, and four right angles between such.
    assert one.outline_price[0] == pytest.approx(4 + 4 * TURN) and one.extent[0] == pytest.approx(2 * np.sqrt(2))
    V, F = meshes.grid(3, 3, 1.0, 1.0)
    straight, stepped = round_of([1], [1.1], charts=[chart_of(V, F)]), F[~(F == 0).any(axis=1)]
    used, stepped = np.unique(stepped, return_inverse=True)
    notched = round_of([1], [1.1], charts=[chart_of(V[used], stepped.reshape(-1, 3))])
    assert straight.outline_price[0] == pytest.approx(4 + 4 * TURN / 3)
    assert notched.outline_price[0] > straight.outline_price[0]


@pytest.mark.parametrize(
    "pressing, prices, parts, taken",
    [
        ([1.3, 1.2], [9, 9], [0, 1], [True, False]),
        ([1.3, 1.2], [9, 7], [0, 1], [True, True]),
        ([1.3, 1.2], [9, 8 * (1 - 1e-9)], [0, 1], [True, False]),
        ([1.4, 1.2], [9, 7], [0, 1], [False, True]),
        ([1.4, 1.2], [9, 9], [0, 1], [False, False]),
        ([1.3, 1.2, 1.2], [4, 4, 7], [0, 0, 1], [False, True]),
    ],
)
def test_cuts_are_straighter_where_that_keeps_the_bound_and_the_chart(pressing, prices, parts, taken, monkeypatch):
    def with_prices(one, prices):
        of_charts = {"pressing": np.array(one, float), "mean": np.array(one, float), "area": np.ones(len(one))}
        return SimpleNamespace(**of_charts, bound=1.35, outline_price=np.array(prices, float), charts=list(one))

    chart = SimpleNamespace(vertices=np.zeros((5, 3)))
    last, new = with_prices([1.3, 1.3], [10, 8]), with_prices(pressing, prices)
    last.charts, last.cuts, last.found_for = [chart, chart], cuts_of([[0, 1]]), lambda k: ["found"]
    last.kept = lambda chosen: asked.append(chosen)
    last.slits_within = lambda chosen: ("slits", *chosen)
    last.chart_of = lambda search, other: np.array(parts)
    last.merged = lambda search, other, of, stay: stay
    asked = []

    monkeypatch.setattr(shear_bound, "_cut_anew", cutting(asked, new))
    search = SimpleNamespace(count=3, first_spread=lambda: np.full(3, 0.2), with_images=lambda charts, chosen: chosen)
    found = drain(shear_bound._straightened(search, last, None, EarlyEnd()))
    assert found is last if not any(taken) else (~found).tolist() == taken
    assert asked[0] == [0, 1] and asked[1].changes["straighter"] and asked[1].changes["stays_whole"]
    assert asked[1].slits == ("slits", 0, 1)
    assert asked[1].is_worth(np.array([[1, 2]])) and not asked[1].is_worth(np.array([[1, 0]]))


@pytest.mark.parametrize(
    "before, now, taken",
    [(1.1, 1.12, True), (1.1, 1.13, False), (1.11, 1.3, True), (1.0, 1.0, True), (1.0, 1.01, False)],
)
def test_straighter_cuts_leave_flat_what_is(before, now, taken, monkeypatch):
    def round_with(shear, price):
        of_charts = {"pressing": np.array([shear]), "mean": np.array([shear]), "area": np.ones(1)}
        return SimpleNamespace(**of_charts, bound=1.35, outline_price=np.array([price]), charts=[chart])

    chart = SimpleNamespace(vertices=np.zeros((5, 3)))
    last, new = round_with(before, 10.0), round_with(now, 5.0)
    last.cuts, last.found_for, last.kept = cuts_of([[0, 1]]), lambda k: ["found"], lambda chosen: chosen
    last.slits_within, last.chart_of = lambda chosen: (), lambda search, other: np.array([0])
    last.merged = lambda search, other, of, stay: stay
    monkeypatch.setattr(shear_bound, "_cut_anew", cutting([], new))
    search = SimpleNamespace(count=3, first_spread=lambda: np.full(3, 0.2), with_images=lambda charts, chosen: chosen)
    found = drain(shear_bound._straightened(search, last, None, EarlyEnd()))
    assert (found is not last) == taken


@pytest.mark.parametrize(
    "twin, chosen, found",
    [
        ([-1, -1, -1], [0, 2], [0, 2]),
        ([-1, 0, -1], [0], [0, 1]),
        ([-1, 0, -1], [1, 2], [2]),
        ([-1, -1, 0], [0, 1, 2], [0, 1, 2]),
        ([-1, 0, -1], [1], []),
    ],
)
def test_mirror_images_are_cut_anew_with_the_chart_that_is_searched(twin, chosen, found, monkeypatch):
    monkeypatch.setattr(shear_search, "mirror_twins", lambda charts, images: np.array(twin))
    search = shear_search.ShearSearch(None, None, ShearBound(1.3), None, {})
    search.__dict__["images"] = None
    assert search.with_images([None] * 3, chosen) == found


def test_nothing_is_straightened_that_no_search_has_found_or_is_large(monkeypatch):
    monkeypatch.setattr(shear_bound, "IN_STEPS", 4)
    large, small = (SimpleNamespace(vertices=np.zeros((n, 3))) for n in (5, 4))
    search = SimpleNamespace(with_images=lambda charts, chosen: chosen)
    for chart, found in ((large, ["found"]), (small, [])):
        last = SimpleNamespace(charts=[chart], found_for=lambda k, found=found: found)
        assert drain(shear_bound._straightened(search, last, None, EarlyEnd())) is last


def test_nothing_is_taken_back_where_nothing_has_slack():
    last = round_of([1], [1.1])
    search = SimpleNamespace(with_images=lambda charts, chosen: chosen)
    assert drain(shear_bound._taken_back(search, last, None, EarlyEnd())) is last


@pytest.mark.parametrize("beside", [0.0, 3.0, 1e4])
@pytest.mark.parametrize("faces", [None, [True, False, True]])
def test_what_is_long_next_to_all_that_goes_into_the_texture_may_come_apart(faces, beside, monkeypatch):
    """Faces that are not chosen are not in it; charts that were not cut, or by hand, stay."""
    V = np.array([[0.0, 0, 0], [9, 0, 0], [9, 1, 0], [0, 3, 0], [0, 3, 4.0]])
    surface = triangle_surface(V, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]]))
    chosen = np.ones(3, bool) if faces is None else np.array(faces)
    whole = face_areas(V, surface.corner_vertex[surface.triangles])[chosen].sum() + beside
    charts, asked = [chart_of(V, F) for F in np.array([[[0, 1, 2]], [[0, 2, 3]], [[0, 3, 4]]])], []
    maps = [SimpleNamespace(uv=size * np.array([[0, 0], [1, 0], [1.0, 1]])) for size in (1.0, 4.0, 30.0)]

    def cut(search, chart, chart_map, area, map_charts):
        asked.append((chart, area))
        yield from ()
        return ([chart, chart], [chart_map, chart_map]), np.array([[7, 8]])

    monkeypatch.setattr(pieces, "_pieces", cut)
    monkeypatch.setattr(pieces, "is_marked", lambda surface, chart: False)
    monkeypatch.setattr(pieces, "joined", lambda search, cuts, edges: edges)
    search = SimpleNamespace(
        surface=surface, faces=None if faces is None else chosen, shear=ShearBound(1.3, beside=beside)
    )
    prepared = FakePrepared(charts, cuts_of([[0, 1], [0, 3]]))
    found, found_maps = drain(pieces.in_pieces(search, prepared, maps, None))
    long = [k for k in range(3) if np.sqrt(2) * (1, 4, 30)[k] > pieces.COMPACT * np.sqrt(whole)]
    assert [chart for chart, _ in asked] == [charts[k] for k in long]
    assert [area for _, area in asked] == pytest.approx([whole] * len(long))
    counts = [2 if k in long else 1 for k in range(3)]
    assert found.charts == [chart for chart, count in zip(charts, counts, strict=True) for _ in range(count)]
    assert found_maps == [one for one, count in zip(maps, counts, strict=True) for _ in range(count)]
    assert found.cuts.tolist() == [[0, 1], [0, 3]] + [[7, 8]] * len(long)


def test_maps_of_pieces_shear_less_in_the_mean_by_area():
    V, F = meshes.single_triangle()
    charts = [chart_of(V, F), chart_of(2 * V, F)]

    def maps(*shears, folds=0, failure=None):
        return [SimpleNamespace(angle_mean=s, folds=folds, failure=failure) for s in shears]

    before = maps(1.4, 1.2)
    assert pieces._shears_less(charts, maps(1.7, 1.1), before)
    assert not pieces._shears_less(charts, maps(1.1, 1.3), before)
    assert not pieces._shears_less(charts, maps(1.0, 1.0, folds=1), before)
    assert pieces._shears_less(charts, maps(1.0, 1.0, folds=1), maps(1.4, 1.2, folds=1))
    assert not pieces._shears_less(charts, maps(1.0, 1.0, failure="no"), before)
    assert not pieces._shears_less(charts, before, before)


@pytest.mark.parametrize(
    "mean, by_hand, words",
    [
        ([1.354, 1.0], [False, False], []),
        ([1.356, 1.0], [False, False], ["An island, 25 % of the surface, shears 1.36 in the mean, above 1.35: why"]),
        ([1.5, 1.7], [False, False], ["2 islands shear 1.7 in the mean, above 1.35: why"]),
    ],
)
def test_warnings_of_the_bound_tell_how_much_of_the_surface_misses_it(mean, by_hand, words):
    found = list(ShearBound(1.35).missed(np.array(mean), np.array([1.0, 3.0]), np.array(by_hand), "why"))
    assert found == words


def test_warnings_of_seams_by_hand_are_told_apart():
    found = list(ShearBound(1.35).missed(np.array([1.5, 1.6, 1.7]), np.ones(3), np.array([True, True, False]), "why"))
    assert len(found) == 2 and "their seams were marked by hand" in found[0] and found[0].startswith("2 islands, 67 %")
    assert found[1].startswith("An island, 33 % of the surface, shears 1.7") and found[1].endswith(": why")


@pytest.mark.parametrize(
    "changed", [{"max_shear": 0.0}, {"seams": "existing"}, {"boundary": "disk"}, {"kind": "conformal"}]
)
def test_only_free_maps_of_seams_that_are_searched_have_a_bound(changed):
    options = UnwrapOptions(max_shear=1.4, cut_further=True)
    bound = options.shear_bound()
    assert (bound.bound, bound.further, bound.preferences) == (1.4, True, options.preferences)
    assert UnwrapOptions(**{"max_shear": 1.4} | changed).shear_bound() is None


@pytest.mark.parametrize(
    "name, good, bad",
    [
        ("balance", (0, 1), (-0.001, 1.001)),
        ("aspect", (0, 9999), (-0.001, 10_000)),
        ("max_shear", (0, 1.01), (1.0, 0.9)),
    ],
)
def test_numbers_of_options_end_where_they_say(name, good, bad):
    for value in good:
        assert getattr(UnwrapOptions(**{name: value}), name) == value
    for value in bad:
        with pytest.raises(ValueError, match=str(value)):
            UnwrapOptions(**{name: value})


# Starts.


def disk_mesh(boundary="free", n=12, **given):
    V, F = meshes.bumpy(n, n, height=0.1)
    return initial_map.DiskMesh(V, F, face_areas(V, F), boundary_loops(F)[0], boundary, **given)


def flat_uv(disk):
    return disk.vertices[:, :2].copy()


@pytest.mark.parametrize(
    "spread, one, stretch, found",
    [
        (False, True, 1, None),
        (True, True, 1, "flat"),
        (True, False, 50, "embedded"),
        (True, False, 1, "bent"),
        (True, False, None, "embedded"),
    ],
)
def test_a_flat_start_is_bent_or_where_that_squeezes_it_a_mean_value_map(spread, one, stretch, found, monkeypatch):
    disk = disk_mesh()
    flat, bent = flat_uv(disk), None if stretch is None else flat_uv(disk) * [stretch, 1]
    monkeypatch.setattr(initial_map, "_evenly_flattened", lambda *_: flat if spread else None)
    monkeypatch.setattr(initial_map, "is_one_to_one", lambda *_: one)
    disk.__dict__["bent"] = bent
    start = initial_map.flat_initial_map(disk, RunLog())
    expected = {None: None, "flat": flat, "bent": bent, "embedded": disk.embedded}[found]
    assert start is None if expected is None else start.uv is expected


def test_a_disk_is_flattened_evenly_below_a_spread_by_the_mass_asked_for():
    disk = disk_mesh()
    given = []
    fake = SimpleNamespace(uv="uv", spread=lambda mass: given.append(mass) or 0.3)
    disk.__dict__["flat"] = fake
    assert initial_map._evenly_flattened(disk, 0.31) == "uv" and initial_map._evenly_flattened(disk, 0.3) is None
    assert disk.spread == 0.3 and len(given) == 1
    expected = [
        sum(disk.target[t] / 3 for t in range(len(disk.triangles)) if v in disk.triangles[t]) for v in range(169)
    ]
    np.testing.assert_allclose(given[0], expected)
    disk = disk_mesh()
    disk.__dict__["flat"] = None
    assert initial_map._evenly_flattened(disk, 9) is None and disk.spread == np.inf and disk.bent is None


@pytest.mark.parametrize(
    "hopeless, even, one, starts",
    [
        (True, True, True, True),
        (False, True, True, False),
        (True, False, True, False),
        (True, True, False, False),
    ],
)
def test_an_even_start_is_for_what_a_mean_value_map_leaves_hopeless(hopeless, even, one, starts, monkeypatch):
    disk = disk_mesh()
    monkeypatch.setattr(initial_map, "map_energy", lambda *_: 50.0 if hopeless else 49.9)
    monkeypatch.setattr(initial_map, "_evenly_flattened", lambda *_: "even" if even else None)
    monkeypatch.setattr(initial_map, "is_one_to_one", lambda *_: one)
    assert (initial_map._even_start(disk, None) == "even") == starts


@pytest.mark.parametrize(
    "changed, found",
    [
        ({}, "flat"),
        ({"boundary": "disk"}, None),
        ({"least": 169}, None),
        ({"most": 168}, None),
        ({"most": 169}, "flat"),
        ({"far": True}, None),
        ({"flat": False}, "evened"),
        ({"flat": False, "evened": None}, None),
        ({"above": 100}, "flat"),
        ({"above": 100, "flat": False}, "evened"),
        ({"above": 100, "evened": None}, None),
        ({"flat": False, "energy": 0.59}, "evened"),
        ({"flat": False, "energy": 0.61}, None),
        ({"above": 100, "energy": 0.61}, "flat"),
    ],
)
def test_a_roomy_start_is_flat_or_evened_in_meshes_of_a_middle_size(changed, found, monkeypatch):
    disk = disk_mesh(changed.get("boundary", "free"))
    disk.__dict__["is_far"] = changed.get("far", False)
    monkeypatch.setattr(initial_map, "EVENED_ABOVE", changed.get("least", 168))
    monkeypatch.setattr(initial_map, "DIRECT_WITH_ROOM", changed.get("most", 1000))
    monkeypatch.setattr(initial_map, "COARSE_ABOVE", changed.get("above", 500))
    monkeypatch.setattr(initial_map, "_roomy_flat", lambda *_: "flat" if changed.get("flat", True) else None)
    monkeypatch.setattr(initial_map, "evened_tutte", lambda *_: changed.get("evened", "evened"))
    # Of more than three times the spread of the flat map some shear would stay.
    disk.__dict__["spread"] = 0.2
    monkeypatch.setattr(initial_map, "_energy", lambda *_: changed.get("energy", 0.0))
    start = initial_map.roomy_initial_map(disk, RunLog())
    assert (None if start is None else start.uv) == found


@pytest.mark.parametrize("most, far, found", [(169, False, "sites"), (168, False, None), (169, True, None)])
def test_an_evened_start_is_for_meshes_of_a_middle_size_near_their_areas(most, far, found, monkeypatch):
    disk = disk_mesh("disk")
    disk.__dict__["is_far"] = far
    monkeypatch.setattr(initial_map, "DIRECT_WITH_ROOM", most)
    monkeypatch.setattr(initial_map, "evened_sites", lambda *_: "sites")
    start = initial_map.evened_initial_map(disk, RunLog(), large=False)
    assert (None if start is None else start.uv) == found


@pytest.mark.parametrize(
    "boundary, crowded, most", [("disk", True, np.inf), ("disk", False, 50.0), ("square", True, 50.0)]
)
def test_an_evened_start_may_be_squeezed_where_vertices_will_leave_the_circle(boundary, crowded, most, monkeypatch):
    asked = []
    monkeypatch.setattr(initial_map, "is_crowded", lambda *_: crowded)
    monkeypatch.setattr(initial_map, "evened_sites", lambda *words: asked.append(words[4]))
    assert initial_map.evened_initial_map(disk_mesh(boundary, corners=np.arange(4)), RunLog(), large=False) is None
    assert asked == [most]


@pytest.mark.parametrize("boundary", ["free", "disk"])
def test_drafts_and_direct_starts_are_flat_only_where_the_boundary_is_free(boundary, monkeypatch):
    disk = disk_mesh(boundary)
    monkeypatch.setattr(initial_map, "flat_initial_map", lambda *_: "flat")
    monkeypatch.setattr(initial_map, "initial_map", steps_of("transported"))
    assert drain(initial_map.direct_initial_map(disk, RunLog())) == ("flat" if boundary == "free" else "transported")
    evened = []
    monkeypatch.setattr(initial_map, "evened_tutte", lambda *given, **_: evened.append(given[2]))
    draft = initial_map._draft_start(disk, "embedded", RunLog())
    assert draft == "flat" if boundary == "free" else draft.uv == "embedded"
    monkeypatch.setattr(initial_map, "flat_initial_map", lambda *_: None)
    assert drain(initial_map.direct_initial_map(disk, RunLog())) == "transported"
    assert initial_map._draft_start(disk, "embedded", RunLog()).uv == "embedded"
    # By default from a mean value map, and evened where that can be.
    disk.__dict__["embedded"] = "mean values"
    assert initial_map._draft_start(disk, None, RunLog()).uv == "mean values"
    assert evened == ["embedded"] * (1 if boundary == "free" else 2) + ["mean values"]
    monkeypatch.setattr(initial_map, "evened_tutte", lambda *_, **__: "evened")
    assert initial_map._draft_start(disk, None, RunLog()).uv == "evened"


@pytest.mark.parametrize(
    "changed, found",
    [
        ({}, "coarser"),
        ({"energy": 500.0}, "direct"),
        ({"least": 169}, "direct"),
        ({"most": 168}, "direct"),
        ({"far": True}, "direct"),
        ({"boundary": "disk"}, "direct"),
        ({"coarser": None}, "direct"),
        ({"coarser": MeshError("no map")}, "direct"),
    ],
)
def test_what_has_next_to_no_room_comes_by_way_of_a_coarser_mesh(changed, found, monkeypatch):
    disk = disk_mesh(changed.get("boundary", "free"))
    disk.__dict__["is_far"] = changed.get("far", False)
    monkeypatch.setattr(initial_map, "TOO_COARSE", changed.get("least", 168))
    monkeypatch.setattr(initial_map, "COARSE_ABOVE", changed.get("most", 169))
    monkeypatch.setattr(initial_map, "_energy", lambda *_: changed.get("energy", 501.0))
    monkeypatch.setattr(initial_map, "direct_initial_map", steps_of(SimpleNamespace(uv="direct")))

    def coarser(*_):
        outcome = changed.get("coarser", SimpleNamespace(uv="coarser"))
        if isinstance(outcome, MeshError):
            raise outcome
        return outcome
        yield

    monkeypatch.setattr(initial_map, "coarse_initial_map", coarser)
    assert drain(initial_map.roomier_initial_map(disk, 0.0, RunLog())).uv == found


@pytest.mark.parametrize("evened", ["evened", None])
def test_drafts_in_squares_are_evened_where_that_leaves_room(evened, monkeypatch):
    disk = disk_mesh("square", corners=np.arange(4))
    monkeypatch.setattr(initial_map, "evened_initial_map", lambda *_, large: None if large else evened)
    assert initial_map._draft_start(disk, "embedded", RunLog()) == evened


def test_what_comes_back_is_smoothed_at_the_scale_of_its_target():
    disk = disk_mesh()
    uv = flat_uv(disk) * 7
    given = disk.vertices, disk.triangles, disk.target, uv, 200.0
    drafts = [
        drain(smoothed_uv(*given, 16, 0.05)),
        drain(smoothed_uv(*given, 8)),
    ]
    for found in drafts:
        area = signed_areas(found, disk.triangles)
        assert (area > 0).all() and area.sum() == pytest.approx(disk.target.sum(), rel=0.02)
    assert np.abs(drafts[0] - drafts[1]).max() > 1e-9
    share = signed_areas(drafts[0], disk.triangles) / disk.target
    assert np.abs(share / share.mean() - 1) @ disk.target / disk.target.sum() <= 0.05


@pytest.mark.parametrize(
    "corners, aspect, domain",
    [
        (None, 1.0, (1.0, 1.0)),
        (np.arange(4), 4.0, (0.5, 2.0)),
        (np.arange(4), 1.0, (1.0, 1.0)),
    ],
)
def test_domains_have_the_aspect_as_height_over_width(corners, aspect, domain):
    found = disk_mesh("rectangle", corners=corners, aspect=aspect).domain
    assert type(found).__name__ == ("Disk" if corners is None else "Rectangle")
    if corners is not None:
        assert (found.width, found.height) == pytest.approx(domain)


# Convex polygons.


def figures(**given):
    return SimpleNamespace(**{"folds": 0, "area_l1": 0.01, "area_sd": 0.02, "angle_mean": 1.2, "warnings": ()} | given)


@pytest.mark.parametrize(
    "folds, area, keeps",
    [
        (1, 0.0, True),
        (2, 0.0, False),
        (0, 0.0219, True),
        (0, 0.0221, False),
    ],
)
def test_maps_are_kept_with_no_more_folds_and_about_the_areas(folds, area, keeps):
    assert convex_maps._keeps(figures(folds=folds, area_l1=area), figures(folds=1), 0.02) == keeps
    assert convex_maps._keeps(figures(area_l1=0.054), figures(area_l1=0.05), 0.02)
    assert not convex_maps._keeps(figures(area_l1=0.056), figures(area_l1=0.05), 0.02)


@pytest.mark.parametrize(
    "angle, area, folds, isometry",
    [
        (1 + 5e-8, 5e-8, 0, True),
        (1 + 2e-7, 0, 0, False),
        (1, 2e-7, 0, False),
        (1, 0, 1, False),
    ],
)
def test_isometries_have_neither_shear_nor_error_nor_folds(angle, area, folds, isometry):
    assert convex_maps._is_isometry(figures(angle_mean=angle, area_l1=area, folds=folds)) == isometry


def test_folds_are_told_once_and_as_many_as_there_are():
    before = ("Other", f"3 {FOLDED}")
    assert convex_maps._folds_told(before, 2) == ("Other", f"2 {FOLDED}")
    assert convex_maps._folds_told(before, 0) == ("Other",)
    assert convex_maps._folds_told((), 1) == (f"1 {FOLDED}",)


def test_pins_and_outlines_of_domains_stay():
    V, F = meshes.grid(3, 2)
    chart, loop = chart_of(V, F), set(boundary_loops(F)[0].tolist())
    pins = SimpleNamespace(vertices=np.array([5, 6]))
    assert not convex_maps._fixed(chart, None, "free").any()
    assert np.flatnonzero(convex_maps._fixed(chart, pins, "free")).tolist() == [5, 6]
    for boundary in ("disk", "square"):
        assert set(np.flatnonzero(convex_maps._fixed(chart, None, boundary))) == loop
        assert set(np.flatnonzero(convex_maps._fixed(chart, pins, boundary))) == loop | {5, 6}


@pytest.mark.parametrize("unit", [1.0, 1e6, 1e-6])
def test_maps_lie_as_before_with_the_area_of_before(unit):
    V, F = meshes.grid(4, 3)
    given = V[:, :2] * [3, 2] * unit + [7 * unit, -2 * unit]
    turn = np.array([[np.cos(2), np.sin(2)], [-np.sin(2), np.cos(2)]])
    found = convex_maps._as_before(5 * given @ turn + unit, given, F)
    np.testing.assert_allclose(found, given, rtol=1e-9, atol=1e-9 * unit)


def test_dented_polygons_have_an_area_though_a_triangle_of_theirs_folds():
    V = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [4, 0, 0], [4, 2, 0], [6, 0, 0], [6, 2, 0]], float)
    F = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [4, 6, 7], [4, 7, 5]])
    chart = chart_of(V, F, [0, 0, 1, 1, 2, 2])
    uv = V[:, :2].copy()
    assert not convex_maps._dented(chart, uv).any()
    uv[3] = [1.5, 0.5]
    assert convex_maps._dented(chart, uv).tolist() == [True] * 2 + [False] * 4
    assert convex_maps._dented(chart, uv * [-1, 1]).tolist() == [True] * 2 + [False] * 4
    uv[3] = [3, -1]  # the polygon lies the other way as a whole
    assert not convex_maps._dented(chart, uv)[:2].any()
    flat = V.copy()
    flat[3] = [1, 1, 0]
    uv[3] = [1.5, 0.5]
    assert not convex_maps._dented(chart_of(flat, F, [0, 0, 1, 1, 2, 2]), uv).any()


def test_folds_are_counted_by_polygon_whichever_way_a_chart_lies():
    V, F = meshes.grid(2, 1)
    chart = chart_of(V, F, [0, 1, 0, 1])
    uv = V[:, :2].copy()
    plain = map_of(uv)
    assert convex_maps.with_folds_counted(chart, plain) is plain
    uv[F[0][0]] = uv[F[0]][1:].mean(axis=0) + 0.5 * (uv[F[0]][1:].mean(axis=0) - uv[F[0][0]])
    count = len(set(chart.faces[signed_areas(uv, F) <= 0].tolist()))
    for flip in (1, -1):
        found = convex_maps.with_folds_counted(chart, map_of(uv * [flip, 1]))
        assert found.folds == count > 0 and found.warnings == (f"{count} {FOLDED}",)


def test_values_of_polygons_are_means_by_area():
    V, F = meshes.bumpy(2, 2)
    faces = np.array([0, 0, 1, 2, 2, 2, 3, 1])
    values = np.arange(8.0)
    found, area = convexity._of_polygons(values, chart_of(V, F, faces)), face_areas(V, F)
    for k in range(8):
        mine = faces == faces[k]
        assert found[k] == pytest.approx(area[mine] @ values[mine] / area[mine].sum())
    assert convexity._longer(np.array([True, False]), 4).tolist() == [True, False, False, False]


def test_outlines_cross_about_the_edges_that_do():
    loop = np.arange(24)
    w = np.exp(2j * np.pi * loop / 24)
    moved = w.copy()
    moved[0] = -1.2
    # Edges 23 and 0 cross 11 and 12.
    expected = {(edge + k) % 24 for edge in (23, 0, 11, 12) for k in range(-2, 4)}
    assert set(convexity._crossed(w, moved, loop, False).tolist()) == expected
    assert convexity._crossed(w, moved, loop, True).tolist() == loop.tolist()
    assert len(convexity._crossed(moved, moved, loop, True)) == 0
    assert len(convexity._crossed(w, w, loop, True)) == 0


@pytest.mark.parametrize("share, squeezed", [(-0.1, True), (0.0, True), (0.5e-15, True), (2e-15, False)])
def test_triangles_are_squeezed_where_their_area_is_rounding_of_their_charts(share, squeezed):
    w = np.array([0, 1, 1j, 0, 1, 1j * share]).astype(complex)
    mesh = SimpleNamespace(triangles=np.array([[0, 1, 2], [3, 4, 5]]), chart=np.array([0, 0]))
    assert convexity._squeezed(mesh, w).tolist() == [False, squeezed]


# Charts like other charts.


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_frames_are_axes_of_two_points(sign):
    points = np.array([[2.0, 0, 0], [5.0, 3.0, 0]])
    np.testing.assert_allclose(component_order._frame(points, sign), np.diag([1, 1, sign]))
    turned = points @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    frame = component_order._frame(turned, sign)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(frame.T @ turned.T, [[2, 5], [0, 3], [0, 0]], atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(sign)
    assert not np.isfinite(component_order._frame(np.array([[1.0, 0, 0], [2.0, 0, 0]]))).all()


@pytest.mark.parametrize("off, same", [(0.0, True), (0.5e-4, True), (1e-3, False)])
@pytest.mark.parametrize("name", ["density", "region"])
def test_targets_of_images_are_compared_vertex_by_vertex(name, off, same):
    V, F = meshes.grid(2, 2)
    charts = [chart_of(V, F), chart_of(V, F)]
    values = np.random.default_rng(0).uniform(0.5, 1, len(F))
    other = values.copy()
    other[3] += off
    plain = np.ones(len(F))

    def target(x):
        return Target(x, None) if name == "density" else Target(plain, x)

    image = np.arange(len(V))
    assert mirrored_charts._same_targets(charts, [target(values), target(other)], 0, 1, image) == same
    assert mirrored_charts._same_targets(charts, [None, None], 0, 1, image)
    assert not mirrored_charts._same_targets(charts, [None, target(values)], 0, 1, image)
    assert not mirrored_charts._same_targets(charts, [Target(plain, None), Target(plain, values)], 0, 1, image)
    at = mirrored_charts._at_vertices(charts[0], values)
    np.testing.assert_allclose(at, [values[(v == F).any(axis=1)].mean() for v in range(len(V))])


@pytest.mark.parametrize(
    "folds, area, goal, kept",
    [
        (0, 0.02, 0.02, True),
        (1, 0.02, 0.02, False),
        (0, 0.031, 0.02, False),
        (0, 0.029, 0.02, True),
        (0, 0.04, 0.001, False),
    ],
)
def test_maps_of_mirrored_quads_are_measured_as_they_were_given(folds, area, goal, kept, monkeypatch):
    V, F = meshes.grid(2, 2)
    found = map_of(V[:, :2])
    measured = SimpleNamespace(folds=folds, area_l1=area, area_sd=0.5, angle_mean=1.7)
    monkeypatch.setattr(mirrored_charts, "measured_chart", lambda *_: measured)
    new = mirrored_charts.as_given(chart_of(V, F), found, None, goal)
    assert (new is not None) == kept
    if kept:
        assert (new.area_l1, new.area_sd, new.angle_mean) == (area, 0.5, 1.7) and new.uv is found.uv


def test_two_triangles_get_one_polygon_unless_a_cut_has_parted_them():
    V, F = meshes.quad_patch()
    label = np.array([0, 0, 2])
    assert mirrored_charts._relabelled(chart_of(V, F, [0, 1]), label).faces.tolist() == [0, 0]
    apart = np.concatenate([V, V])
    parted = np.array([F[0], F[1] + 4])
    assert mirrored_charts._relabelled(chart_of(apart, parted, [0, 1]), label).faces.tolist() == [0, 1]


def test_charts_that_are_as_before_keep_their_maps():
    V, F = meshes.grid(2, 2)
    known, new = chart_of(V, F), chart_of(V + 1, F)
    new = replace(new, corners=new.corners + 100)
    asked = []

    def map_charts(charts):
        asked.extend(charts)
        return ["new"] * len(charts)
        yield

    found = flat_map(V)
    assert drain(mirrored_charts.mapped_anew([new, known], [(known, found)], map_charts)) == ["new", found]
    assert asked == [new]


def flat_map(V, **given):
    figures = {"area_l1": 0.0, "area_sd": 0.0, "angle_mean": 1.0, "folds": 0, "status": "converged"}
    return ChartMap(uv=V[:, :2].copy(), **{**figures, **given})


def test_what_fills_a_hole_goes_with_what_is_all_around_it():
    V, F = meshes.annulus(12, 3)
    (whole,) = cut_to_disks(triangle_surface(V, F), fill_holes=True).charts
    middle = V[F].mean(axis=1)
    inside = np.linalg.norm(middle, axis=1) < np.median(np.linalg.norm(middle, axis=1))
    for rows, filled in ((inside, True), (np.ones(len(F), bool), True), (middle[:, 0] > 0, False), (~inside, False)):
        part, used = part_of_chart(whole, rows[whole.faces])
        assert len(part.patches) == (12 if filled else 0) and (part.vertex_ids < 0).sum() == filled
        np.testing.assert_array_equal(whole.vertices[used], part.vertices)
        np.testing.assert_array_equal(np.sort(part.faces), np.flatnonzero(rows))


@pytest.mark.parametrize(
    ("given", "begins"),
    [({}, True), ({"folds": 1}, False), ({"status": "steps"}, False), ({"failure": MeshError("No")}, False)],
)
def test_parts_of_charts_start_where_these_lie(given, begins):
    V, F = meshes.grid(3, 3)
    rng = np.random.default_rng(0)
    whole, other = chart_of(V, F), replace(chart_of(V, F[:6]), corners=3 * len(F) + np.arange(18).reshape(-1, 3))
    part, used = part_of_chart(whole, np.arange(len(F)) < 10)
    order = rng.permutation(len(used))
    part = replace(part, vertices=part.vertices[order], triangles=np.argsort(order)[part.triangles])
    known, asked = flat_map(rng.normal(size=(len(V), 2)), **given), []

    def map_charts(charts, starts=None):
        asked.append(starts)
        return ["new"] * len(charts)
        yield

    assert drain(mirrored_charts.mapped_anew([other, part], [(whole, known)], map_charts)) == ["new"] * 2
    if not begins:
        assert asked == [None]
        return
    ((nowhere, start),) = asked
    assert nowhere is None and replace(start, uv=known.uv) == known
    np.testing.assert_array_equal(start.uv, known.uv[used[order]])


def test_charts_that_are_slit_or_closed_or_have_holes_filled_start_from_nothing():
    """Slits touch themselves in the map that there was, what was closed has two places, and holes more vertices."""
    V, F = meshes.grid(3, 3)
    whole = chart_of(V, F)
    inner = np.flatnonzero((F == 5).any(axis=1))
    slit = F.copy()
    slit[inner[:2]] = np.where(slit[inner[:2]] == 5, len(V), slit[inner[:2]])
    opened = replace(whole, vertices=np.concatenate([V, V[5:6]]), triangles=slit)
    rest = {name: getattr(whole, name)[1:] for name in ("triangles", "corners", "faces")}
    half = replace(whole, patches=F[:1], **rest)
    nowhere = mirrored_charts._where_they_lie
    assert nowhere([opened], [(whole, flat_map(V))]) is None
    assert nowhere([whole], [(opened, flat_map(opened.vertices))]) is None
    assert nowhere([half], [(whole, flat_map(V))]) is None and nowhere([], [(whole, flat_map(V))]) is None
    assert nowhere([whole], [(replace(whole, patches=F[:1]), flat_map(V))]) is None


def test_what_maps_charts_is_asked_for_each_but_once():
    V, F = meshes.grid(2, 2)
    one, other, asked = chart_of(V, F), chart_of(V, F[:4]), []

    def map_charts(charts, starts=None):
        asked.append((len(charts), starts))
        return [flat_map(chart.vertices + len(chart.triangles)) for chart in charts]
        yield

    again = mirrored_charts.with_known_maps(map_charts)
    found = [drain(again(charts)) for charts in ([one], [other, one], [other])]
    assert [[int(m.uv.min()) for m in maps] for maps in found] == [[8], [4, 8], [4]]
    assert [count for count, _ in asked] == [1, 1, 0]
    # What is told where to start does so.
    assert all(starts is None for _, starts in asked)
    third = replace(other, corners=other.corners + 100)
    drain(again([third, one], ["here", "there"]))
    assert asked[3] == (1, ["here"])


@pytest.mark.parametrize("hole", [0, 2])
def test_charts_that_are_as_before_but_for_the_order_of_their_vertices_and_triangles_keep_their_maps(hole):
    V, F = meshes.grid(3, 3)
    V = V + 0.01 * np.random.default_rng(1).normal(size=V.shape)
    F, patches = F[np.r_[:8, 8 + hole : len(F)]], filled(V, F[8 : 8 + hole])
    V = np.concatenate([V, [[0.5, 0.4, 0.1]]]) if hole else V
    rng = np.random.default_rng(0)
    order, rows = rng.permutation(len(V)), rng.permutation(len(F))
    place, known = np.argsort(order), replace(chart_of(V, F), patches=patches)
    turned = np.roll(np.stack([place[F], known.corners])[:, rows], 1, axis=2).astype(np.int32)
    new = replace(known, vertices=V[order], triangles=turned[0], corners=turned[1], faces=known.faces[rows])
    new = replace(new, patches=np.roll(place[patches], 1, axis=1)[::-1])
    chart_map = ChartMap(uv=V[:, :2] + 0.5, area_l1=0.0, area_sd=0.0, angle_mean=1.0, folds=0)

    def map_charts(charts):
        assert not charts
        return []
        yield

    (found,) = drain(mirrored_charts.mapped_anew([new], [(known, chart_map)], map_charts))
    np.testing.assert_array_equal(found.uv, new.vertices[:, :2] + 0.5)


def filled(V, hole):
    """A fan around the next vertex over the hole of two triangles that are a quad."""
    loop = boundary_loops(hole)[0] if len(hole) else np.zeros(0, np.int64)
    return np.column_stack([loop, np.roll(loop, -1), np.full(len(loop), len(V))]).astype(np.int64)


def test_charts_with_another_patch_are_not_as_before():
    V, F = meshes.grid(3, 3)
    known = replace(chart_of(V, F[np.r_[:8, 10 : len(F)]]), patches=F[8:10])
    more = {"vertices": np.concatenate([V, [[0.5, 0.4, 0.1]]]), "vertex_ids": np.append(known.vertex_ids, -1)}
    fan = replace(known, patches=filled(V, F[8:10]), **more)
    names = [mirrored_charts.identity(one) for one in (known, replace(known, patches=F[8:9]), fan)]
    assert len(set(names)) == 3


# Polygons cut for maps.


def test_centres_lie_amid_the_corners_of_their_fans():
    turn = 2 * np.pi * np.arange(5) / 5
    uv = np.column_stack([np.cos(turn) + 3, 2 * np.sin(turn)])
    fans = np.array([[k, (k + 1) % 5, 5] for k in range(5)])
    found = polygon_disk.with_centres(uv, fans, 6)
    np.testing.assert_allclose(found, np.concatenate([uv, [uv.mean(axis=0)]]))


def test_numbers_are_given_in_the_order_of_coming():
    assert polygon_disk._numbered(np.array([7, 3, 7, 9, 3])).tolist() == [0, 1, 0, 2, 1]


def test_roundness_is_area_over_squared_sides():
    corners = np.array([[[0, 0], [3, 0], [0, 4.0]]])
    assert polygon_disk._roundness(corners, np.array([6.0]))[0] == pytest.approx(6 / 50)


def test_pins_of_domains_are_refused_by_name():
    pins = SimpleNamespace(vertices=np.array([3, 5]))
    chart_indices.refuse_pins_on_outline(pins, "free")
    chart_indices.refuse_pins_on_outline(None, "disk")
    with pytest.raises(PinError, match="stay in place in a square") as error:
        chart_indices.refuse_pins_on_outline(pins, "square")
    assert error.value.elements.tolist() == [3, 5] and error.value.kind == "vertex"


def test_edges_within_charts_are_cut_anew_and_others_stay():
    # A slit: the edge 1-4 of the surface is on both sides of the chart.
    V, F = meshes.grid(2, 2)
    at = F.copy()
    V2 = np.concatenate([V, V[[1]]])
    left = [k for k in range(len(F)) if 1 in F[k] and V[F[k]][:, 0].mean() < 0.5]
    at[left] = np.where(at[left] == 1, 9, at[left])
    chart = chart_of(V2, at, ids=[*range(9), 1])
    assert chart_indices.within(chart).tolist() == [pair_keys(np.array([1]), np.array([4]))[0]]
    edges = np.array([[4, 1], [0, 1]])
    assert chart_indices.but_within(edges, [chart]).tolist() == [[0, 1]]
    assert chart_indices.but_within(edges, []).tolist() == edges.tolist()


def test_a_map_lies_like_what_was_given_or_is_one_unit_wide():
    V, F = meshes.grid(3, 2)
    w = V[:, :2] @ [1, 1j]
    turn = 3 * np.exp(0.5j)
    found = chart_indices._placed_like_given(w, F, (turn * w + 5)[F])
    np.testing.assert_allclose(found - found[0], turn * (w - w[0]), atol=1e-9)
    for nothing_ in (np.zeros(F.shape, complex), np.full(F.shape, np.nan + 0j)):
        found = chart_indices._placed_like_given(5 * w, F, nothing_)
        np.testing.assert_allclose(found, w / max(np.ptp(w.real), np.ptp(w.imag)), atol=1e-12)


def test_keys_of_polygons_know_no_diagonal():
    one, other = np.array([[0, 1, 2], [0, 2, 3], [5, 6, 7]]), np.array([[0, 1, 3], [1, 2, 3], [5, 6, 7]])
    polygon = np.array([0, 0, 1])
    for triangles in (one, other):
        highest, total, lowest = chart_indices._polygon_keys(triangles, polygon)
        assert highest.tolist() == [3, 3, 7] and total.tolist() == [6, 6, 18] and lowest.tolist() == [0, 0, 5]


def test_targets_of_charts_stand_side_by_side():
    assert small_charts._side_by_side([None, None]) == {}
    found = small_charts._side_by_side([Target(np.array([2.0, 3.0]), None), Target(np.array([4.0]), None)])
    assert found["density"].tolist() == [2, 3, 4] and found["region"] is None
    found = small_charts._side_by_side([Target(np.ones(2), np.array([0.1, 0.2])), Target(np.ones(1), np.array([0.3]))])
    assert found["region"].tolist() == [0.1, 0.2, 0.3]
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(DensityError) as raised:
            small_charts._side_by_side([Target(np.ones(2), None), None, Target(np.array([3.0, wrong]), None)])
        assert raised.value.elements.tolist() == [3]


def test_maps_of_many_charts_are_placed_about_their_middles_with_their_areas():
    V, F = meshes.bumpy(3, 3)
    charts = [chart_of(V, F), chart_of(5 * V, F)]
    boxes = [(V, 1.0), (V, 5.0)]
    uv = np.concatenate([V[:, :2] * 2 + 9, V[:, :2] * 0.1 - 4])
    for density in (None, np.concatenate([np.full(len(F), 2.0), np.full(len(F), 3.0)])):
        found = small_charts._placed(charts, boxes, uv, density)
        for chart, placed, factor in zip(charts, found, (2.0, 3.0), strict=True):
            area = signed_areas(placed, F)
            assert area.sum() == pytest.approx(face_areas(chart.vertices, F).sum() * (1 if density is None else factor))
            np.testing.assert_allclose(area @ placed[F].mean(axis=1), 0, atol=1e-9)


def test_what_fails_together_is_mapped_alone(monkeypatch):
    def fails(*_, **__):
        raise MeshError("No")
        yield

    monkeypatch.setattr(batch_refine, "refine_batch", fails)
    V, F = meshes.grid(2, 2)
    found = drain(small_charts._map_batch([chart_of(V, F)] * 2, [None, None], MapOptions()))
    assert found == [None, None]
