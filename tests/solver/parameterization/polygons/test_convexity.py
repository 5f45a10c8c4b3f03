"""Polygons that are convex on the surface are convex in the map, whichever way they are cut into triangles."""

import functools
from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.parameterization.polygons import convexity, polygon_corners
from omt_uv.solver.parameterization.polygons.convexity import keep_convex
from omt_uv.solver.parameterization.polygons.polygon_corners import convex_corners
from omt_uv.solver.parameterization.polygons.polygon_disk import cut_as_mapped
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def quads(columns=6, rows=6, height=0.0):
    """A square of quads, wavy if it has a height."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1] / [[[rows]], [[columns]]]
    z = height * np.sin(9 * x) * np.cos(7 * y)
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    polygons = np.column_stack([a, a + 1, a + columns + 2, a + columns + 1]).tolist()
    return meshes.polygon_surface(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), polygons)


def corner_areas(surface, result, straight=False):
    """Areas of all corners that count, over their shares of their polygons on the surface if there are no straight."""
    corner, _, share = convex_corners(surface, straight)
    corners, uv = result.corner_uv()
    everywhere = np.full((len(surface.corner_vertex), 2), np.nan)
    everywhere[corners] = uv
    return signed_areas(everywhere, corner) / (1 if straight else share)


def darts():
    """A flat square of quads, and a map of it with two quads that are darts, one with a corner at the boundary."""
    surface = quads()
    (chart,) = strict_charts(surface)
    uv = chart.vertices[:, :2].copy()
    uv[np.isin(chart.vertex_ids, [0, 24])] += 0.1
    assert (signed_areas(uv, chart.triangles) > 0).all()
    return surface, chart, uv


def test_darts_open_beside_a_fold_that_stays():
    surface, chart, uv = darts()
    far = int(np.flatnonzero(chart.vertex_ids == 40)[0])
    uv[far] += 0.25
    folded = signed_areas(uv, chart.triangles) <= 0
    assert folded.any()
    (moved,) = keep_convex(surface, [chart], [uv], [np.zeros(len(uv), bool)], [None], [10.0], [1.0]).values()
    changed = (moved != uv).any(axis=1)
    assert changed[chart.vertex_ids == 0].all() and not changed[chart.triangles[folded]].any()
    still = signed_areas(moved, chart.triangles) <= 0
    np.testing.assert_array_equal(still, folded)


def test_darts_open_and_what_is_fixed_stays():
    surface, chart, uv = darts()
    corner, _, share = convex_corners(surface)
    vertex = np.empty(len(surface.corner_vertex), int)
    vertex[chart.corners] = chart.triangles
    assert (signed_areas(uv, vertex[corner]) < 0).sum() >= 2
    for fixed in (np.zeros(len(uv), bool), chart.vertex_ids == 30):
        found = keep_convex(surface, [chart], [uv], [fixed], [None], [500.0], [np.inf])[0]
        area = signed_areas(found, chart.triangles)
        assert (signed_areas(found, vertex[corner]) > 0).all() and (area > 0).all()
        np.testing.assert_array_equal(found[fixed], uv[fixed])


@pytest.mark.parametrize("turn", [1.0, np.exp(0.7j)])
def test_symmetric_maps_stay_symmetric(turn):
    """All diagonals go one way, and so would the patches."""
    surface = quads(6, 5)
    surface = replace(surface, positions=surface.positions + (surface.positions[:, :1] - 0.5) ** 2 * [0, 0, 1])
    (chart,) = strict_charts(surface)
    w = chart.vertices @ [1, 1j, 0] - 0.5
    w[chart.vertex_ids == 16] += 0.1 - 0.12j
    w[chart.vertex_ids == 18] -= 0.1 + 0.12j
    image = np.abs(w[:, None] + w.conj()).argmin(axis=1)
    assert np.abs(w + w[image].conj()).max() < 1e-12
    w = turn * w + 3
    uv = np.column_stack([w.real, w.imag])
    chart = cut_as_mapped(chart, uv)
    corner, _, _ = convex_corners(surface)
    vertex = np.empty(len(surface.corner_vertex), int)
    vertex[chart.corners] = chart.triangles
    assert (signed_areas(uv, vertex[corner]) < 0).any()
    (new,) = keep_convex(surface, [chart], [uv], [np.zeros(len(uv), bool)], [None], [50.0], [np.inf]).values()
    assert (signed_areas(new, vertex[corner]) > 0).all()
    moved = (new @ [1, 1j] - (new @ [1, 1j]).mean()) / turn
    np.testing.assert_allclose(moved[image], -moved.conj(), atol=1e-12)
    # What one side holds the other holds, too.
    for held in ([16], [18], [9], [16, 11], [23, 25]):
        fixed = np.isin(chart.vertex_ids, held)
        found = keep_convex(surface, [chart], [uv], [fixed], [None], [50.0], [np.inf]).get(0, uv)
        np.testing.assert_array_equal(found[fixed], uv[fixed])
        one = (found @ [1, 1j] - 3) / turn
        np.testing.assert_allclose(one[image], -one.conj(), atol=1e-12)


@pytest.mark.parametrize("sides", [16, 48])
def test_long_polygons_become_convex_and_keep_their_areas(sides):
    """The slivers by which a long polygon is drawn are not held to areas of their own."""
    angle, after = 2 * np.pi * np.arange(sides) / sides, (np.arange(sides) + 1) % sides
    rings = [r * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) for r in (1, 1.3, 1.7)]
    k = np.arange(sides)
    strips = [np.column_stack([m + k, m + sides + k, m + sides + after, m + after]) for m in (0, sides)]
    polygons = [list(range(sides)), *np.concatenate(strips).tolist()]
    surface = meshes.polygon_surface(np.concatenate(rings), polygons)
    (chart,) = strict_charts(surface)
    # As a map that was sheared: long, with a dent at the end.
    uv = chart.vertices[:, :2] * [2, 0.5]
    uv[chart.vertex_ids == 0] -= [4 / sides, 0]
    corner, _, share = convex_corners(surface, straight=True)
    vertex = np.empty(len(surface.corner_vertex), int)
    vertex[chart.corners] = chart.triangles

    def off(uv):
        area = np.bincount(chart.faces, signed_areas(uv, chart.triangles))
        asked = np.bincount(chart.faces, signed_areas(chart.vertices[:, :2], chart.triangles))
        return np.abs(area / area.sum() - asked / asked.sum()).sum()

    assert (signed_areas(uv, vertex[corner]) < 0).any()
    (new,) = keep_convex(surface, [chart], [uv], [np.zeros(len(uv), bool)], [None], [500.0], [0.01]).values()
    assert (signed_areas(new, vertex[corner]) > 0).all() and off(new) < off(uv) + 0.01


def test_maps_without_darts_are_left_alone():
    surface = quads(height=0.1)
    (chart,) = strict_charts(surface)
    flat = chart.vertices[:, :2]
    assert keep_convex(surface, [chart], [flat], [np.zeros(len(flat), bool)], [None], [500.0], [np.inf]) == {}


@pytest.mark.parametrize("scale, shift", [(1, 0), (1e-6, 0), (1e6, 0), (1, 1e5)])
def test_quads_of_a_rugged_surface_are_convex_in_its_map(scale, shift):
    surface = quads(14, 14, height=0.35)
    result = drain(unwrap(replace(surface, positions=scale * surface.positions + shift)))
    (chart_map,) = result.maps
    assert chart_map.folds == 0 and chart_map.area_l1 <= 0.01
    assert (corner_areas(surface, result) > 0).all()
    np.testing.assert_allclose(chart_map.uv / scale, _rugged().uv, atol=1e-5)


@functools.cache
def _rugged():
    return drain(unwrap(quads(14, 14, height=0.35))).maps[0]


def test_straight_corners_stay_straight_where_that_is_exact():
    """A polygon with vertices along its sides, as subdivision of a neighbour leaves them."""
    V = np.array(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0], [0, 1, 0], [3, 0, 0], [3, 2, 0]], float
    )
    surface = meshes.polygon_surface(V, [[6, 0, 1, 2, 3, 4, 5], [2, 7, 8, 3]])
    result = drain(unwrap(surface))
    assert np.abs(result.maps[0].area_l1) < 1e-12
    assert np.sort(corner_areas(surface, result, straight=True))[:3] == pytest.approx(0, abs=1e-12)


def test_nearly_straight_corners_are_opened():
    """A kite with a corner that is almost straight, which the map has pushed in."""
    surface = quads()
    V = surface.positions.copy()
    V[24] += (V[17] + V[25] + V[23] + V[31]) / 4 - V[24]
    middle = 0.5 * (V[25] + V[31])
    V[24] = middle + 0.01 * (V[24] - middle)
    surface = replace(surface, positions=V)
    (chart,) = strict_charts(surface)
    uv = V[chart.vertex_ids, :2].copy()
    here = int(np.flatnonzero(chart.vertex_ids == 24)[0])
    uv[here] += 0.15 * (V[32] - V[24])[:2]
    assert (signed_areas(uv, chart.triangles) > 0).all()
    corner, _, _ = convex_corners(surface, straight=True)
    at = np.empty((len(surface.corner_vertex), 2))
    at[chart.corners.ravel()] = uv[chart.triangles.ravel()]
    assert (signed_areas(at, corner) < 0).any()
    new = keep_convex(surface, [chart], [uv], [np.zeros(len(uv), bool)], [None], [500.0], [np.inf])[0]
    at[chart.corners.ravel()] = new[chart.triangles.ravel()]
    assert (signed_areas(at, corner) > 0).all() and (signed_areas(new, chart.triangles) > 0).all()


@meshes.models_missing
def test_no_fan_of_suzanne_folds():
    surface = meshes.polygon_surface(*meshes.load_polygons("suzanne"))
    result = drain(unwrap(surface))
    assert (corner_areas(surface, result, straight=True) > 0).all()
    assert max(m.area_l1 for m in result.maps) <= 0.01 and sum(m.folds for m in result.maps) == 0


@pytest.mark.parametrize("at_once", [5, 1000])
def test_where_all_corners_are_open_none_is_looked_for(at_once, monkeypatch):
    """Maps are told to have none whichever way it is found, some polygons after the others or all at once."""
    monkeypatch.setattr(polygon_corners, "POLYGONS", at_once)
    surface, chart, uv = darts()
    given = surface, [chart], chart.triangles
    for flat, opened in ((uv, False), (chart.vertices[:, :2], True), (-chart.vertices[:, :2], True)):
        w = flat @ [1, 1j]
        corners = convexity._mapped_corners(*given, w)
        assert convexity._all_open(*given, w) == opened == (not corners.reflex(w).any())
