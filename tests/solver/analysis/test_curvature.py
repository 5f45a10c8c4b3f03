"""Curvature by its integrals: Gauss-Bonnet, spheres, cubes."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.curvature import gaussian_curvature, mean_curvature, sharpness
from omt_uv.solver.mesh.topology import on_boundary


def test_gauss_bonnet():
    for (V, F), total in ((meshes.icosphere(2), 4 * np.pi), (meshes.torus(), 0.0)):
        assert gaussian_curvature(V, F).sum() == pytest.approx(total, abs=1e-9)
    V, F = meshes.bumpy()
    boundary = on_boundary(F, len(V))
    assert boundary.sum() == 4 * 16 and not gaussian_curvature(V, F)[boundary].any()


def test_mean_curvature_of_a_sphere():
    """H = 1 / R, outward positive: the integral is 4 pi R."""
    V, F = meshes.icosphere(3)
    assert mean_curvature(3 * V + 50, F).sum() == pytest.approx(4 * np.pi * 3, rel=0.01)
    assert not mean_curvature(*meshes.grid()).any()
    V, F = meshes.bumpy()
    boundary = on_boundary(F, len(V))
    assert not mean_curvature(V, F)[boundary].any() and mean_curvature(V, F)[~boundary].any()


def test_sharpness_of_a_cube():
    V, F = meshes.cube()
    np.testing.assert_allclose(sharpness(V, F), np.pi / 2)
    np.testing.assert_allclose(sharpness(*meshes.grid()), 0, atol=1e-9)


@pytest.mark.parametrize("measure", [gaussian_curvature, mean_curvature, sharpness])
def test_a_surface_far_from_the_origin_has_the_curvature_that_it_has_there(measure):
    """As long as its coordinates have room for it: these are whole numbers of a small unit."""
    V, F = meshes.icosphere(2)
    V = np.round(V * 2**20) / 2**20
    np.testing.assert_allclose(measure(V + [2.0**22, -(2.0**21), 2.0**20], F), measure(V, F), rtol=1e-12, atol=1e-13)
