"""Markers of maps, cells of transport, hulls that are flipped, and charts that equal others, one decision by one."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.canonical.markers import ChartMarkers
from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.parameterization import mirrored_charts
from omt_uv.solver.refinement import refine as refinement
from omt_uv.solver.transport import cell_polygons, spherical_power_diagram
from omt_uv.solver.transport.convex_domain import ConvexPolygon, Disk

# ---- markers ------------------------------------------------------------------------------------------------


def disk(count=12, inner=5, seed=0):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(count) + 0.3 * rng.random(count)) / count
    # Points of the boundary that are only nearly on the circle.
    outline = np.column_stack([np.cos(angle), np.sin(angle)]) * (1 + 1e-6 * rng.standard_normal((count, 1)))
    return np.concatenate([outline, 0.4 * rng.standard_normal((inner, 2))]), np.arange(count)


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"start": 3},
        {"centre": 14},
        {"centre": 14, "start": 3},
        {"corners": (1, 5, 9)},
        {"corners": (1, 5, 9), "start": 3},
    ],
)
def test_markers_move_a_disk_onto_itself(given):
    uv, loop = disk()
    before = uv.copy()
    found = ChartMarkers(**given).in_disk(uv, loop)
    assert np.linalg.norm(found[loop], axis=1) == pytest.approx(np.ones(12), abs=1e-15)
    assert (np.linalg.norm(found[12:], axis=1) < 1).all() and np.array_equal(uv, before)
    if "centre" in given:
        assert found[14] == pytest.approx([0, 0], abs=1e-15)
    if "corners" in given:
        assert found[[1, 5, 9]] == pytest.approx(np.array([[1, 0], [0, 1], [-1, 0]]), abs=1e-12)
    elif "start" in given:
        assert found[3] == pytest.approx([1, 0], abs=1e-15)
    if not given:
        assert np.array_equal(found[12:], uv[12:])


@pytest.mark.parametrize(("centre", "start"), [(-1, -1), (-1, 2), (4, 2), (2, 2)])
def test_maps_are_turned_until_the_start_lies_to_the_right(centre, start):
    uv, _ = disk()
    found = ChartMarkers(centre=centre, start=start).turned(uv)
    if start < 0 or centre == start:
        assert found is uv
        return
    way = found[start] - (found[centre] if centre >= 0 else 0)
    assert way[1] == pytest.approx(0, abs=1e-15) and way[0] > 0
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.linalg.norm(uv, axis=1))


# ---- cells --------------------------------------------------------------------------------------------------


def test_cells_have_the_corners_of_a_polygon_and_many_points_of_a_circle():
    square = ConvexPolygon(np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]]))
    assert cell_polygons._boundary(square) is square.corners
    found = cell_polygons._boundary(Disk())
    assert len(found) == 720 and np.linalg.norm(found, axis=1) == pytest.approx(np.ones(len(found)))
    step = np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1)
    assert step == pytest.approx(np.full(len(found), 2 * np.sin(np.pi / len(found))))


def test_means_of_owners_and_where_each_begins():
    points, owner = np.arange(10.0).reshape(5, 2), np.array([2, 0, 2, 2, 0])
    found = cell_polygons._means(points, owner, 4)
    want = [points[owner == k].mean(axis=0) if (owner == k).any() else [0, 0] for k in range(4)]
    assert found == pytest.approx(np.array(want)) and cell_polygons._starts(owner, 4).tolist() == [0, 2, 2, 5, 5]


@pytest.mark.parametrize("same", [1e-9, 0.3])
def test_corners_of_cells_go_round_their_middles_each_once(same):
    angle = np.array([2.0, -1.0, 0.5, 0.7, 3.0])
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    both = np.concatenate([points + 5, points[[1, 4, 2]]])
    found = cell_polygons._sorted(both, np.array([1] * 5 + [0] * 3), np.array([[0.0, 0], [5, 5]]), same)
    first = found.points[found.start[0] : found.start[1]]
    assert first == pytest.approx(points[[1, 2, 4]])
    second = found.points[found.start[1] : found.start[2]] - 5
    order = [1, 2, 3, 0, 4] if same < 0.1 else [1, 2, 0, 4]
    assert len(second) == len(order) and (np.diff(np.arctan2(second[:, 1], second[:, 0])) > 0).all()


@pytest.mark.parametrize("state", ["good", "moved", "hidden"])
def test_hulls_are_flipped_until_they_are_convex_or_say_that_they_are_not(state):
    P, T = meshes.icosphere(1)
    from omt_uv.solver.mesh.topology import twins
    from omt_uv.solver.transport.spherical_power_diagram import Hull, by_flips, by_hull

    weights = np.zeros(len(P))
    if state == "moved":
        weights = 0.02 * np.random.default_rng(3).standard_normal(len(P))
    if state == "hidden":
        weights[5] = -3.0
    found, hidden = by_flips(Hull(T, twins(T)), P, weights)
    if state == "hidden":
        assert found is None and hidden
        return
    assert not hidden and found is not None
    # Every site lies below the planes of all facets.
    points = np.exp(weights)[:, None] * P
    a, b, c = (points[found.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    height = points @ normal.T - (normal * a).sum(axis=1)
    assert height.max() < 1e-9
    exact = by_hull(P, weights)
    assert {frozenset(t) for t in found.triangles.tolist()} == {frozenset(t) for t in exact.triangles.tolist()}
    assert np.array_equal(found.twin, twins(found.triangles))
    normals = spherical_power_diagram.facet_normals(P, weights, found.triangles)
    assert np.abs((normals * normalized(normal)).sum(axis=1)) == pytest.approx(np.ones(len(normals)))


# ---- charts that equal others -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Map:
    uv: np.ndarray
    folds: int = 0


V, F = meshes.grid(2, 2)


@pytest.mark.parametrize(
    ("folds", "target", "its", "same", "motion", "taken"),
    [
        (0, None, None, True, 1.0, True),
        (1, None, None, True, 1.0, False),
        (0, "target", None, True, 1.0, False),
        (0, None, "target", True, 1.0, False),
        (0, "target", "target", True, 1.0, True),
        (0, "target", "target", False, 1.0, False),
        (0, None, None, True, -1.0, True),
        (0, None, None, True, None, False),
    ],
)
def test_a_chart_has_the_map_of_one_that_it_equals(folds, target, its, same, motion, taken, monkeypatch):
    mirrored = np.array([2, 1, 0, 5, 4, 3, 8, 7, 6]) if motion == -1.0 else np.arange(9)
    monkeypatch.setattr(
        mirrored_charts, "motion_between", lambda first, other: None if motion is None else (mirrored, motion)
    )
    monkeypatch.setattr(mirrored_charts, "_same_targets", lambda *_: same)
    chart = SimpleNamespace(triangles=F)
    other = Map(V[:, :2] * 3 + 1, folds)
    found = mirrored_charts.equal_chart_map(chart, target, [("first", its, other)])
    assert (found is not None) == taken
    if taken:
        assert np.array_equal(found.uv, other.uv[mirrored] * [motion, 1.0])
    # One that folds some of its triangles is none; the next may do.
    over = Map(V[:, :2] * [-1.0, 1.0])
    again = mirrored_charts.equal_chart_map(chart, target, [("folded", its, over), ("first", its, other)])
    if motion != -1.0:
        assert (again is not None) == taken


@pytest.mark.parametrize("symmetric", [True, False])
def test_problems_that_are_mirrored_count_all_polygons_and_have_no_sweeps(symmetric, monkeypatch):
    monkeypatch.setattr(refinement, "MirroredMotion", lambda motion, symmetry, w: (motion, symmetry, w))

    @dataclass(frozen=True)
    class Problem:
        motion: object = "motion"
        symmetry: object = None
        smoother: object = "sweeps"
        count: int | None = None
        loose: bool = True

    found = refinement._mirrored(Problem(), "symmetry" if symmetric else None, "w", 7)
    if symmetric:
        assert found == Problem(("motion", "symmetry", "w"), "symmetry", None, 7, False)
    else:
        assert found == Problem()


@pytest.mark.parametrize("boundary", ["free", "disk"])
@pytest.mark.parametrize("crosses", [True, False])
def test_problems_have_the_loop_that_may_cross_itself_and_a_scale(crosses, boundary):
    initial = SimpleNamespace(motion="motion", may_cross=crosses, with_barrier=True)
    found = refinement._map_problem("faces", "assembly", initial, "loop", boundary, "sweeps", "loose")
    assert (found.faces, found.assembly, found.motion, found.smoother) == ("faces", "assembly", "motion", "sweeps")
    assert found.loose == "loose"
    assert (
        found.loop == ("loop" if crosses else None) and found.with_barrier and found.scale_free == (boundary != "free")
    )
