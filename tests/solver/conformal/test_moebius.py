"""The plane, the sphere and its Moebius maps."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.conformal.moebius import boost, centre_on_sphere, to_plane, to_sphere


def test_planes_and_moebius_maps():
    rng = np.random.default_rng(0)
    z = rng.normal(size=50) + 1j * rng.normal(size=50)
    np.testing.assert_allclose(to_plane(to_sphere(z)), z, atol=1e-12)
    p = to_sphere(z)
    there = boost(p, np.array([0.3, -0.2, 0.5]))
    np.testing.assert_allclose(boost(there, -np.array([0.3, -0.2, 0.5])), p, atol=1e-13)
    mass = rng.random(50)
    np.testing.assert_allclose(mass @ centre_on_sphere(p, mass), 0, atol=1e-12)
