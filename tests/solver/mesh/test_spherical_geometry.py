"""Triangles on the sphere: they tile it, and orientation has a sign."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.spherical_geometry import (
    normalized,
    signed_volumes,
    spherical_areas,
    triangle_areas,
    triple_products,
)


def test_areas_tile_the_sphere():
    for mesh in (meshes.icosphere(0), meshes.icosphere(3)):
        V, F = mesh
        assert spherical_areas(V, F).sum() == pytest.approx(4 * np.pi, rel=1e-12)
        assert (spherical_areas(V, F) > 0).all() and (signed_volumes(V, F) > 0).all()
        np.testing.assert_allclose(spherical_areas(V, F[:, ::-1]), -spherical_areas(V, F), rtol=1e-12)


def test_an_octant_is_an_eighth():
    x, y, z = np.eye(3)[:, None]
    assert triangle_areas(x, y, z)[0] == pytest.approx(np.pi / 2)
    assert triple_products(x, y, z)[0] == 1 and triple_products(y, x, z)[0] == -1


def test_tiny_triangles_have_the_area_of_flat_ones():
    a = normalized(np.random.default_rng(0).normal(size=(100, 3)))
    u = normalized(np.cross(a, [0.3, 0.5, 0.8]))
    v = np.cross(a, u)
    area = triangle_areas(a, normalized(a + 1e-7 * u), normalized(a + 1e-7 * v))
    np.testing.assert_allclose(area, 0.5e-14, rtol=1e-6)


def test_directions():
    v = np.random.default_rng(0).normal(size=(50, 3))
    np.testing.assert_allclose(np.linalg.norm(normalized(v), axis=1), 1)
    np.testing.assert_allclose(normalized(1e9 * v), normalized(v), rtol=1e-12)
    assert not normalized(np.zeros((2, 3))).any()
