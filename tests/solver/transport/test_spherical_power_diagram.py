"""Power diagrams on the sphere: cells that tile it, and the derivatives of their areas."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.transport.spherical_power_diagram import by_flips, by_hull, spherical_cells


def random_sites(seed=0):
    """162 unit vectors, well apart."""
    V, _ = meshes.icosphere(2)
    return normalized(V + 0.05 * np.random.default_rng(seed).normal(size=V.shape))


def test_cells_tile_the_sphere_whatever_the_weights():
    sites = random_sites()
    h = 2e-3 * np.random.default_rng(1).normal(size=162)
    cells = spherical_cells(sites, h, by_hull(sites, h))
    np.testing.assert_allclose(cells.area.sum(), 4 * np.pi, rtol=1e-13)
    np.testing.assert_allclose(cells.moment.sum(axis=0), 0, atol=1e-12)
    # Sampling: a point belongs to the site whose plane is farthest out.
    points = normalized(np.random.default_rng(2).normal(size=(100_000, 3)))
    share = np.bincount((points @ (sites * np.exp(h)[:, None]).T).argmax(axis=1), minlength=162) / 100_000
    np.testing.assert_allclose(share, cells.area / (4 * np.pi), atol=2e-3)


def test_derivative_of_the_areas():
    sites, rng = random_sites(), np.random.default_rng(3)
    h, d = 2e-3 * rng.normal(size=162), rng.normal(size=162)
    cells = spherical_cells(sites, h, by_hull(sites, h))
    i, j = cells.edges.T
    slope = np.zeros(162)
    np.add.at(slope, i, cells.conductance * (d[i] - d[j]))
    np.add.at(slope, j, cells.conductance * (d[j] - d[i]))
    step = 1e-6
    before, after = (spherical_cells(sites, h + s * d, by_hull(sites, h + s * d)).area for s in (-step, step))
    np.testing.assert_allclose((after - before) / (2 * step), slope, atol=1e-5)


def test_flips_reach_the_hull():
    sites, rng = random_sites(), np.random.default_rng(4)
    hull = by_hull(sites, np.zeros(162))
    h = 2e-3 * rng.normal(size=162)
    flipped, hidden = by_flips(hull, sites, h)
    assert flipped is not None and not hidden
    a, b = (spherical_cells(sites, h, x).area for x in (flipped, by_hull(sites, h)))
    np.testing.assert_allclose(a, b, atol=1e-13)
