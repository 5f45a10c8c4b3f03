"""Points found in their triangles, in the plane, beside it, and on the sphere."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.point_location import _barycentric, locate


def test_points_of_the_plane_come_back():
    V, F = meshes.random_disk()
    uv = V[:, :2]
    rng = np.random.default_rng(0)
    faces, weights = rng.integers(0, len(F), 500), rng.dirichlet([1, 1, 1], 500)
    points = np.einsum("kc,kcd->kd", weights, uv[F[faces]])
    found, barycentric = locate(uv, F, points)
    np.testing.assert_array_equal(found, faces)
    np.testing.assert_allclose(barycentric, weights, atol=1e-9)


def test_points_outside_go_to_the_boundary():
    V, F = meshes.grid()
    found, barycentric = locate(V[:, :2], F, np.array([[0.5, -1.0], [2.0, 0.5], [-3.0, -3.0]]))
    points = np.einsum("kc,kcd->kd", barycentric, V[:, :2][F[found]])
    assert (barycentric >= 0).all() and np.allclose(barycentric.sum(axis=1), 1)
    np.testing.assert_allclose([points[0, 1], points[1, 0]], [0, 1], atol=1e-12)
    np.testing.assert_allclose(points[2], 0, atol=1e-12)


def test_points_of_the_sphere_come_back():
    V, F = meshes.icosphere(2)
    rng = np.random.default_rng(0)
    faces = rng.integers(0, len(F), 300)
    points = np.einsum("kc,kcd->kd", rng.dirichlet([1, 1, 1], 300), V[F[faces]])
    found, barycentric = locate(V, F, points / np.linalg.norm(points, axis=1, keepdims=True))
    np.testing.assert_array_equal(found, faces)
    again = np.einsum("kc,kcd->kd", barycentric, V[F[found]])
    np.testing.assert_allclose(again / np.linalg.norm(again, axis=1, keepdims=True),
                               points / np.linalg.norm(points, axis=1, keepdims=True), atol=1e-9)  # fmt: skip


@pytest.mark.parametrize("d", [2, 3])
def test_coordinates_give_the_point_back_and_none_is_positive_in_a_folded_triangle(d):
    corners = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.2, 0.8, 1.0]])[:, :d]
    share = np.random.default_rng(0).dirichlet([1, 1, 1], 20)
    points = share @ corners
    found = _barycentric(np.tile(corners, (20, 1, 1)), points)
    np.testing.assert_allclose(found, share, atol=1e-12)
    folded = _barycentric(np.tile(corners[[0, 2, 1]], (20, 1, 1)), points)
    assert (folded < 0).all()
    np.testing.assert_allclose(-folded[:, [0, 2, 1]], share, atol=1e-12)
