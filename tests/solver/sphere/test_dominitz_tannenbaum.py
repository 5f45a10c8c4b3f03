"""The flow of Dominitz and Tannenbaum: areas made right by Moser, kept while the cost falls."""

from __future__ import annotations

import numpy as np
from meshes import icosphere
from sphere_shapes import lopsided, random_sphere

from omt_uv.solver.mesh.spherical_geometry import spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.dominitz_tannenbaum import flow_map, reduce_cost
from omt_uv.solver.sphere.stream_functions import advect, bump_basis, bump_pairs


def test_the_descent_undoes_a_stir():
    """Of a map that is optimal but for a flow without divergence, most of the cost of that flow comes back."""
    P, F = icosphere(4)
    basis = bump_basis(24)
    stirred = advect(P, basis, bump_pairs(P, basis), 0.03 * np.random.default_rng(0).normal(size=24))
    weight = np.bincount(F.ravel(), np.repeat(spherical_areas(P, F) / 3, 3))
    found, costs = drain(reduce_cost(stirred, P, F, weight))
    assert (np.diff(costs) < 0).all()
    assert costs[-1] < 0.1 * costs[0]
    assert np.linalg.norm(found - P, axis=1).mean() < 0.35 * np.linalg.norm(stirred - P, axis=1).mean()
    drift = np.abs(spherical_areas(found, F) - spherical_areas(stirred, F)).sum() / (4 * np.pi)
    assert drift < 0.02


def test_the_whole_flow_gives_faces_their_masses():
    P, F = random_sphere(900)
    mass = lopsided(P, F, 3.0)
    found = drain(flow_map(P, F, mass))
    share = spherical_areas(found.positions, F) / (4 * np.pi)
    before = np.abs(spherical_areas(P, F) / (4 * np.pi) - mass / mass.sum()).sum()
    assert np.abs(share - mass / mass.sum()).sum() < 0.15 * before
    assert found.drift < 0.05 and (np.diff(found.costs) < 0).all()
    assert np.allclose(np.linalg.norm(found.positions, axis=1), 1)
