"""Small questions with yes or no: each is asked just on either side of every one of its bounds, with all else kept."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.cutting import cut_graph, symmetric_cut
from omt_uv.solver.editing import outline, refine_island
from omt_uv.solver.flows import creases
from omt_uv.solver.globe import projections
from omt_uv.solver.mesh import charts
from omt_uv.solver.parameterization import convex_maps, mirrored_charts, pieces, shear_search, small_charts
from omt_uv.solver.remeshing.initial.options import STRATEGIES, RemeshOptions
from omt_uv.solver.remeshing.relaxation import vertex_balance
from omt_uv.solver.seams import path_graph
from omt_uv.solver.seams.coarse_surface import is_half
from omt_uv.solver.transport import damped_newton

# Just within a bound, and just beyond it.
BOTH = [(0.999, True), (1.001, False)]


def path_component(edges, count=8):
    """A component of nothing but edges (e,2)."""
    return SimpleNamespace(ends=np.array(edges).reshape(-1, 2), vertex_count=count)


def test_a_stretch_is_one_until_it_is_left_or_something_branches_off_between_its_ends():
    component = path_component([(0, 1), (1, 2), (2, 3), (1, 4), (3, 5), (6, 7)])
    stretch = np.array([0, 1, 2])

    def asked(*more, less=()):
        cut = np.isin(np.arange(6), [0, 1, 2, *more]) & ~np.isin(np.arange(6), less)
        return cut_graph._is_stretch(component, cut, stretch)

    assert asked() and asked(5)
    # At an end others may go on; between them nothing may.
    assert asked(4) and not asked(3)
    assert not any(asked(less=[k]) for k in stretch)


def test_paths_touch_where_they_share_a_vertex():
    component = path_component([(0, 1), (1, 2), (3, 4), (4, 5)])
    touches = cut_graph._touches
    assert touches(component, np.array([0]), None)
    assert touches(component, np.array([0, 2]), np.array([3])) and touches(component, np.array([0]), np.array([1]))
    assert not touches(component, np.array([0, 1]), np.array([2, 3]))


@pytest.mark.parametrize(
    "tips, point", [([2], True), ([1, 2], True), ([2, 3], False), ([0, 1, 2], False), ([0, 3], True)]
)
def test_tips_are_a_point_where_no_slit_would_open_anything(tips, point):
    component = path_component([(0, 1), (2, 1), (3, 0)])
    assert symmetric_cut._is_point(component, np.array(tips)) == point


@pytest.mark.parametrize("radius", [1e-6, 1.0, 1e6])
def test_an_outline_goes_round_where_it_is_even_ordered_and_closed(radius):
    spokes = radius * np.exp(2j * np.pi * np.arange(24) / 24)
    assert outline._goes_round(spokes, radius) and not outline._goes_round(spokes[::-1], radius)
    # Twice around, out of order, or with a gap that is too wide.
    assert not outline._goes_round(radius * np.exp(4j * np.pi * np.arange(24) / 24), radius)
    swapped = spokes.copy()
    swapped[[3, 4]] = swapped[[4, 3]]
    assert not outline._goes_round(swapped, radius)
    for share, goes in BOTH:
        begin = share * outline.WIDEST
        gap = np.concatenate([[0], np.linspace(begin, 2 * np.pi, 12)[:-1]])
        assert outline._goes_round(radius * np.exp(1j * gap), radius) == goes
        uneven = spokes.copy()
        uneven[5] *= 1 + share * 2e-3
        assert outline._goes_round(uneven, radius) == goes


def test_boundaries_meet_where_they_cross_or_all_but_touch():
    square = np.array([0, 1, 1 + 1j, 1j])
    edges = np.column_stack([np.arange(8), [1, 2, 3, 0, 5, 6, 7, 4]])

    def asked(shift):
        return refine_island.meets_itself(np.concatenate([square, square + shift]), edges)

    assert not asked(3) and not asked(1.2) and asked(0.5 + 0.5j)
    assert asked(1 + 1e-9) and asked(1.0)


@pytest.mark.parametrize("triangles, most", [(10, 1000), (100_000, 0.05 * 100_000)])
def test_more_faces_than_are_mended_are_too_many(triangles, most):
    whole = np.zeros((triangles, 3), np.int64)
    for count in (most - 1, most, most + 1):
        # A triangle in several pairs is one.
        pairs = np.column_stack([np.arange(int(count)), np.zeros(int(count), int)])
        assert creases._too_many(pairs, whole) == (count > most)


def test_cylinders_are_pictures_whose_sides_are_one_meridian():
    """So that neighbours on the equator somewhere are a picture's width apart; in other layouts they never are."""
    angle = 2 * np.pi * (np.arange(720) + 0.5) / 720
    equator = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(720)])
    for name in projections.PICTURES:
        uv = projections.to_plane(equator, name)
        widest = np.abs(np.roll(uv, -1, axis=0) - uv).max()
        assert projections.is_cylindrical(name) == (widest > 0.95), (name, widest)


def test_boundaries_touch_where_other_vertices_lie_in_one_place():
    def chart(places, ids):
        return SimpleNamespace(vertices=np.array(places, float), vertex_ids=np.array(ids))

    around = np.arange(3)
    assert not charts._touch(chart([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [4, 5, 6]), around)
    assert charts._touch(chart([[0, 0, 0], [1, 0, 0], [1, 0, 0]], [4, 5, 6]), around)
    assert charts._touch(chart([[0.0, 0, 0], [1, 0, 0], [-0.0, 0, 0]], [4, 5, 6]), around)
    # Copies of one vertex, as a cut makes them, are the same.
    assert not charts._touch(chart([[0, 0, 0], [1, 0, 0], [1, 0, 0]], [4, 5, 5]), around)


@pytest.mark.parametrize("folds, keeps", [(1, True), (2, True), (3, False)])
@pytest.mark.parametrize("area, within", BOTH)
@pytest.mark.parametrize("old, goal", [(0.02, 0.005), (0.001, 0.005)])
def test_a_map_keeps_what_another_had_or_what_was_asked(folds, keeps, area, within, old, goal):
    figures = SimpleNamespace(folds=folds, area_l1=area * 1.1 * max(old, goal))
    assert convex_maps._keeps(figures, SimpleNamespace(folds=2, area_l1=old), goal) == (keeps and within)


def test_an_isometry_has_its_angles_its_areas_and_no_folds():
    most = 1e-7
    for angle, area, folds in [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 1), (0.9, 0.9, 0)]:
        found = SimpleNamespace(angle_mean=1 + angle * most, area_l1=area * most, folds=folds)
        assert convex_maps._is_isometry(found) == (angle < 1 and area < 1 and not folds)


@pytest.mark.parametrize("excess, before, hardly", [(0.5, 0.5, True), (0.4, 0.5, False), (0.46, 0.5, True),
                                                    (0.02, 0.02, False), (0.041, 0.02, True)])  # fmt: skip
def test_a_round_is_hardly_better_where_little_is_won_and_much_is_left(excess, before, hardly):
    of, then = (SimpleNamespace(excess=x, bound=1.35, area=np.ones(2), searched=[1]) for x in (excess, before))
    assert shear_search.Round.is_hardly_better(of, then) == hardly


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("rounds", [0, 2, 3])
@pytest.mark.parametrize("bound", [1.1, 1.35])
def test_a_chart_may_cross_itself_where_it_was_slit_in_vain_or_misses_by_much(late, rounds, bound):
    much = bound ** np.sqrt(1.35)
    for mean in (0.9 * bound, (1 + 0.99 * 0.01) * bound, (1 + 1.01 * 0.01) * bound,
                 0.9999 * much, 1.0001 * much):  # fmt: skip
        asked = pieces._may_cross(SimpleNamespace(mean=np.array([9.0, mean]), bound=bound), 1, late, rounds)
        missed = mean > (1 + 0.01) * bound
        assert asked == (rounds > 2 or (missed and (late or mean >= much)))


def test_small_charts_have_few_triangles_and_no_patches():
    for count, patches in [(1, ()), (1000, ()), (1001, ()), (1, (3,))]:
        chart = SimpleNamespace(triangles=np.zeros((count, 3)), patches=patches)
        assert small_charts.is_small(chart) == (count <= 1000 and not patches)


def test_options_of_remeshing_say_what_is_counted_and_where_vertices_are():
    for strategy in STRATEGIES:
        for count_of in ("vertices", "faces"):
            found = RemeshOptions(count_of=count_of, strategy=strategy)
            assert found.counts_vertices == (count_of == "vertices")
            assert found.samples_by_measure == (strategy in ("app-cfp", "app-app"))


@pytest.mark.parametrize("share, balanced", BOTH)
def test_what_too_many_vertices_are_is_balanced_below_a_share(share, balanced):
    surplus = np.array([-5.0, 0.1, 0.3, 0.0])
    assert vertex_balance._is_balanced(surplus, 0.1 / share) == balanced


@pytest.mark.parametrize("reached, whole", [(4, True), (3, True), (2, False), (0, False)])
def test_a_graph_is_whole_where_the_plane_is_reached_from_the_boundary(reached, whole):
    cost = np.where(np.arange(6) < reached, 1.0, np.inf)
    in_plane, boundary = np.arange(6) < 4, np.arange(6) == 5
    seen = []

    def paths_from(start):
        seen.append(start.tolist())
        return cost, None

    graph = SimpleNamespace(paths_from=paths_from, boundary=boundary, in_plane=in_plane)
    assert path_graph.PathGraph.is_whole(graph, 0.75) == whole and seen == [[5]]


@pytest.mark.parametrize("least, enough", [(0.1, True), (0.1001, False)])
@pytest.mark.parametrize("most, near", [(0.2, True), (0.1, False)])
def test_cells_are_acceptable_that_are_large_and_near_to_their_masses(least, enough, most, near):
    cells = SimpleNamespace(area=np.array([0.1, 0.9]))
    assert damped_newton._acceptable(cells, np.array([0.2, 0.8]), least, most) == (enough and near)


def test_slits_are_trees_that_hang_by_one_vertex():
    _, F = meshes.grid(6, 6)
    inner = lambda *way: np.array([k * 7 + 3 for k in way])  # noqa: E731
    path = lambda nodes: np.column_stack([nodes[:-1], nodes[1:]])  # noqa: E731
    none = np.zeros((0, 2), np.int64)
    are = mirrored_charts._are_slits
    assert are(none, F, none) and are(path(inner(0, 1, 2)), F, none)
    # From side to side, not at all at the boundary, or around: none is a slit; on a cut it hangs as well.
    assert not are(path(inner(*range(7))), F, none) and not are(path(inner(2, 3, 4)), F, none)
    assert are(path(inner(2, 3, 4)), F, path(np.array([16, 17, 18])))
    around = np.array([[16, 17], [17, 24], [24, 23], [23, 16], [16, 9], [9, 2]])
    assert not are(around, F, none)
    assert are(np.concatenate([path(inner(0, 1)), path(inner(6, 5))]), F, none)


@pytest.mark.parametrize("name", ["density", "region"])
def test_targets_are_the_same_where_both_have_them_and_they_agree(name):
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    pair = [SimpleNamespace(triangles=triangles, vertices=np.zeros((4, 3))) for _ in range(2)]
    image = np.arange(4)

    def asked(one, two):
        other = "region" if name == "density" else "density"
        targets = [None if x is None else SimpleNamespace(**{name: x[0], other: None}) for x in (one, two)]
        return mirrored_charts._same_targets(pair, targets, 0, 1, image)

    value, most = np.array([1.0, 3.0]), 1e-4
    assert asked(None, None) and not asked(None, [value]) and not asked([value], None)
    assert asked([None], [None]) and not asked([value], [None]) and not asked([None], [value])
    for scale in (1e-6, 1.0, 1e6):
        assert asked([scale * value], [scale * (value + [0, 2.9 * most])])
        assert not asked([scale * value], [scale * (value + [0, 3.1 * most])])


@pytest.mark.parametrize("far", [0.0, 0.9, 1.1])
def test_a_half_ends_in_the_plane_and_has_half_of_the_area(far):
    V, F = meshes.grid(8, 4)
    middle = V[:, 0].max() / 2
    # Those of one side, which is made larger by a share of what is allowed.
    half = F[V[F, 0].mean(axis=1) < middle]
    stretched = V.copy()
    right = V[:, 0] > middle
    stretched[right, 0] = middle + (V[right, 0] - middle) * (1 + 2.1 * far * 0.05)
    plane = np.isclose(V[:, 0], middle)
    assert is_half(stretched, F, half, plane) == (far < 1)
    assert not is_half(stretched, F, half[1:], plane) and not is_half(stretched, F, half, plane & (V[:, 1] > 0.5))
