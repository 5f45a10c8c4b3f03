"""Closest points against brute force, and samples that cover the faces."""

from itertools import pairwise

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import (
    ClosestPoint,
    ClosestPointTracker,
    _one_of_each,
    closest_on_triangles,
    points_in,
    spread_points,
    subdivision_centroids,
)
from omt_uv.solver.mesh.geometry import face_areas, vertex_normals
from omt_uv.solver.mesh.topology import twins


def distances(V, F, points):
    """Distance (k,) of points from a mesh, all faces tried."""
    a, b, c = (V[F[:, k]] for k in range(3))
    coordinates = closest_on_triangles(points[:, None], a, b, c)
    near = np.einsum("kmc,mcd->kmd", coordinates, V[F])
    return np.linalg.norm(near - points[:, None], axis=2).min(axis=1)


@pytest.mark.parametrize("subdivisions", [1, 3])
@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_what_is_near_by_position_is_about_the_nearest_of_all_at_any_distance(subdivisions, size):
    """Inside, in the middle, which all is as far from, on the surface, and far away, by fewer and fewer samples."""
    V, F = meshes.icosphere(subdivisions)
    V, rng = size * V * [1, 1.3, 0.8], np.random.default_rng(0)
    index = ClosestPoint(V, F, 0.02 * size)
    for at, spread in ((0, 0.5), (0, 1e-3), (V[5] / size, 0.05), ([3, 0, 0], 1.0), ([0, 300, 0], 1.0)):
        points = size * (at + spread * rng.normal(size=(60, 3)))
        exact, near = distances(V, F, points), index.near_by_position(points)
        off = np.linalg.norm(index.walk(points, near).points - points, axis=1)
        assert (off >= exact * (1 - 1e-9)).all() and (off <= exact * 1.01 + 1e-12).all()
        assert (off <= exact * (1 + 1e-9) + 1e-12).mean() > 0.95
    counts = [len(owner) for owner, *_ in index._levels]
    assert all(few < many / 3 for many, few in pairwise(counts)) and counts[-1] <= 1000 < counts[0]


def test_coordinates_are_barycentric_and_nothing_is_nearer():
    rng = np.random.default_rng(0)
    q, a, b, c = rng.normal(size=(4, 200, 3))
    found = closest_on_triangles(q, a, b, c)
    assert (found >= 0).all() and np.allclose(found.sum(axis=1), 1)
    near = np.einsum("kc,kcd->kd", found, np.stack([a, b, c], axis=1))
    for other in rng.dirichlet([1, 1, 1], (50, 200)):
        point = np.einsum("kc,kcd->kd", other, np.stack([a, b, c], axis=1))
        assert (np.linalg.norm(q - near, axis=1) <= np.linalg.norm(q - point, axis=1) + 1e-12).all()


@pytest.mark.parametrize("mesh", [meshes.grid(), meshes.torus(16, 8), meshes.icosphere(2)])
def test_points_near_a_surface_find_it(mesh):
    V, F = mesh
    index = ClosestPoint(V, F, 0.1)
    owner, points = spread_points(V, F, 0.1)
    normals = index.normals[owner]
    away = points + 0.02 * normals
    found = index(away, normals)
    np.testing.assert_allclose(np.linalg.norm(found.points - away, axis=1), distances(V, F, away), atol=1e-9)
    np.testing.assert_allclose(index.at(found.faces, found.barycentric), found.points)
    on_it = index(points, normals)
    np.testing.assert_allclose(on_it.points, points, atol=1e-12)


def test_answers_are_never_farther_than_the_place_they_come_from():
    """In a valley the nearest point may be that of the other slope; it is not promised, but nothing is worse."""
    V, F = meshes.bumpy(8, 8)
    index = ClosestPoint(V, F, 0.1)
    owner, points = spread_points(V, F, 0.1)
    away = points + 0.05 * index.normals[owner]
    distance = np.linalg.norm(index(away, index.normals[owner]).points - away, axis=1)
    assert (distance <= 0.05 + 1e-12).all() and (distance >= distances(V, F, away) - 1e-12).all()


def test_the_side_that_looks_the_right_way_answers():
    """Two sides closer to each other than the query is to the right one."""
    V, F = meshes.grid()
    double = np.concatenate([V, V + [0, 0, 0.1]]), np.concatenate([F, F[:, ::-1] + len(V)])
    index = ClosestPoint(*double, 0.1)
    query = np.array([[0.5, 0.5, 0.09]])
    for direction, height in ((1.0, 0.0), (-1.0, 0.1)):
        found = index(query, np.array([[0, 0, direction]]))
        assert found.points[0, 2] == pytest.approx(height)


@pytest.mark.parametrize("first", range(0, 32, 5))
def test_walks_enter_every_triangle_whatever_its_number(first):
    V, F = meshes.grid(4, 4)
    F = np.roll(F, -first, axis=0)
    inner = np.flatnonzero(twins(F) >= 0)
    here, beside = inner // 3, twins(F)[inner] // 3
    found = ClosestPoint(V, F, 0.1).walk(V[F[here]].mean(axis=1) + [0, 0, 0.05], beside)
    np.testing.assert_array_equal(found.faces, here)
    assert set(here.tolist()) == set(range(len(F)))


@pytest.mark.parametrize("depth", [0.0, 1e-6, 0.02])
def test_on_the_wrong_side_of_a_thin_part_the_right_one_answers(depth):
    """However near the wrong one is: next to what is tried it is no distance."""
    V, F = meshes.grid(3, 3)
    both = np.vstack([V, V + [0, 0, 0.05]])
    index = ClosestPoint(both, np.vstack([F[:, ::-1], F + len(V)]), 0.05)
    points = V[F].mean(axis=1) + [0, 0, depth]
    found = index(points, np.tile([0.0, 0, 1], (len(points), 1)), 2000)
    assert (found.faces >= len(F)).all()
    np.testing.assert_allclose(found.points, points * [1, 1, 0] + [0, 0, 0.05], atol=1e-12)


def test_a_tracker_follows_small_steps():
    V, F = meshes.icosphere(2)
    index, tracker = ClosestPoint(V, F, 0.2), ClosestPointTracker(3)
    points = 1.05 * V
    normals = vertex_normals(V, F)
    for _ in range(5):
        points = points @ np.array([[np.cos(0.05), -np.sin(0.05), 0], [np.sin(0.05), np.cos(0.05), 0], [0, 0, 1]])
        found = tracker(index, points, normals)
        np.testing.assert_allclose(np.linalg.norm(found.points - points, axis=1), distances(V, F, points), atol=1e-9)


@pytest.mark.parametrize("spacing", [0.5, 0.11, 0.05])
def test_samples_lie_on_their_faces_in_number_of_their_size(spacing):
    V, F = meshes.bumpy(8, 8)
    owner, points = spread_points(V, F, spacing)
    np.testing.assert_allclose(distances(V, F, points), 0, atol=1e-12)
    assert (np.bincount(owner, minlength=len(F)) >= 1).all()
    count = np.bincount(owner, minlength=len(F))
    centre = np.stack([np.bincount(owner, x, len(F)) for x in points.T], axis=1) / count[:, None]
    np.testing.assert_allclose(centre, V[F].mean(axis=1), atol=1e-12)
    assert face_areas(V, F).sum() / len(points) <= spacing**2


@pytest.mark.parametrize("k", [1, 2, 5])
def test_centroids_of_a_subdivided_triangle(k):
    found = subdivision_centroids(k)
    assert len(found) == k**2 and (found > 0).all()
    np.testing.assert_allclose(found.sum(axis=1), 1)
    np.testing.assert_allclose(found.mean(axis=0), 1 / 3)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_points_of_a_pattern_come_triangle_by_triangle(count):
    rng = np.random.default_rng(0)
    corners, places = rng.random((3, count, 3)), subdivision_centroids(3)
    expected = [place @ corners[:, triangle] for triangle in range(count) for place in places]
    np.testing.assert_allclose(points_in(corners, places), np.reshape(expected, (-1, 3)), atol=1e-15)


def test_middles_of_even_triangles_tell_where_these_are():
    """A sample each, and with two candidates nearly all that the search with more of both finds."""
    V, F = meshes.icosphere(3)
    index, even = ClosestPoint(V, F, 0.1), ClosestPoint(V, F, 0.1, even=True)
    owner, middles = even._spread
    np.testing.assert_array_equal(owner, np.arange(len(F)))
    np.testing.assert_allclose(middles, V[F].mean(axis=1))
    rng = np.random.default_rng(0)
    points = rng.normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points *= rng.uniform(0.95, 1.05, (2000, 1))
    exact = distances(V, F, points)
    found = np.linalg.norm(even(points, points, 2).points - points, axis=1)
    assert (found <= exact + 1e-9).mean() > 0.99 and (found >= exact - 1e-9).all()
    assert len(even._spread[0]) < len(index._spread[0])


def test_points_of_few_large_triangles_are_those_of_many_to_the_bit():
    corners, places = np.random.default_rng(3).normal(size=(3, 4, 3)), subdivision_centroids(5)
    one_by_one = [points_in(corners, places[k : k + 1]) for k in range(len(places))]
    assert np.array_equal(points_in(corners, places).reshape(4, -1, 3), np.stack(one_by_one, axis=1))


@pytest.mark.parametrize("wide", [7, 2**40])
def test_one_of_each_cube_is_the_first_there(wide):
    """However far apart they are: a number for each that would be too large is not made."""
    cubes = np.random.default_rng(5).integers(0, 4, (200, 3)) * wide
    assert np.array_equal(_one_of_each(cubes), np.unique(cubes, axis=0, return_index=True)[1])
