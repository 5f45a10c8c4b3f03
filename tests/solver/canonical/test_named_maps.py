"""Maps by name: conformal ones have angles, polar factorisations have areas of cells, and lie in between."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.canonical.named_maps import NamedProblem, conformal_map, polar_map
from omt_uv.solver.conformal.disk_map import sharpest_corners
from omt_uv.solver.errors import BoundaryError, PinError
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.untangle import count_folds
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.chart_indices import ChartPins
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.convex_domain import Rectangle
from omt_uv.solver.transport.inverse_map import corner_parameters


def problem(boundary, aspect=0.0):
    V, F = meshes.bumpy(14, 14, 0.2)
    corners = None if boundary in ("free", "disk") else sharpest_corners(V, F, boundary_loops(F)[0])
    return NamedProblem(V, F, face_areas(V, F), boundary, corners, aspect)


def figures(disk, uv):
    return distortion(disk.vertices, disk.triangles, uv[disk.triangles])


@pytest.mark.parametrize("boundary", ["free", "disk", "rectangle"])
def test_conformal_maps_have_angles_and_no_areas(boundary):
    disk = problem(boundary)
    found = drain(conformal_map(disk))
    measured = figures(disk, found.uv)
    assert measured.angle_mean < 1.2 and measured.folds == 0
    assert boundary == "free" or measured.area_l1 > 0.1


def test_polar_factorisations_lie_between_exact_cells_and_the_conformal_map():
    disk = problem("disk")
    maps = [drain(polar_map(disk, balance)) for balance in (0.0, 0.5, 1.0)]
    shear = [figures(disk, m.uv).angle_mean for m in maps]
    error = [figures(disk, m.uv).area_l1 for m in maps]
    assert shear[0] > shear[1] > shear[2] and error[0] < error[1] < error[2]
    assert all(count_folds(m.uv, disk.triangles) == 0 for m in maps)
    mass = np.bincount(disk.triangles.ravel(), np.repeat(disk.target / 3, 3))
    assert maps[0].cells.cells.area / np.pi == pytest.approx(mass / mass.sum(), rel=1e-5)
    conformal = drain(conformal_map(disk))
    inner = np.setdiff1d(np.arange(len(mass)), disk.loop)
    assert np.linalg.norm(maps[2].uv - conformal.uv, axis=1)[inner].max() < 0.05


def test_a_polar_factorisation_fills_a_rectangle_and_needs_a_convex_domain():
    disk = problem("rectangle", 0.5)
    found = drain(polar_map(disk))
    assert np.divide(*np.ptp(found.uv, axis=0)[::-1]) == pytest.approx(0.5, abs=1e-6)
    with pytest.raises(BoundaryError, match="A polar factorisation needs a convex domain"):
        drain(polar_map(problem("free")))


@pytest.mark.parametrize("aspect", [0.25, 1.7])
def test_areas_are_kept_in_rectangles_of_a_given_aspect(aspect):
    (chart,) = strict_charts(triangle_surface(*meshes.bumpy(14, 14)))
    found = drain(map_chart(chart, options=MapOptions(boundary="rectangle", aspect=aspect)))
    width, height = np.ptp(found.uv, axis=0)
    assert height / width == pytest.approx(aspect, rel=1e-6)
    assert width * height == pytest.approx(face_areas(chart.vertices, chart.triangles).sum(), rel=1e-6)
    assert found.area_l1 < 0.01 and found.folds == 0


@pytest.mark.parametrize("length", [3, 20])
def test_a_flat_strap_stays_what_it_is(length):
    (chart,) = strict_charts(triangle_surface(*meshes.grid(4 * length, 4, length, 1.0)))
    found = drain(map_chart(chart, options=MapOptions(boundary="rectangle")))
    assert sorted(np.ptp(found.uv, axis=0)) == pytest.approx([1, length], rel=1e-3) and found.angle_mean < 1.001


def test_pins_are_kept_by_area_preserving_maps_alone():
    (chart,) = strict_charts(triangle_surface(*meshes.bumpy(5, 5)))
    pins = ChartPins(np.array([0]), np.zeros((1, 2)), np.zeros((len(chart.triangles), 3, 2)))
    with pytest.raises(PinError, match="Pins are kept by area preserving maps alone"):
        drain(map_chart(chart, options=MapOptions(kind="conformal"), pins=pins))


def test_corners_of_a_rectangle_lie_along_its_boundary():
    domain = Rectangle(2.0, 1.0)
    assert corner_parameters(domain) == pytest.approx([0, 2, 3, 5, 6])
    assert domain.boundary_point(corner_parameters(domain)[:4]) == pytest.approx(domain.corners)


def finger(rings, sectors=10):
    """A closed tube of as many rings as are long, open at one end: a point of it is far from the boundary."""
    angle, step = 2 * np.pi * np.arange(sectors) / sectors, 2 * np.sin(np.pi / sectors)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    V = np.concatenate([ring + [0, 0, k * step] for k in range(rings)] + [[[0, 0, (rings - 0.5) * step]]])
    k, i = (x.ravel() for x in np.meshgrid(np.arange(rings - 1), np.arange(sectors), indexing="ij"))
    a, b = k * sectors + i, k * sectors + (i + 1) % sectors
    top = (rings - 1) * sectors + np.arange(sectors)
    caps = np.column_stack([top, np.roll(top, -1), np.full(sectors, len(V) - 1)])
    quads = [np.stack([a, b, b + sectors], 1), np.stack([a, b + sectors, a + sectors], 1)]
    return V, np.concatenate([*quads, caps])


@pytest.mark.parametrize("boundary", ["disk", "square", "rectangle"])
@pytest.mark.parametrize(("rings", "balance"), [(30, 0.0), (30, 0.5), (38, 0.0)])
def test_what_a_conformal_map_puts_in_one_place_has_its_cells_all_the_same(boundary, rings, balance):
    """The hand of a model was refused, as its vertices were 8.5e-8 apart in the disk: cells are of another map then."""
    V, F = finger(rings)
    loop = boundary_loops(F)[0]
    corners = None if boundary == "disk" else sharpest_corners(V, F, loop)
    disk = NamedProblem(V, F, face_areas(V, F), boundary, corners, 1.0 if boundary == "square" else 0.0)
    found = drain(polar_map(disk, balance))
    assert sum("apart, too close for the transport; started from a mean value map" in x for x in found.warnings) == 1
    mass = vertex_areas(V, F)
    np.testing.assert_allclose(found.cells.cells.area, mass * found.cells.cells.area.sum() / mass.sum(), rtol=1e-5)
    assert figures(disk, found.uv).folds == 0
