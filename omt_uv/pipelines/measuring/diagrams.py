"""The power diagram by which a surface's areas are transported: of its largest chart in the plane, or on the sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...solver.canonical.named_maps import NamedProblem, polar_map
from ...solver.canonical.rectangles import rectangle_corners
from ...solver.conformal.disk_map import sharpest_corners
from ...solver.cutting.disk_charts import disk_charts
from ...solver.mesh.closed_surface import closed_surface
from ...solver.mesh.geometry import face_areas, vertex_areas
from ...solver.mesh.surface import Surface, chosen_triangles
from ...solver.mesh.topology import boundary_loops, twins
from ...solver.progress import Steps, part_of
from ...solver.sphere.conformal import conformal_sphere
from ...solver.transport.cell_polygons import CellPolygons, planar_cells, spherical_cell_polygons
from ...solver.transport.convex_domain import Disk, Rectangle
from ...solver.transport.semidiscrete_sphere import sphere_transport
from ...solver.transport.spherical_power_diagram import Hull


@dataclass(frozen=True)
class Diagram:
    """Cells of the vertices of a surface: polygons, the areas (n,) asked for, as shares of the domain, the largest
    relative error of one, Newton steps, and what is to be told of the map that the vertices come from."""

    cells: CellPolygons
    shares: np.ndarray
    residual: float
    iterations: int
    warnings: tuple[str, ...] = ()

    @property
    def points(self) -> np.ndarray:
        """Corners (k,3) in space; those of the plane at height 0."""
        flat = self.cells.points
        return flat if flat.shape[1] == 3 else np.column_stack([flat, np.zeros(len(flat))])

    def mesh(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Vertices (v,3), equal ones joined, and the polygon of every cell that has an area."""
        _, first, label = np.unique(self.points.round(9), axis=0, return_index=True, return_inverse=True)
        polygons = np.split(label.ravel(), self.cells.start[1:-1])
        return self.points[first], [p for p in polygons if len(p) > 2]

    def report(self) -> dict:
        """Figures for a report."""
        return {"cells": len(self.shares), "residual": self.residual, "iterations": self.iterations}


def diagram(surface: Surface, faces: np.ndarray | None, domain: str) -> Steps[Diagram]:
    """The diagram of the polygons `faces` (f,) bool of a surface in a domain of `settings.DOMAINS`, in lower case.

    Raises
    ------
    MeshError : a surface that has no such map
    """
    if domain == "sphere":
        return (yield from _of_sphere(surface, faces))
    charts = yield from part_of(disk_charts(surface, faces, fill_holes=False), 0.0, 0.2)
    chart = max(charts.charts, key=lambda c: len(c.triangles))
    vertices = chart.vertices - chart.vertices.mean(axis=0)
    loop = boundary_loops(chart.disk)[0]
    corners, area = None, face_areas(vertices, chart.disk)
    if domain != "disk":
        find = rectangle_corners if domain == "rectangle" else sharpest_corners
        corners = find(vertices, chart.disk, loop)
    problem = NamedProblem(vertices, chart.disk, area, domain, corners, 1.0 if domain == "square" else 0.0)
    found = yield from part_of(polar_map(problem), 0.2, 0.8)
    cells, sites = found.cells, found.sites
    assert cells is not None and sites is not None
    width, height = np.ptp(found.uv, axis=0)
    shape = Disk() if corners is None else Rectangle(float(width), float(height))
    told = tuple(dict.fromkeys((*charts.warnings, *found.warnings)))
    polygons = planar_cells(sites, cells.site_weights, shape)
    mass = vertex_areas(vertices, chart.disk)
    return Diagram(polygons, mass / mass.sum(), cells.residual, cells.iterations, told)


def _of_sphere(surface: Surface, faces: np.ndarray | None) -> Steps[Diagram]:
    _, corners, _ = chosen_triangles(surface, faces)
    used, local = np.unique(surface.corner_vertex[corners], return_inverse=True)
    closed = closed_surface(surface.positions[used], local.reshape(-1, 3))
    found = yield from part_of(conformal_sphere(closed.vertices, closed.triangles), 0.0, 0.4)
    mass = vertex_areas(closed.vertices, closed.triangles)
    hull = Hull(found.triangles, twins(found.triangles))
    moved = yield from part_of(sphere_transport(found.sites, mass, hull=hull), 0.4, 0.6)
    polygons = spherical_cell_polygons(found.sites, moved.site_weights, moved.cells.hull)
    return Diagram(polygons, mass / mass.sum(), moved.residual, moved.iterations, closed.warnings)
