"""Islands as an artist lays them: edges along the axes, up in the world up in the map, mirror images mirrored."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from scipy.spatial import Delaunay

from omt_uv.solver.maps.upright import turn_upright
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.surface import triangle_surface

UP = (0.0, 0.0, 1.0)


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def chart_of(polygons):
    """The one chart of quads in space, (n,3) and polygons."""
    (chart,) = strict_charts(polygons)
    return chart


def wall(columns=6, rows=3):
    """A chart of quads on an upright wall, and its map without distortion: x to the right, z up."""
    V, quads = meshes.quad_grid(columns, rows)
    flat = np.asarray(V, float)[:, :2]
    space = np.stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]], axis=1)
    chart = chart_of(meshes.polygon_surface(space, quads))
    return chart, chart.vertices[:, [0, 2]]


@pytest.mark.parametrize("angle", np.linspace(0, 6, 7))
def test_a_wall_stands_however_it_was_mapped(angle):
    chart, uv = wall()
    (found,) = turn_upright([chart], [uv @ rotation(angle).T], [UP])
    np.testing.assert_allclose(found - found.mean(axis=0), uv - uv.mean(axis=0), atol=1e-9)


def test_up_is_what_the_caller_says():
    chart, uv = wall()
    (found,) = turn_upright([chart], [uv], [(1.0, 0.0, 0.0)])
    expected = uv @ rotation(np.pi / 2).T
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_what_lies_level_is_seen_from_above_with_its_far_side_up():
    V, quads = meshes.quad_grid(5, 3)
    chart = chart_of(meshes.polygon_surface(np.asarray(V, float) * [1, 1, 0], quads))
    uv = chart.vertices[:, :2]
    (found,) = turn_upright([chart], [uv @ rotation(2.0).T], [UP])
    np.testing.assert_allclose(found, uv, atol=1e-9)


def test_edges_decide_over_a_slope_that_is_askew():
    """A roof plane that rises askew to its edges keeps these along the axes."""
    chart, uv = wall()
    tilted = chart.vertices[:, [0, 2]] @ rotation(0.3).T
    chart = type(chart)(
        np.stack([tilted[:, 0], 0 * tilted[:, 0], tilted[:, 1]], axis=1),
        chart.triangles,
        chart.corners,
        chart.faces,
        chart.vertex_ids,
    )
    (found,) = turn_upright([chart], [uv @ rotation(1.0).T], [UP])
    np.testing.assert_allclose(found, uv, atol=1e-9)


def test_without_a_direction_of_edges_the_mean_rise_is_upright():
    V, F = meshes.random_disk(count=200, height=0.0)
    space = np.stack([V[:, 0], 0 * V[:, 0], V[:, 1]], axis=1)
    (chart,) = strict_charts(triangle_surface(space, F))
    flat = chart.vertices[:, [0, 2]]
    (found,) = turn_upright([chart], [flat @ rotation(1.2345).T], [UP])
    np.testing.assert_allclose(found, flat, atol=1e-9)


@pytest.mark.parametrize("scene", [((0, 0, 1), (0, -1, 0)), ((0, 1, 0), (0, 0, 1)), ((1, 0, 0), (0, 1, 0))])
def test_what_lies_level_is_seen_from_above_by_the_viewer(scene):
    """Away from him is up in the map, whichever axes of space these are."""
    up, viewer = np.array(scene, dtype=float)
    flat = meshes.random_disk(count=200, height=0.0)[0][:, :2]
    F = meshes.random_disk(count=200, height=0.0)[1]
    space = flat[:, :1] * np.cross(up, viewer) - flat[:, 1:] * viewer
    (chart,) = strict_charts(triangle_surface(space, F))
    laid = np.column_stack([chart.vertices @ np.cross(up, viewer), -(chart.vertices @ viewer)])
    (found,) = turn_upright([chart], [laid @ rotation(1.2).T], [up], [viewer])
    np.testing.assert_allclose(found, laid, atol=1e-9)


def test_mirror_images_are_laid_out_mirrored():
    V, F = meshes.random_disk(count=200, height=0.3)
    space = np.stack([V[:, 0], V[:, 2], V[:, 1]], axis=1)
    (chart,) = strict_charts(triangle_surface(space, F))
    (other,) = strict_charts(triangle_surface(space * [-1, 1, 1], F[:, ::-1]))
    uv = chart.vertices[:, [0, 2]] @ rotation(0.7).T
    image = np.zeros_like(uv)
    image[np.argsort(other.vertex_ids)] = uv[np.argsort(chart.vertex_ids)] * [-1, 1] @ rotation(2.0).T
    one, two = turn_upright([chart, other], [uv, image], [UP, UP])
    two = two[np.argsort(other.vertex_ids)]
    np.testing.assert_allclose(two * [-1, 1], one[np.argsort(chart.vertex_ids)], atol=1e-9)


def test_islands_do_not_depend_on_each_other():
    charts, maps = zip(*(wall(*size) for size in ((6, 3), (2, 5), (4, 4))), strict=True)
    turned = [uv @ rotation(k + 0.5).T for k, uv in enumerate(maps)]
    together = turn_upright(charts, turned, [UP] * 3)
    for chart, uv, found in zip(charts, turned, together, strict=True):
        np.testing.assert_allclose(found, turn_upright([chart], [uv], [UP])[0], atol=1e-12)
    assert turn_upright([], [], []) == []


@pytest.mark.parametrize("angle", [0.2, 0.7, 2.5])
def test_an_outline_that_is_straight_in_part_decides_over_diagonals(angle):
    """A plate with round ends, in a fan of triangles: its long sides are upright."""
    arc = np.linspace(-np.pi / 2, np.pi / 2, 24)
    end = np.stack([0.6 + 0.5 * np.cos(arc), 0.5 * np.sin(arc)], axis=1)
    ring = np.concatenate([end, -end])
    k = np.arange(len(ring))
    V = np.column_stack([np.concatenate([ring, [[0, 0]]]) @ rotation(angle).T, np.zeros(len(ring) + 1)])
    chart = chart_of(triangle_surface(V, np.stack([k, np.roll(k, -1), np.full(len(ring), len(ring))], axis=1)))
    (found,) = turn_upright([chart], [chart.vertices[:, :2]], [UP])
    assert np.sort(np.ptp(found, axis=0)) == pytest.approx([1.0, 2.2], abs=0.01)


def saddled(slope=0.0, count=300, seed=3):
    """A chart that rises to a ridge along y from two sides, the ridge by `slope`, and its map without distortion."""
    V, F = meshes.random_disk(count=count, height=0.0, seed=seed)
    # Mirror images on both sides: the heights cancel.
    space = np.stack([V[:, 0], V[:, 1], slope * V[:, 1] - np.abs(V[:, 0])], axis=1)
    (chart,) = strict_charts(triangle_surface(space, F))
    return chart, chart.vertices[:, :2]


@pytest.mark.parametrize("slope", [0.05, -0.05])
@pytest.mark.parametrize("angle", [0.4, 2.0, 4.5])
def test_what_rises_to_a_ridge_has_it_upright_with_its_higher_end_up(slope, angle):
    """As the hide of an animal, whoever looks from where."""
    chart, flat = saddled(slope)
    for viewer in ((0, -1, 0), (1, 0, 0), (-1, 0, 0)):
        (found,) = turn_upright([chart], [flat @ rotation(angle).T], [UP], [viewer])
        expected = flat if slope > 0 else -flat
        assert abs(np.angle(np.vdot(expected @ [1, 1j], found @ [1, 1j]))) < 0.1


def test_a_level_ridge_lies_as_who_looks_sees_it():
    V, quads = meshes.quad_grid(6, 4)
    flat = np.asarray(V, float)[:, :2] - np.asarray(V, float)[:, :2].mean(axis=0)
    chart = chart_of(meshes.polygon_surface(np.column_stack([flat, -np.abs(flat[:, 1])]), quads))
    (found,) = turn_upright([chart], [chart.vertices[:, :2] @ rotation(0.8).T], [UP], [(0, -1, 0)])
    np.testing.assert_allclose(found, chart.vertices[:, :2], atol=1e-9)


@pytest.mark.parametrize("angle", [0.3, 1.1])
@pytest.mark.parametrize("fold, straight", [(0.5, True), (0.05, False)])
def test_creases_decide_where_neither_sides_nor_outline_have_a_direction(angle, fold, straight):
    """A round plate in triangles of any shape, folded up and down along three chords: these stand along an axis."""
    at, arc = np.array([-0.5, 0.0, 0.5]), np.linspace(0, 2 * np.pi, 90, endpoint=False)
    ends = np.concatenate([np.stack([at, s * np.sqrt(1 - at**2)], axis=1) for s in (-1, 1)])
    inner = np.random.default_rng(2).uniform(-1, 1, (160, 2))
    inner = inner[(np.hypot(*inner.T) < 0.95) & (np.abs(inner[:, :1] - at).min(axis=1) > 0.06)]
    along = [np.stack([np.full(30, x), np.linspace(-1, 1, 32)[1:-1] * np.sqrt(1 - x * x)], axis=1) for x in at]
    flat = np.concatenate([ends, np.stack([np.cos(arc), np.sin(arc)], axis=1), *along, inner])
    F = Delaunay(flat).simplices
    F = np.where(signed_areas(flat, F)[:, None] > 0, F, F[:, ::-1])
    height = fold * np.abs((flat[:, 0] + 0.5) % 1 - 0.5)
    (chart,) = strict_charts(triangle_surface(np.column_stack([flat, height]), F))
    uv = chart.vertices[:, :2] @ rotation(angle).T
    (found,) = turn_upright([chart], [uv], [(0.6, 0.8, 0.1)])
    # The chord through the middle, in the map.
    on = np.abs(chart.vertices[:, 0]) < 1e-12
    ends = found[on][np.argsort(chart.vertices[on, 1])][[0, -1]]
    along = np.abs(ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    assert (along.min() < 0.02) == straight


def pelt(aside, seed=5, count=500):
    """A back with flanks, which rises a little along it and, by `aside`, to one side, as one that raises a leg; and its
    map, with the back upright."""
    P = np.random.default_rng(seed).random((count, 2)) * 2 - 1
    P = P[np.linalg.norm(P, axis=1) < 1] * [2, 2.5]
    P = np.concatenate([P, P * [-1, 1]])
    T = Delaunay(P).simplices
    T = T[np.abs(signed_areas(P, T)) > 1e-9]
    V = np.column_stack([np.sin(P[:, 0]), P[:, 1], np.cos(P[:, 0]) + 0.1 * P[:, 1] + aside * P[:, 0]])
    (chart,) = strict_charts(triangle_surface(V, np.where(signed_areas(P, T)[:, None] > 0, T, T[:, ::-1])))
    return chart, P[chart.vertex_ids]


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.9])
@pytest.mark.parametrize("aside", [-0.06, 0.0, 0.06])
def test_a_back_with_flanks_lies_straight_whichever_way_it_leans_or_looks(aside, angle):
    chart, uv = pelt(aside)
    c, s = np.cos(angle), np.sin(angle)
    about_up = replace(chart, vertices=chart.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    (found,) = turn_upright([about_up], [uv @ rotation(angle + 0.7)], [(0, 0, 1)])
    along = (found - found.mean(axis=0)).T @ (uv - uv.mean(axis=0))
    turn = np.arctan2(along[1, 0] - along[0, 1], along[0, 0] + along[1, 1])
    assert abs(turn) < np.radians(2)
    # What is the other way round in space is so in the map.
    other = replace(chart, vertices=about_up.vertices * [-1, 1, 1])
    (mirrored,) = turn_upright([other], [(uv @ rotation(angle + 0.7)) * [-1, 1]], [(0, 0, 1)])
    assert np.allclose(mirrored, found * [-1, 1], atol=1e-9)
