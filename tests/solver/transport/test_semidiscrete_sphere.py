"""Transport on the sphere: every cell has its mass, and the plane agrees."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from sphere_shapes import SHAPES, blob

from omt_uv.solver import errors
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.conformal import conformal_sphere
from omt_uv.solver.transport.semidiscrete_sphere import sphere_transport
from omt_uv.solver.transport.spherical_power_diagram import Hull, by_hull


def random_sites(seed=0):
    """162 unit vectors, well apart."""
    V, _ = meshes.icosphere(2)
    return normalized(V + 0.05 * np.random.default_rng(seed).normal(size=V.shape))


def plane_areas(sites, h, pole):
    """Areas of the cells by Green's theorem in the stereographic plane, that of the unbounded cell as what is left.

    A side is an arc of a circle there, and the density 4 / (1 + |z|^2)^2 the divergence of 2 z / (1 + |z|^2).
    """
    q = sites * np.exp(h)[:, None]
    hull = by_hull(sites, h)
    p = q[hull.triangles]
    normal = normalized(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    tail, head = halfedges(hull.triangles)
    start, end = normal[hull.twin // 3], np.repeat(normal, 3, axis=0)
    node, weight = np.polynomial.legendre.leggauss(24)
    t = (node + 1) / 2
    arc = np.arccos(np.clip((start * end).sum(1), -1, 1))[:, None]
    safe = np.maximum(np.sin(arc), 1e-300)
    x = (np.sin((1 - t) * arc) / safe)[..., None] * start[:, None] + (np.sin(t * arc) / safe)[..., None] * end[:, None]
    v = arc[..., None] * (
        -(np.cos((1 - t) * arc) / safe)[..., None] * start[:, None] + (np.cos(t * arc) / safe)[..., None] * end[:, None]
    )
    # From the pole (0, 0, 1): z = (x - i y) / (1 - z), and its derivative along the side.
    z = (x[..., 0] - 1j * x[..., 1]) / (1 - x[..., 2])
    dz = ((v[..., 0] - 1j * v[..., 1]) + z * v[..., 2]) / (1 - x[..., 2])
    flux = 2 * (z.conj() * dz).imag / (1 + np.abs(z) ** 2)
    area = np.bincount(tail, (flux @ weight) / 2, len(sites))
    assert area[pole] < 0
    area[pole] = 4 * np.pi - np.delete(area, pole).sum()
    return area


def test_the_plane_agrees():
    """Stereographic projection, spherical measure on the plane, one unbounded cell (Su 2015): the same areas."""
    V, F = blob(2)
    found = drain(conformal_sphere(V, F))
    carried = drain(sphere_transport(found.sites, vertex_areas(V, F)))
    cells = carried.cells
    # Turned so that one site is the pole, far inside its cell.
    k = 7
    turn = np.linalg.svd(found.sites[k][None])[2][[1, 2, 0]]
    turn[2] = found.sites[k]
    turn[0] *= np.sign(np.linalg.det(turn))
    np.testing.assert_allclose(plane_areas(found.sites @ turn.T, carried.site_weights, k), cells.area, atol=1e-7)


@pytest.mark.parametrize("name", SHAPES)
def test_transport(name):
    V, F = SHAPES[name]
    found = drain(conformal_sphere(V, F))
    mass = vertex_areas(V, F)
    hull = Hull(found.triangles, twins(found.triangles))
    carried = drain(sphere_transport(found.sites, mass, hull=hull))
    assert carried.residual <= 1e-6 and carried.iterations <= 25
    np.testing.assert_allclose(carried.cells.area, 4 * np.pi * mass / mass.sum(), rtol=1e-6)
    np.testing.assert_allclose(carried.cells.area.sum(), 4 * np.pi, rtol=1e-12)


def test_transport_refuses_masses_that_are_not_positive():
    with pytest.raises(errors.TransportError) as caught:
        drain(sphere_transport(random_sites(), np.r_[0.0, np.ones(161)]))
    assert caught.value.elements.tolist() == [0]


def test_transport_refuses_sites_that_coincide():
    sites = random_sites()
    sites[1] = sites[0]
    with pytest.raises(errors.TransportError):
        drain(sphere_transport(sites, np.ones(162)))
