"""The moves of a fit solve the least squares problem that its description states."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.mesh.geometry import face_normals
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.remeshing.fitting import least_squares
from omt_uv.solver.remeshing.fitting.closest_pairs import ClosestPairs
from omt_uv.solver.remeshing.fitting.least_squares import DistanceWeighting, displacements


def some_pairs(V, F, k=400):
    """Pairs of k samples, of two places in every triangle, and of all vertices, as `Pairing` has them."""
    rng = np.random.default_rng(4)
    corner = np.zeros(len(V), np.int64)
    corner[F.ravel()] = np.arange(F.size)
    places = np.array([[0.5, 0.3, 0.2], [0.1, 0.2, 0.7]])
    faces = np.concatenate([rng.integers(0, len(F), k), np.repeat(np.arange(len(F)), 2), corner // 3])
    bary = np.concatenate([rng.dirichlet(np.ones(3), k), np.tile(places, (len(F), 1)), np.eye(3)[corner % 3]])
    offset = rng.standard_normal((len(faces), 3))
    weight = rng.uniform(0.5, 1.5, len(faces)) * len(V) / len(faces)
    return ClosestPairs(faces, bary, offset, np.linalg.norm(offset, axis=1), weight, k, 2 * len(F))


def test_moves_are_those_of_the_dense_problem(monkeypatch):
    """With distances alone, a little stillness and fairness: the same as written out row by row."""
    V, F = meshes.grid(5, 4)
    n, pairs = len(V), some_pairs(V, F)
    monkeypatch.setattr(least_squares, "CENTROID", 0.0)
    monkeypatch.setattr(least_squares, "FAIRNESS", 0.0)
    monkeypatch.setattr(least_squares, "TOLERANCE", 1e-9)
    monkeypatch.setattr(least_squares, "smallness", lambda points, triangles: np.zeros(len(triangles)))
    fixed = np.arange(n) < 3
    rms = pairs.rms
    found = displacements(V, F, twins(F), fixed, pairs, np.zeros((n, 3)), DistanceWeighting(0.1, rms))
    rows, right = np.zeros((len(pairs.faces), 3 * n)), np.zeros(len(pairs.faces))
    normals = face_normals(V, F)
    for k, face in enumerate(pairs.faces):
        d = pairs.distance[k]
        u = normals[face] if d < 0.1 else pairs.offset[k] / d
        root = np.sqrt(pairs.weight[k] * (1 + min(d / (3.0 * rms), 3.0) ** 2))
        for c in range(3):
            rows[k, 3 * F[face, c] + np.arange(3)] += root * pairs.barycentric[k, c] * u
        right[k] = root * (u @ pairs.offset[k])
    free = np.repeat(~fixed, 3)
    A, b = (rows.T @ rows + 1e-3 * np.eye(3 * n)), rows.T @ right
    expected = np.zeros(3 * n)
    expected[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    assert np.abs(found.ravel() - expected).max() < 1e-7 * np.abs(expected).max()
    # One of several steps, after each of which closest points are others, need not be exact.
    monkeypatch.undo()
    monkeypatch.setattr(least_squares, "CENTROID", 0.0)
    monkeypatch.setattr(least_squares, "FAIRNESS", 0.0)
    monkeypatch.setattr(least_squares, "smallness", lambda points, triangles: np.zeros(len(triangles)))
    found = displacements(V, F, twins(F), fixed, pairs, np.zeros((n, 3)), DistanceWeighting(0.1, rms))
    assert np.abs(found.ravel() - expected).max() < 1e-3 * np.abs(expected).max()


def test_fixed_vertices_stay():
    V, F = meshes.grid(5, 4)
    fixed = np.arange(len(V)) % 3 == 0
    moves = displacements(V, F, twins(F), fixed, some_pairs(V, F), np.zeros_like(V), DistanceWeighting(1e-3, 1.0))
    assert (moves[fixed] == 0).all() and np.abs(moves[~fixed]).min() > 0


def test_the_matrix_is_symmetric_where_the_surface_bends(monkeypatch):
    """Springs act along the surface, which is another plane at every vertex; conjugate gradients need symmetry."""
    V, F = meshes.bumpy(7, 6)
    n, rng = len(V), np.random.default_rng(1)
    systems = []
    monkeypatch.setattr(least_squares, "conjugate_gradients", lambda times, b, *_: systems.append(times) or b)
    monkeypatch.setattr(least_squares, "smallness", lambda points, triangles: rng.random(len(triangles)))
    displacements(V, F, twins(F), np.zeros(n, bool), some_pairs(V, F), np.zeros((n, 3)), DistanceWeighting(1e-3, 1.0))
    matrix = np.stack([systems[0](e) for e in np.eye(3 * n)])
    assert np.abs(matrix - matrix.T).max() < 1e-14 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix).min() > 0
