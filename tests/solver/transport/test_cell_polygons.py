"""Cells as polygons have the areas of the cells, and fill the domain."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.mesh.spherical_geometry import triangle_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.cell_polygons import CellPolygons, planar_cells, spherical_cell_polygons
from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.power_diagram import power_diagram
from omt_uv.solver.transport.semidiscrete import transport
from omt_uv.solver.transport.spherical_power_diagram import by_hull, spherical_cells


@pytest.mark.parametrize("domain", [Disk(), Rectangle(), Rectangle(2.0, 0.5)], ids=["disk", "square", "strap"])
def test_polygons_of_the_plane_have_the_areas_of_the_cells(domain):
    rng = np.random.default_rng(5)
    sites = rng.uniform(-0.45, 0.45, (150, 2)) * [1, 0.5]
    weights = 0.002 * rng.random(150)
    polygons, cells = planar_cells(sites, weights, domain), power_diagram(sites, weights, domain)
    # Arcs are drawn as polygons of many sides.
    assert polygons.areas() == pytest.approx(cells.area, abs=2e-4 if isinstance(domain, Disk) else 1e-9)
    triangles, owner = polygons.fans()
    assert len(np.unique(owner)) == (cells.area > 1e-9).sum() and triangles.max() < len(polygons.points)


def test_transported_cells_have_their_masses():
    rng = np.random.default_rng(2)
    sites, mass = rng.uniform(-0.6, 0.6, (60, 2)), rng.uniform(0.5, 2, 60)
    found = drain(transport(sites, mass * np.pi / mass.sum(), Disk()))
    polygons = planar_cells(sites, found.site_weights, Disk())
    assert polygons.areas() / np.pi == pytest.approx(mass / mass.sum(), abs=1e-4)


def test_polygons_of_the_sphere_have_the_areas_of_the_cells():
    rng = np.random.default_rng(7)
    sites = rng.normal(size=(200, 3))
    sites /= np.linalg.norm(sites, axis=1)[:, None]
    weights = 1e-3 * rng.random(200)
    hull = by_hull(sites, weights)
    polygons = spherical_cell_polygons(sites, weights, hull)
    triangles, owner = polygons.fans()
    areas = np.bincount(owner, triangle_areas(*np.moveaxis(polygons.points[triangles], 1, 0)), 200)
    assert areas == pytest.approx(spherical_cells(sites, weights, hull).area, rel=1e-6)


@pytest.mark.parametrize("unit", [1e-5, 1e-3, 1e4])
def test_units_do_not_matter(unit):
    """Weights are squared lengths."""
    rng = np.random.default_rng(5)
    sites, weights = rng.uniform(-0.45, 0.45, (80, 2)), 0.002 * rng.random(80)
    plain = planar_cells(sites, weights, Rectangle(1.0, 1.0))
    found = planar_cells(unit * sites, unit**2 * weights, Rectangle(unit, unit))
    np.testing.assert_array_equal(found.start, plain.start)
    np.testing.assert_allclose(found.points / unit, plain.points, atol=1e-8)


def test_fans_of_cells_have_two_triangles_less_than_sides_and_none_is_flat():
    """Of cells without points, too."""
    start = np.array([0, 0, 3, 7, 7, 12])
    angle = np.concatenate([2 * np.pi * np.arange(n) / n for n in (3, 4, 5)])
    cells = CellPolygons(np.column_stack([np.cos(angle), np.sin(angle)]), start)
    triangles, owner = cells.fans()
    assert owner.tolist() == [1, 2, 2, 4, 4, 4] and (np.diff(np.sort(triangles, axis=1), axis=1) > 0).all()
    assert (cells.owner[triangles] == owner[:, None]).all()
    p = cells.points[triangles]
    u, v = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    np.testing.assert_allclose(np.bincount(owner, (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2, 5), cells.areas())
