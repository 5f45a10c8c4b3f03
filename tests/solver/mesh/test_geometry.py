"""Lengths, angles, areas, normals and Laplacians, by sums that hold exactly."""

import meshes
import numpy as np
import pytest
from scipy.sparse.linalg import norm

from omt_uv.solver.mesh.geometry import (
    angle_defects,
    angles_from_lengths,
    as_complex,
    as_points,
    bounds,
    cotangent_laplacian,
    cotangents_from_lengths,
    cross2,
    cross3,
    dot2,
    dot3,
    extents,
    face_areas,
    face_normals,
    halfedge_lengths,
    hat_gradients,
    in_parts,
    least_angles,
    lengths,
    signed_areas,
    unit,
    vertex_areas,
    vertex_normals,
)
from omt_uv.solver.mesh.topology import boundary_loops


def test_lengths_and_products_in_columns_are_those_along_the_axis_to_the_bit():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 500, 3, 3)) * 10.0 ** rng.integers(-9, 9, size=(500, 1, 1))
    np.testing.assert_array_equal(dot3(a, b), (a * b).sum(axis=-1))
    for one, other in ((a, b), (a[:, 0], b[0, 0]), (a[0, 0], b[0, 0]), (a[:, :1], b)):
        np.testing.assert_array_equal(cross3(one, other), np.cross(one, other))
    for vectors in (a, a[..., :2], a[:, 0]):
        np.testing.assert_array_equal(lengths(vectors), np.linalg.norm(vectors, axis=-1))


SHAPES = {"bumpy": meshes.bumpy(), "torus": meshes.torus(), "cube": meshes.cube(), "spiral": meshes.spiral_strip()}


@pytest.mark.parametrize("name", SHAPES)
def test_angles_of_a_triangle_sum_to_pi(name):
    V, F = SHAPES[name]
    angles = angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3))
    np.testing.assert_allclose(angles.sum(axis=1), np.pi, rtol=1e-12)
    np.testing.assert_allclose(least_angles(V, F), angles.min(axis=1))
    cotangent = cotangents_from_lengths(halfedge_lengths(V, F).reshape(-1, 3))
    np.testing.assert_allclose(np.sin(angles) * cotangent, np.cos(angles), atol=1e-9)


def test_a_side_that_is_too_long_has_a_straight_angle():
    angles = angles_from_lengths(np.array([[3.0, 1, 1], [1, 1, 5]]))
    np.testing.assert_allclose(angles, [[np.pi, 0, 0], [0, 0, np.pi]], atol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_areas_of_vertices_sum_to_those_of_faces(name):
    V, F = SHAPES[name]
    density = np.random.default_rng(0).uniform(1, 2, len(F))
    assert vertex_areas(V, F).sum() == pytest.approx(face_areas(V, F).sum())
    assert vertex_areas(V, F, density).sum() == pytest.approx(face_areas(V, F) @ density)


def test_signed_areas_turn_with_the_faces():
    V, F = meshes.random_disk()
    uv = V[:, :2].copy()
    area = signed_areas(uv, F)
    np.testing.assert_array_equal(signed_areas(uv * [-1, 1], F), -area)
    flat = np.column_stack([uv, np.zeros(len(uv))])
    np.testing.assert_allclose(face_areas(flat, F), np.abs(area), rtol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_normals(name):
    V, F = SHAPES[name]
    p, normal = V[F], face_normals(V, F)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(np.einsum("mkd,md->mk", p[:, [1, 2, 0]] - p, normal), 0, atol=1e-12)
    np.testing.assert_allclose(face_normals(V, F[:, ::-1]), -normal, atol=1e-12)
    np.testing.assert_allclose(vertex_normals(V, F[:, ::-1]), -vertex_normals(V, F), atol=1e-12)


def test_normals_of_a_closed_surface_by_area_sum_to_nothing():
    V, F = meshes.torus()
    np.testing.assert_allclose(face_areas(V, F) @ face_normals(V, F), 0, atol=1e-12)
    V, F = meshes.icosphere(3)
    assert np.einsum("nd,nd->n", vertex_normals(V, F), V).min() > 0.999


def test_what_has_no_direction_stays_zero():
    assert not unit(np.zeros((2, 3))).any()
    assert not face_normals(np.zeros((3, 3)), np.array([[0, 1, 2]])).any()


@pytest.mark.parametrize("name", SHAPES)
def test_laplacian_is_symmetric_and_knows_no_constants(name):
    V, F = SHAPES[name]
    L = cotangent_laplacian(V, F)
    assert norm(L - L.T) < 1e-12 * norm(L)
    np.testing.assert_allclose(L @ np.ones(len(V)), 0, atol=1e-10)
    # Dirichlet's energy of a map that is linear in space is its area, coordinate by coordinate.
    assert np.einsum("nd,nd->", V, L @ V) / 2 == pytest.approx(face_areas(V, F).sum(), rel=1e-9)


@pytest.mark.parametrize(("name", "euler"), [("bumpy", 1), ("torus", 0), ("cube", 2)])
def test_defects_sum_to_eulers_number(name, euler):
    V, F = SHAPES[name]
    loops = boundary_loops(F)
    boundary = np.concatenate(loops) if loops else np.zeros(0, np.int64)
    angles = angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3))
    assert angle_defects(F, angles, boundary, len(V)).sum() == pytest.approx(2 * np.pi * euler, abs=1e-9)


def test_plane_products_are_those_of_complex_numbers():
    a, b = np.random.default_rng(0).normal(size=(2, 50, 2))
    product = as_complex(a).conj() * as_complex(b)
    np.testing.assert_allclose(product.real, dot2(a, b), atol=1e-14)
    np.testing.assert_allclose(product.imag, cross2(a, b), atol=1e-14)
    np.testing.assert_array_equal(as_points(as_complex(a)), a)


@pytest.mark.parametrize("count", [0, 1, 1 << 14, 100_000])
def test_parts_make_the_whole(count):
    a = np.arange(count)
    parts = list(in_parts(a, 2 * a))
    np.testing.assert_array_equal(np.concatenate([x for x, _ in parts]), a)
    np.testing.assert_array_equal(np.concatenate([x for _, x in parts]), 2 * a)


@pytest.mark.parametrize("d", [2, 3])
def test_bounds_are_those_of_every_axis(d):
    points = np.random.default_rng(d).standard_normal((50, d))
    low, high = bounds(points)
    np.testing.assert_array_equal(low, points.min(axis=0))
    np.testing.assert_array_equal(high, points.max(axis=0))
    np.testing.assert_array_equal(extents(points), np.ptp(points, axis=0))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_triangle_with_two_corners_in_one_place_is_as_low_as_any_without_an_area(scale):
    """Whichever two they are: nothing is divided by what lies between them; nor where all three are in one place."""
    p = scale * np.array([[0.0, 0, 0], [0, 0, 0], [3, 4, 0]])
    for turn in range(3):
        area, hats = hat_gradients(p, np.roll(np.arange(3), turn)[None])
        assert area[0] == pytest.approx(0.5e-9 * (5 * scale) ** 2, rel=1e-6)
        assert np.isfinite(hats).all() and abs(hats.sum()) < 1e-6 * np.abs(hats).max()
    area, hats = hat_gradients(0 * p, np.arange(3)[None])
    assert area[0] > 0 and np.isfinite(hats).all()


@pytest.mark.parametrize("size", [2.0**-500, 2.0**-200, 2.0**200])
def test_areas_are_those_of_any_size(size):
    V, F = meshes.icosphere(1)
    assert np.array_equal(face_areas(size * V, F), size**2 * face_areas(V, F))
    assert not face_areas(0 * V, F).any() and not len(face_areas(size * V, F[:0]))
