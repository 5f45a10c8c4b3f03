"""Distances between triangles are those of their nearest points, however many of these are tried."""

from __future__ import annotations

import numpy as np
from bodies import icosphere

from omt_uv.solver.contact.proximity import ClosePairs, close_pairs, triangle_distances


def test_offsets_are_those_of_the_nearest_of_many_points():
    rng = np.random.default_rng(0)
    V = rng.normal(size=(400, 3))
    corners = np.arange(400).reshape(-1, 4)
    pairs = ClosePairs(corners, 50)
    offset, weights = pairs.offsets(V)
    length = np.linalg.norm(offset, axis=1)
    t = np.linspace(0, 1, 41)
    a, b = (g.ravel() for g in np.meshgrid(t, t))
    inside = a + b <= 1 + 1e-12
    face = np.stack([1 - a - b, a, b])[:, inside]
    for k, rows in enumerate(corners):
        p = V[rows]
        if k < 50:
            tried = p[0] - face.T @ p[1:]
        else:
            tried = ((1 - a)[:, None] * p[0] + a[:, None] * p[1]) - ((1 - b)[:, None] * p[2] + b[:, None] * p[3])
        least = np.linalg.norm(tried, axis=1).min()
        assert length[k] <= least + 1e-12 and least < length[k] + 0.08
        np.testing.assert_allclose(weights[k] @ p, offset[k], atol=1e-12)


def test_parallel_edges_and_points_above_faces():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 0.5], [0, 0, 0.3], [2, 0, 0.3]], float)
    pairs = ClosePairs(np.array([[3, 0, 1, 2], [0, 1, 4, 5]]), 1)
    np.testing.assert_allclose(pairs.offsets(V)[0], [[0, 0, 0.5], [0, 0, -0.3]], atol=1e-12)


def test_close_ones_are_found_and_neighbours_are_none():
    V, F = icosphere(2)
    gap = 0.02
    both, faces = np.concatenate([V, V * (1 - gap)]), np.concatenate([F, F + len(V)])
    found = close_pairs(both, faces, 2 * gap)
    length = np.linalg.norm(found.offsets(both)[0], axis=1)
    assert (np.sort(found.corners, axis=1)[:, 1:] != np.sort(found.corners, axis=1)[:, :-1]).all()
    # Each vertex of a ball has the faces around its twin.
    near = found.corners[: found.points][length[: found.points] < gap * 1.001]
    assert set(near[:, 0]) == set(range(len(both)))
    assert not len(close_pairs(V, F[:0], 0.1).corners)


def test_what_moved_is_looked_for_alone():
    V, F = icosphere(2)
    V, F = np.concatenate([V, V + [2.05, 0, 0]]), np.concatenate([F, F + len(V)])
    every = {tuple(sorted(row)) for row in close_pairs(V, F, 0.3).corners.tolist()}
    moved = np.arange(len(V)) == V[:, 0].argmax()
    mine = {tuple(sorted(row)) for row in close_pairs(V, F, 0.3, moved).corners.tolist()}
    rest = close_pairs(V, F, 0.3)
    rest = rest.among(~moved[rest.corners].any(axis=1))
    assert mine <= every and {row for row in every if moved[list(row)].any()} <= mine
    both = rest.joined(close_pairs(V, F, 0.3, moved))
    assert {tuple(sorted(row)) for row in both.corners.tolist()} == every


def test_triangles_touch_where_they_have_a_point_besides_their_common_vertex():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, 0], [0, 0, 1], [1, 0, 1], [0.3, 0.4, 1]], float)
    F = np.array([[0, 1, 2], [3, 4, 5], [4, 5, 6], [0, 4, 5], [0, 3, 4]])
    pairs = np.array([[0, 1], [0, 2], [0, 3], [0, 4]])
    found = triangle_distances(V, F, pairs)
    np.testing.assert_allclose(found[[0, 1, 3]], [0, 1, 0], atol=1e-12)
    assert 0.5 < found[2] < 1
    assert not len(triangle_distances(V, F, pairs[:0]))
