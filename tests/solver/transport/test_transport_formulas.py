"""Steps and masses of transports by their formulas, pair by pair, in any unit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.progress import drain
from omt_uv.solver.transport import semidiscrete, semidiscrete_sphere
from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.damped_newton import MAX_HALVINGS
from omt_uv.solver.transport.polar_factorization import polar_factorisation
from omt_uv.solver.transport.power_diagram import power_diagram


def pairs_of(n, count, seed):
    rng = np.random.default_rng(seed)
    edges = np.array([rng.choice(n, 2, replace=False) for _ in range(count)])
    return rng, edges


@pytest.mark.parametrize("size", [1e-12, 1e-3, 0.3, 7.0, 1e5, 1e14])
@pytest.mark.parametrize("seed", range(3))
def test_the_first_step_in_the_plane_is_the_greatest_half_of_a_half_within_reach(seed, size):
    rng, edges = pairs_of(12, 20, seed)
    sites, direction = rng.normal(size=(12, 2)), size * rng.normal(size=12)
    dual = SimpleNamespace(sites=sites)
    found = semidiscrete.PlanarDual.first_step(dual, SimpleNamespace(edges=edges), direction)
    reach = min(np.sum((sites[i] - sites[j]) ** 2) / abs(direction[i] - direction[j]) for i, j in edges)
    halves = [0.5**k for k in range(MAX_HALVINGS + 1)]
    assert found == next((h for h in halves if h <= 256.0 * reach), halves[-1])


@pytest.mark.parametrize("size", [1e-9, 0.3, 7.0, 1e5])
@pytest.mark.parametrize("seed", range(3))
def test_the_first_step_on_the_sphere_is_as_far_as_a_step_may_grow(seed, size):
    rng, edges = pairs_of(12, 20, seed)
    sites, direction = normalized(rng.normal(size=(12, 3))), size * rng.normal(size=12)
    dual = semidiscrete_sphere.SphereDual(sites)
    found = dual.first_step(SimpleNamespace(edges=edges), direction)
    reach = min(np.sum((sites[i] - sites[j]) ** 2) / 2 / abs(direction[i] - direction[j]) for i, j in edges)
    assert found == pytest.approx(min(1.0, dual.growth * reach), rel=1e-12)
    # Nobody moves against anybody: a whole step.
    assert dual.first_step(SimpleNamespace(edges=edges), np.full(12, 3.0)) == 1.0


@pytest.mark.parametrize("unit", [1e-6, 1.0, 50.0])
@pytest.mark.parametrize("balance", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("domain", [Disk(), Rectangle(), Rectangle(3.0)], ids=["disk", "square", "rectangle"])
def test_masses_are_mixed_as_shares_of_the_domain(domain, balance, unit):
    rng = np.random.default_rng(0)
    sites, mass = 0.4 * rng.uniform(-1, 1, (30, 2)), rng.uniform(0.5, 2, 30)
    own = power_diagram(sites, np.zeros(30), domain).area
    polar = drain(polar_factorisation(sites, unit * mass, domain, balance))
    expected = (1 - balance) * mass / mass.sum() * domain.area + balance * own
    np.testing.assert_allclose(polar.mass, expected, rtol=1e-9)
    np.testing.assert_allclose(polar.area, expected, rtol=1e-6)


def test_hull_edges_of_directions_cancel():
    """A weight that all sites have in common moves no cell."""
    rng = np.random.default_rng(3)
    sites = 0.4 * rng.uniform(-1, 1, (20, 2))
    before = power_diagram(sites, np.zeros(20), Disk()).area
    np.testing.assert_allclose(power_diagram(sites, np.full(20, 0.7), Disk()).area, before, rtol=1e-9)
    assert before.sum() == pytest.approx(Disk().area)
