"""Polygons as elements: areas and energies that do not depend on how a polygon is cut, and exact derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.maps.energy import area_error, area_forms_of, elements, energy, gradient
from omt_uv.solver.maps.polygon_elements import polygon_elements, polygon_mesh, restricted, with_convex_quads
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.parameterization.polygons.polygon_corners import CONVEX


def quads(count=5, seed=0):
    """A wavy patch of quads: vertices (n,3), quads (q,4)."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(count + 1.0), np.arange(count + 1.0), indexing="ij")
    V = np.stack([x, y, np.sin(x) * np.cos(y)], axis=-1).reshape(-1, 3) + 0.1 * rng.random(((count + 1) ** 2, 3))
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    return V, np.column_stack([corner, corner + count + 1, corner + count + 2, corner + 1])


def cut(Q, other):
    one, two = Q[:, [[0, 1, 2], [0, 2, 3]]], Q[:, [[0, 1, 3], [1, 2, 3]]]
    return np.where(other[:, None, None], two, one).reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)


def of(V, Q, other):
    T, faces = cut(Q, other)
    return polygon_elements(V, T, face_areas(V, T), faces)


def flat(V, seed=1):
    rng = np.random.default_rng(seed)
    return V[:, :2] @ [1, 1j] + 0.05 * (rng.random(len(V)) + 1j * rng.random(len(V)))


def test_nothing_depends_on_the_diagonals_given():
    V, Q = quads()
    w = flat(V)
    one, two = (with_convex_quads(of(V, Q, np.full(len(Q), k)), w) for k in (False, True))
    np.testing.assert_allclose(one.area, two.area, rtol=1e-13)
    np.testing.assert_allclose(one.ratio, two.ratio, rtol=1e-13)
    np.testing.assert_allclose(one.areas(w), two.areas(w), rtol=1e-12)
    assert energy(one, w, 7.0) == pytest.approx(energy(two, w, 7.0), rel=1e-12)
    np.testing.assert_allclose(gradient(one, w, 7.0), gradient(two, w, 7.0), atol=1e-13)


def test_the_area_of_a_quad_is_the_mean_of_both_triangulations_and_their_map_the_shoelace():
    V, Q = quads()
    w, faces = flat(V), of(V, Q, np.zeros(len(Q), bool))
    both = [face_areas(V, cut(Q, np.full(len(Q), k))[0]).reshape(-1, 2).sum(1) for k in (False, True)]
    mean = np.mean(both, axis=0)
    np.testing.assert_allclose(faces.area, mean / mean.sum(), rtol=1e-12)
    a, b, c, d = w[Q].T
    shoelace = 0.5 * ((c - a).conj() * (d - b)).imag
    np.testing.assert_allclose(faces.areas(w) * mean.sum(), shoelace, rtol=1e-12)


@pytest.mark.parametrize("convex", [False, True])
def test_the_gradient_is_the_slope_of_the_energy(convex):
    V, Q = quads(3)
    w, faces = flat(V), of(V, Q, np.zeros(len(Q), bool))
    faces = with_convex_quads(faces, w) if convex else faces
    slope, h = gradient(faces, w, 3.0), 1e-6
    for k in range(len(w)):
        for axis, part in ((1, slope[k].real), (1j, slope[k].imag)):
            step = np.zeros(len(w), complex)
            step[k] = h * axis
            numeric = (energy(faces, w + step, 3.0) - energy(faces, w - step, 3.0)) / (2 * h)
            assert part == pytest.approx(numeric, abs=1e-7)


def test_triangles_alone_are_the_elements_of_triangles():
    V, Q = quads()
    T, _ = cut(Q, np.zeros(len(Q), bool))
    target = face_areas(V, T)
    one, two = elements(V, T, target), polygon_elements(V, T, target, np.arange(len(T)))
    np.testing.assert_array_equal(one.ratio, two.ratio)
    assert energy(one, flat(V), 5.0) == energy(two, flat(V), 5.0)


def test_only_convex_quads_have_both_triangulations():
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    Q = np.array([[0, 1, 2, 3]])
    square, dart = np.array([0, 1, 1 + 1j, 1j]), np.array([0, 1, 0.2 + 0.2j, 1j])
    faces = of(V, Q, np.array([False]))
    assert (with_convex_quads(faces, square).part == 0.5 * faces.quads.size.ravel()).all()
    assert with_convex_quads(faces, dart) is faces
    assert np.isfinite(energy(faces, dart, 1.0))


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_quads_count_along_both_diagonals_as_soon_as_no_corner_is_reflex(share):
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    Q, square = np.array([[0, 1, 2, 3]]), np.array([0, 1, 1 + 1j, 1j])
    w = square.copy()
    # The quad has an area of x, and its corner one of x - 1/2.
    x = 0.5 / (1 - 0.5 * CONVEX * share)
    w[2] = x * (1 + 1j)
    faces = of(V, Q, np.array([True]))
    both = with_convex_quads(faces, w).part > 0
    assert both.all() == (share > 1)


def test_polygons_are_found_by_their_triangles_in_any_order():
    T = np.array([[0, 1, 2], [4, 5, 6], [2, 3, 0], [6, 7, 8], [4, 6, 8]])
    mesh = polygon_mesh(T, np.array([5, 9, 5, 9, 9]))
    assert len(mesh.quads) == 1 and mesh.count == 2
    assert set(mesh.quads[0]) == {0, 1, 2, 3}
    np.testing.assert_allclose(mesh.given(np.array([1.0, 10, 100, 1000, 10000])), [11010, 101])


def test_restricted_elements_keep_their_energies():
    V, Q = quads()
    w = flat(V)
    faces = with_convex_quads(of(V, Q, np.zeros(len(Q), bool)), w)
    kept = np.arange(len(faces.area)) % 3 == 0
    part = restricted(faces, kept, np.arange(len(V)))
    np.testing.assert_allclose(part.areas(w), faces.areas(w)[kept], rtol=1e-14)


def test_the_area_error_vanishes_for_a_map_with_the_areas_asked_for():
    V, Q = quads()
    V[:, 2] = 0
    assert area_error(of(V, Q, np.zeros(len(Q), bool)), V[:, :2] @ [1, 1j]) < 1e-14


@pytest.mark.parametrize("lone", [0, 1, 7, 24])
def test_rows_of_areas_are_those_of_polygons_of_several_triangles_alone(lone):
    """Others have theirs among the rest of what is theirs, and would have them twice."""
    V, Q = quads()
    T, faces = cut(Q, np.zeros(len(Q), bool))
    # Both halves of the last quads are polygons of their own.
    own = faces >= len(Q) - lone
    found = polygon_elements(V, T, face_areas(V, T), np.where(own, len(Q) + np.arange(len(T)), faces))
    w = flat(V)
    a, b = found.derivatives(w)
    rows = area_forms_of(found, a, b, 3.0)
    alone = np.bincount(found.polygon)[found.polygon] == 1
    assert alone.sum() == 2 * lone and (rows[alone] == 0).all()
    has_rows = np.bincount(found.polygon[~alone], np.abs(rows[~alone]).sum(axis=1))
    assert (has_rows[np.unique(found.polygon[~alone])] > 0).all()
