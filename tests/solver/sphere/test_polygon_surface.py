"""Closed surfaces with long polygons on the sphere: every polygon has its area, however it is cut."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closed_surface import closed_surface
from omt_uv.solver.mesh.polygon_areas import polygon_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere import sphere_map as spheres
from omt_uv.solver.sphere.polygon_surface import PolygonSurface, with_polygon_fans
from omt_uv.solver.sphere.sphere_map import sphere_map


def prism(sides, top=1.0):
    """A prism, or a truncated cone, whose caps are one polygon each."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    V = np.concatenate([np.column_stack([ring, -np.ones(sides)]), np.column_stack([top * ring, np.ones(sides)])])
    k = np.arange(sides)
    walls = np.column_stack([k, (k + 1) % sides, sides + (k + 1) % sides, sides + k]).tolist()
    surface = meshes.polygon_surface(V, [*walls, k[::-1].tolist(), (sides + k).tolist()])
    return V, surface.corner_vertex[surface.triangles], surface.triangle_face


@pytest.mark.parametrize("body", [prism(32), prism(12, top=0.3)])
def test_caps_and_walls_have_their_areas(body):
    V, F, polygons = body
    found = drain(sphere_map(V, F, polygons=polygons))
    assert len(found.positions) == len(found.conformal) == len(V)
    assert (signed_volumes(found.positions, F) > 0).all()
    asked, had = polygon_areas(V, F, polygons), spherical_areas(found.positions, F)
    off = np.bincount(polygons, had / had.sum() - asked / asked.sum())
    assert np.abs(off).sum() < 0.01


def test_fans_ask_for_what_their_polygons_do():
    V, F, polygons = prism(9)
    density = 1.0 + polygons
    surface = closed_surface(V, F)
    given = PolygonSurface(surface, 7 * polygons, polygon_areas(surface.vertices, F) * density)
    fanned = with_polygon_fans(given)
    assert len(fanned.surface.vertices) == len(V) + 2
    assert len(fanned.surface.triangles) == 2 * 9 + 2 * 9
    np.testing.assert_allclose(np.bincount(fanned.polygons, fanned.target), np.bincount(polygons, given.target))
    closed_surface(fanned.surface.vertices, fanned.surface.triangles)


def test_triangles_and_quads_need_no_fans():
    V, F, polygons = prism(4)
    surface = closed_surface(V, F)
    assert with_polygon_fans(PolygonSurface(surface, polygons, np.ones(len(F)))) is None
    assert with_polygon_fans(PolygonSurface(surface, None, np.ones(len(F)))) is None


@pytest.mark.parametrize("pairs", [0, 1, 3])
def test_the_joined_share_is_of_triangles_of_which_a_quad_has_two(pairs):
    joined = np.arange(12)
    joined[1 : 2 * pairs : 2] = joined[: 2 * pairs : 2]
    assert spheres._joined_share(joined, None) == pairs * 2 / 12
    # What was one polygon before has not been joined.
    before = np.arange(12)
    before[[9, 11]] = 10
    joined[[9, 11]] = 10
    assert spheres._joined_share(joined, before) == pairs * 2 / 12
