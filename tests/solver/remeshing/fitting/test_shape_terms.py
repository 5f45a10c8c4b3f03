"""Springs that keep triangles in shape: they pull to the nearest equilateral triangle, whichever way it looks."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.mesh.geometry import halfedge_lengths, laplacian_from_weights
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.remeshing.fitting.shape_terms import SMALL, Fairness, equilateral, smallness

ONE = np.array([[0, 1, 2]])


def test_equilateral_triangles_are_left_alone():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])
    assert smallness(V, ONE) == 0
    assert np.abs(equilateral(V, ONE, np.ones(1)).force).max() < 1e-14


def test_any_triangle_comes_to_rest_equilateral():
    rng = np.random.default_rng(5)
    for _ in range(5):
        V = rng.standard_normal((3, 3))
        forces = equilateral(V, ONE, np.ones(1))
        K = laplacian_from_weights(*halfedges(ONE), -forces.between, 3)
        assert np.abs(K.diagonal() - forces.diagonal).max() < 1e-14
        W = V + np.linalg.lstsq(K.toarray(), forces.force, rcond=None)[0]
        assert np.ptp(halfedge_lengths(W, ONE)) < 1e-12
        assert np.abs(W.mean(axis=0) - V.mean(axis=0)).max() < 1e-12
        # In its plane, and turned as little as can be: the moves have no moment.
        assert abs(np.linalg.det(np.stack([W[0] - V[0], V[1] - V[0], V[2] - V[0]]))) < 1e-12
        assert np.linalg.norm(np.cross(V - V.mean(axis=0), W - V).sum(axis=0)) < 1e-12


def test_springs_set_in_where_angles_are_small():
    V = np.array([[0.0, 0, 0], [2, 0, 0], [1, np.tan(SMALL), 0], [1, -np.tan(SMALL) / 2, 0]])
    bad = smallness(V, np.array([[0, 1, 2], [1, 0, 3]]))
    assert bad[0] < 1e-12 and bad[1] > 0


def test_fairness_is_the_gradient_of_squared_differences_from_neighbours():
    V, F = meshes.grid(4, 3)
    n = len(V)
    near = np.zeros((n, n))
    near[F, F[:, [1, 2, 0]]] = near[F[:, [1, 2, 0]], F] = 1
    D = np.eye(n) - near / near.sum(axis=1, keepdims=True)
    even, x = Fairness(F, twins(F), n), np.random.default_rng(2).standard_normal((n, 3))
    assert np.abs(even(x) - D.T @ D @ x).max() < 1e-14
    assert np.abs(even.diagonal - (D.T @ D).diagonal()).max() < 1e-14
