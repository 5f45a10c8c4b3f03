"""The exact transport is one that nothing beats: its value is that of the dual, and below that of any assignment."""

import meshes
import numpy as np
from scipy.optimize import linear_sum_assignment

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures import reference
from omt_uv.solver.signatures.reference import exact_transport
from omt_uv.solver.signatures.signature import Signature, pair_costs


def test_the_primal_is_the_dual_and_both_are_least():
    V, F = meshes.icosphere(4)
    points = fibonacci_sphere(60)
    # Denser towards one side, and an atom is none.
    centre = V[F].mean(axis=1)
    mass = face_areas(V, F) * np.exp(1.5 * centre[:, 0])
    found = drain(exact_transport(V, F, mass, points))
    assert found.residual < 1e-4 and abs(found.square - found.bound) < 1e-4 * found.square
    # Samples of the mass, as many for each point: an assignment of these costs the same but for sampling.
    order = np.argsort(centre @ [0.3, 0.5, 0.8])
    share = np.cumsum(mass[order]) / mass.sum()
    rows = order[np.searchsorted(share, (np.arange(600) + 0.5) / 600)]
    at = centre[rows] / np.linalg.norm(centre[rows], axis=1, keepdims=True)
    every = np.repeat(points, 10, axis=0)
    cost = pair_costs(Signature(at, np.zeros(600)), Signature(every, np.zeros(600)))
    assigned = cost[linear_sum_assignment(cost)].mean()
    assert 0.9 * found.square < assigned < 1.15 * found.square


def test_even_masses_cost_what_the_spread_of_a_cell_is():
    """Of a hexagon of area a the mean squared distance from its middle is 5 a / (18 sqrt(3))."""
    V, F = meshes.icosphere(4)
    points = fibonacci_sphere(100)
    found = drain(exact_transport(V, F, face_areas(V, F), points))
    hexagon = 5 / (18 * np.sqrt(3)) * 4 * np.pi / 100
    assert 0.99 * hexagon < found.square < 1.05 * hexagon


def test_whatever_weights_it_ends_with_the_bound_is_below_the_best(monkeypatch):
    """What ends early has cells that are off, and its bound is all that can be relied on."""
    V, F = meshes.icosphere(3)
    points, mass = fibonacci_sphere(40), face_areas(V, F) * np.exp(2 * V[F].mean(axis=1)[:, 0])
    best = drain(exact_transport(V, F, mass, points))
    monkeypatch.setattr(reference, "TOLERANCE", 0.5)
    early = drain(exact_transport(V, F, mass, points))
    assert early.residual > 1e-2 and early.iterations < best.iterations
    assert 0.9 * best.square < early.bound < best.square and abs(early.bound - early.square) > 1e-3 * best.square
