"""Gaussian means by heat: they keep amounts and constants, and are those of a matrix exponential."""

import meshes
import numpy as np
import pytest
from scipy.linalg import expm

from omt_uv.solver.analysis.heat_means import HeatMeans
from omt_uv.solver.mesh.geometry import cotangent_laplacian, vertex_areas

SIGMAS = np.array([0.1, 0.2, 0.4])


@pytest.mark.parametrize("mesh", [meshes.icosphere(2), meshes.bumpy(), meshes.torus(24, 12)])
def test_amounts_and_constants_are_kept(mesh):
    V, F = mesh
    heat, area = HeatMeans(V, F, 0.2), vertex_areas(V, F)
    amount = np.random.default_rng(0).random(len(V)) * area
    np.testing.assert_allclose(heat.means(amount, SIGMAS) @ area, amount.sum(), rtol=1e-9)
    np.testing.assert_allclose(heat.means(3 * area, SIGMAS), 3, rtol=1e-9)
    assert not heat.means(0 * area, SIGMAS).any()


def test_means_are_those_of_the_matrix_exponential():
    """On a sphere without obtuse angles the stiffness is that of the cotangent Laplacian."""
    V, F = meshes.icosphere(2)
    area = vertex_areas(V, F)
    amount = np.random.default_rng(0).random(len(V)) * area
    found = HeatMeans(V, F, 0.2).means(amount, SIGMAS)
    generator = cotangent_laplacian(V, F).toarray() / area[:, None]
    for mean, sigma in zip(found, SIGMAS, strict=True):
        expected = expm(-(sigma**2) / 2 * generator) @ (amount / area)
        np.testing.assert_allclose(mean, expected, atol=1e-4 * np.ptp(amount / area))


def test_means_grow_flatter_with_sigma():
    V, F = meshes.bumpy()
    found = HeatMeans(V, F, 0.2).means(np.where(np.arange(len(V)) == 150, 1.0, 0.0), SIGMAS)
    assert (np.diff(found.max(axis=1)) < 0).all()


def test_means_do_not_depend_on_scale():
    V, F = meshes.bumpy()
    values = np.random.default_rng(0).random(len(V))
    small = HeatMeans(V, F, 0.2).means(values * vertex_areas(V, F), SIGMAS)
    large = HeatMeans(1e4 * V, F, 2e3).means(values * vertex_areas(1e4 * V, F), 1e4 * SIGMAS)
    np.testing.assert_allclose(large, small, rtol=1e-8)


@pytest.mark.parametrize("mesh", [meshes.single_triangle, meshes.quad_patch, meshes.cube, meshes.icosphere])
def test_what_is_even_stays_even_and_the_whole_amount_is_kept_on_the_smallest_meshes_too(mesh):
    """There the space of all functions is complete before it has its most dimensions."""
    V, F = mesh()
    area = vertex_areas(V, F)
    np.testing.assert_allclose(HeatMeans(V, F, 0.3).means(3 * area, SIGMAS), 3.0, rtol=1e-8)
    amount = np.where(np.arange(len(V)) == 1, 2.0, 0.0)
    np.testing.assert_allclose(HeatMeans(V, F, 0.3).means(amount, SIGMAS) @ area, 2.0, rtol=1e-4)


@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_vertices_of_no_area_are_left_alone_in_any_unit(size):
    V, F = meshes.bumpy(6, 6)
    V = np.vstack([V, [[0.5, 0.5, 3.0]]])
    amount = np.random.default_rng(0).random(len(V)) * vertex_areas(V, F)
    plain = HeatMeans(V, F, 0.2).means(amount, SIGMAS)
    found = HeatMeans(size * V, F, size * 0.2).means(size**2 * amount, size * SIGMAS)
    np.testing.assert_allclose(found, plain, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(plain[:, :-1], HeatMeans(V[:-1], F, 0.2).means(amount[:-1], SIGMAS), rtol=1e-6)


@pytest.mark.parametrize("stretch", [1.0, 6.0, 30.0])
def test_means_of_what_is_nowhere_negative_are_so_too_whatever_the_angles(stretch):
    """And nowhere more than the most: heat flows from hot to cold across obtuse triangles as well."""
    V, F = meshes.random_disk(150)
    V = V * [stretch, 1, 1]
    area = vertex_areas(V, F)
    for k in (3, 40, 90):
        density = np.where(np.arange(len(V)) == k, 1.0, 0.0)
        found = HeatMeans(V, F, 0.2).means(density * area, SIGMAS)
        assert found.min() > -2e-3 and found.max() < 1 + 2e-3
