"""Transport on the sphere: exact areas, and what they do not depend on."""

import numpy as np
import pytest

from omt_uv.solver.errors import TransportError
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.semidiscrete_sphere import sphere_transport
from omt_uv.solver.transport.spherical_power_diagram import by_hull


@pytest.fixture
def sites():
    points = np.random.default_rng(0).normal(size=(120, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


@pytest.fixture
def mass():
    return 0.5 + np.random.default_rng(1).random(120)


def test_every_cell_has_its_mass(sites, mass):
    found = drain(sphere_transport(sites, mass))
    share = found.cells.area / (4 * np.pi)
    np.testing.assert_allclose(share, mass / mass.sum(), rtol=5e-7)
    assert found.residual <= 5e-7 and found.diagrams > found.iterations > 0


def test_equal_cells_need_no_step():
    found = drain(sphere_transport(np.vstack([np.eye(3), -np.eye(3)]), np.full(6, 7.0)))
    assert found.iterations == 0 and not found.site_weights.any()


def test_the_unit_of_mass_a_turn_and_the_order_change_nothing(sites, mass):
    plain = drain(sphere_transport(sites, mass)).site_weights
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    order = np.random.default_rng(3).permutation(120)
    np.testing.assert_allclose(drain(sphere_transport(sites, 9 * mass)).site_weights, plain, atol=1e-9)
    np.testing.assert_allclose(drain(sphere_transport(sites @ turn.T, mass)).site_weights, plain, atol=1e-7)
    shuffled = drain(sphere_transport(sites[order], mass[order])).site_weights
    np.testing.assert_allclose(shuffled, plain[order], atol=1e-7)


def test_a_known_hull_is_a_start(sites, mass):
    known = drain(sphere_transport(sites, mass, hull=by_hull(sites, np.zeros(120))))
    np.testing.assert_allclose(known.site_weights, drain(sphere_transport(sites, mass)).site_weights, atol=1e-9)


def test_no_convergence_is_said(sites, mass):
    with pytest.raises(TransportError, match="did not converge in 1 steps"):
        drain(sphere_transport(sites, mass, max_steps=1))
