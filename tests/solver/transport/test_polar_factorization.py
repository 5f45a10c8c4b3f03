"""Polar factorisation against its definition: phi = grad u o s, s preserves the measure, u is convex."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.disk_map import conformal_disk
from omt_uv.solver.errors import TransportError
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.polar_factorization import polar_factorisation

BALANCES = (0.0, 0.25, 0.5, 0.75, 1.0)


def disk_case():
    V, F = meshes.bumpy()
    return drain(conformal_disk(V, F)).uv, vertex_areas(V, F), Disk()


def square_case():
    V, F = meshes.random_disk()
    low, high = V[:, :2].min(0), V[:, :2].max(0)
    uv = ((V[:, :2] - low) / (high - low) - 0.5) * 0.999
    return uv, vertex_areas(V, F) * np.exp(V[:, 0]), Rectangle()


CASES = {"disk": disk_case, "square": square_case}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    return CASES[request.param]()


def test_first_factor_preserves_the_measure(case):
    sites, mass, domain = case
    polar = drain(polar_factorisation(sites, mass, domain))
    assert np.allclose(polar.area, mass * domain.area / mass.sum(), rtol=1e-6)
    assert polar.area.sum() == pytest.approx(domain.area)


def test_second_factor_is_the_gradient_of_a_convex_function(case):
    sites, mass, domain = case
    polar = drain(polar_factorisation(sites, mass, domain, 0.3))
    value, gradient = polar.potential(polar.uv)
    assert np.allclose(gradient, sites)  # phi = grad u o s
    # Convex: every tangent plane lies below the function, here at points all over the domain.
    x = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 2))
    above, _ = polar.potential(x)
    tangents = value + ((x[:, None] - polar.uv) * gradient).sum(2)
    assert (above[:, None] >= tangents - 1e-12).all()


def test_factors_are_monotone(case):
    sites, mass, domain = case
    polar = drain(polar_factorisation(sites, mass, domain))
    inner = ((polar.uv[:, None] - polar.uv) * (sites[:, None] - sites)).sum(2)
    assert inner.min() >= -1e-12


def test_no_exchange_is_cheaper(case):
    sites, mass, domain = case
    polar = drain(polar_factorisation(sites, mass, domain))
    rng = np.random.default_rng(0)
    cycles = np.stack([rng.permutation(len(sites))[:3] for _ in range(500)])
    own = ((polar.uv[cycles] - sites[cycles]) ** 2).sum((1, 2))
    turned = ((polar.uv[cycles] - sites[np.roll(cycles, 1, axis=1)]) ** 2).sum((1, 2))
    assert (own <= turned + 1e-12).all()


def test_balance_moves_from_equal_area_to_the_given_map(case):
    sites, mass, domain = case
    steps = [drain(polar_factorisation(sites, mass, domain, t)) for t in BALANCES]
    share = mass * domain.area / mass.sum()
    error = [np.abs(p.area - share).sum() for p in steps]
    moved = [np.sqrt((p.mass * ((p.uv - sites) ** 2).sum(1)).sum()) for p in steps]
    assert (np.diff(error) > 0).all()
    assert (np.diff(moved) < 0).all()
    assert error[0] < 1e-6 * domain.area
    assert steps[-1].iterations == 0
    assert np.abs(steps[-1].site_weights).max() == 0


def test_a_measure_preserving_map_is_its_own_first_factor(case):
    sites, mass, domain = case
    first = drain(polar_factorisation(sites, mass, domain))
    again = drain(polar_factorisation(first.uv, first.mass, domain))
    shift = np.sqrt((first.mass * ((again.uv - first.uv) ** 2).sum(1)).sum() / domain.area)
    before = np.sqrt((first.mass * ((first.uv - sites) ** 2).sum(1)).sum() / domain.area)
    assert shift < 0.2 * before


def test_bad_masses_are_named(case):
    sites, mass, domain = case
    with pytest.raises(TransportError, match="Transport needs positive, finite masses"):
        drain(polar_factorisation(sites, np.where(np.arange(len(mass)) == 3, -1.0, mass), domain))
    with pytest.raises(ValueError, match="balance"):
        drain(polar_factorisation(sites, mass, domain, -0.1))
