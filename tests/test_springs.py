"""Springs that keep triangles in shape: they pull to the nearest equilateral triangle, whichever way it looks."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.geometry import halfedge_lengths
from omt_uv.solver.springs import SMALL, equilateral, smallness

ONE = np.array([[0, 1, 2]])


def test_equilateral_triangles_are_left_alone():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])
    assert smallness(V, ONE) == 0
    assert np.abs(equilateral(V, ONE, np.ones(1))[1]).max() < 1e-14


def test_any_triangle_comes_to_rest_equilateral():
    rng = np.random.default_rng(5)
    for _ in range(5):
        V = rng.standard_normal((3, 3))
        K, force = equilateral(V, ONE, np.ones(1))
        W = V + np.linalg.lstsq(K.toarray(), force, rcond=None)[0].reshape(3, 3)
        assert np.ptp(halfedge_lengths(W, ONE)) < 1e-12
        assert np.abs(W.mean(axis=0) - V.mean(axis=0)).max() < 1e-12
        # In its plane, and turned as little as can be: the moves have no moment.
        assert abs(np.linalg.det(np.stack([W[0] - V[0], V[1] - V[0], V[2] - V[0]]))) < 1e-12
        assert np.linalg.norm(np.cross(V - V.mean(axis=0), W - V).sum(axis=0)) < 1e-12


def test_springs_set_in_where_angles_are_small():
    V = np.array([[0.0, 0, 0], [2, 0, 0], [1, np.tan(SMALL), 0], [1, -np.tan(SMALL) / 2, 0]])
    bad = smallness(V, np.array([[0, 1, 2], [1, 0, 3]]))
    assert bad[0] < 1e-12 and bad[1] > 0
