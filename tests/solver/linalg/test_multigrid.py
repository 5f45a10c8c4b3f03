"""Multigrid: the solutions of a factorisation, in as many iterations whatever the size."""

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree
from work import counted_work

from omt_uv.solver.linalg import multigrid
from omt_uv.solver.linalg.multigrid import LaplacianSolver, Multigrid
from omt_uv.solver.linalg.sparse import solve_spd
from omt_uv.solver.mesh.geometry import laplacian_from_weights


def graph(count, stretch=1.0):
    """The Laplacian of a random triangulation with weights over four octaves, and loads of sum 0."""
    rng = np.random.default_rng(count)
    points = rng.random((count, 2)) * [1, stretch]
    points = points[cKDTree(points).indices]
    tail, head = Delaunay(points).simplices.ravel(), np.roll(Delaunay(points).simplices, -1, axis=1).ravel()
    load = rng.normal(size=count)
    return laplacian_from_weights(tail, head, 2 ** rng.uniform(-2, 2, len(tail)), count), load - load.mean()


@pytest.mark.parametrize("count", [4, 40, 1001, 5000])
def test_solutions_are_those_of_a_factorisation(count):
    A, b = graph(count)
    expected = np.concatenate([[0.0], solve_spd(A[1:, 1:], b[1:])])
    found = LaplacianSolver().solve(A, b + 3, np.ones(count), 1e-12)
    np.testing.assert_allclose(found, expected - expected.mean(), atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("stretch", [1.0, 0.01])
def test_iterations_do_not_grow_with_the_size(stretch):
    for count in (5000, 30_000):
        A, b = graph(count, stretch)
        with counted_work() as tally:
            LaplacianSolver().solve(A, b, np.ones(count), 1e-6)
        assert tally.cycles <= 45 and tally.factorisations == 1


def test_small_loads_are_met_as_well_as_large_ones():
    A, b = graph(3000)
    scale = 10 ** np.random.default_rng(2).uniform(-6, 0, 3000)
    b = b * scale
    b -= scale * b.sum() / scale.sum()
    left = b - A @ LaplacianSolver().solve(A, b, scale, 1e-3)
    assert np.abs(left / scale).max() <= 1.1e-3 * np.abs(b / scale).max()


def test_a_hierarchy_serves_until_it_is_slow():
    A, b = graph(5000)
    far, _ = graph(5000, 0.01)
    ones, laplacians = np.ones(5000), LaplacianSolver()
    with counted_work() as tally:
        for matrix in (A, 1.1 * A, far, far):
            x = laplacians.solve(matrix, b, ones, 1e-6)
            assert np.abs(b - matrix @ x).max() <= 1.1e-6 * np.abs(b).max()
    assert tally.factorisations == 2


def test_a_cycle_is_symmetric():
    A, b = graph(3000)
    other = np.random.default_rng(1).normal(size=len(b))
    other -= other.mean()
    cycle = Multigrid(A).cycle
    assert b @ cycle(other) == pytest.approx(other @ cycle(b), rel=1e-9)
    assert b @ cycle(b) > 0


def test_without_convergence_it_is_factored(monkeypatch):
    monkeypatch.setattr(multigrid, "MOST", 1)
    A, b = graph(3000)
    np.testing.assert_allclose(A @ LaplacianSolver().solve(A, b, np.ones(3000), 1e-12), b, atol=1e-9 * np.abs(b).max())
