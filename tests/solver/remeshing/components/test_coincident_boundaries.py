"""Boundaries that lie on one another are joined, and reopened to as many vertices as are told before."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.topology import boundary_loops, pair_keys
from omt_uv.solver.remeshing.components.coincident_boundaries import join_coincident, reopened, reopened_copies


def open_tube():
    """A rectangle rolled up until two sides of it lie on one another."""
    V, F = meshes.grid(8, 5)
    P = np.column_stack([np.cos(2 * np.pi * V[:, 0]), V[:, 1], -np.sin(2 * np.pi * V[:, 0])])
    number = np.arange(len(P)).reshape(6, 9)
    P[number[:, 8]] = P[number[:, 0]]
    return P, F


def test_join_and_reopen_lead_back():
    V, F = open_tube()
    joined = join_coincident(V, F)
    assert topology(F) == (1, 1) and topology(joined.triangles) == (0, 2) and len(joined.to_reopen) == 5
    used, compact = np.unique(joined.triangles, return_inverse=True)
    number = np.searchsorted(used, joined.to_reopen)
    keys = np.sort(pair_keys(number[:, 0], number[:, 1]))
    P, T = reopened(V[used], compact.reshape(-1, 3), keys)
    assert topology(T) == (1, 1) and len(P) == len(V)
    np.testing.assert_array_equal(P[T], V[joined.same][F])


def test_as_many_copies_as_are_told():
    V, F = meshes.icosphere(1)
    rng = np.random.default_rng(3)
    edges = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]]]), axis=1), axis=0)
    for _ in range(5):
        some = edges[rng.random(len(edges)) < 0.3]
        P, T = reopened(V, F, np.sort(pair_keys(*some.T)))
        assert len(P) - len(V) == reopened_copies(some.ravel(), np.zeros(len(V), dtype=bool))
    G, H = meshes.grid(4, 4)
    on_boundary = np.zeros(len(G), dtype=bool)
    on_boundary[boundary_loops(H)[0]] = True
    across = np.array([[2, 7], [7, 12], [12, 17], [17, 22]])
    P, T = reopened(G, H, np.sort(pair_keys(*across.T)))
    assert len(P) - len(G) == reopened_copies(across.ravel(), on_boundary) == 5


def test_what_does_not_lie_on_another_stays():
    V, F = meshes.annulus()
    joined = join_coincident(V, F)
    assert joined.triangles is F and len(joined.to_reopen) == 0


def pillow():
    """Two strips of two cells back to back: joined, four faces would meet along the edge between the cells."""
    V, F = meshes.grid(2, 1)
    return np.concatenate([V, V]), np.concatenate([F, F[:, ::-1] + len(V)])


def closed_fan():
    """Three faces around a vertex, of which two ends lie on one another: joined, one side would have no length."""
    return np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [1, 0, 0]]), np.array([[0, 1, 2], [2, 1, 3], [0, 2, 3]])


@pytest.mark.parametrize("made", [pillow, closed_fan])
def test_nothing_is_joined_where_that_would_give_no_surface(made):
    V, F = made()
    joined = join_coincident(V, F)
    np.testing.assert_array_equal(joined.triangles, F)
    assert joined.same.tolist() == list(range(len(V))) and joined.to_reopen.shape == (0, 2)
