"""Divide a surface into cells of equal area, or of equal painted density; the one path of operator and command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...settings import MOST_MATERIALS, PartitionSettings
from ...solver.errors import CountError, first_of, plural, two_digits
from ...solver.mesh.geometry import face_areas, face_normals
from ...solver.mesh.surface import Surface, chosen_triangles
from ...solver.mesh.topology import pair_keys, pair_up
from ...solver.partition.cut_mesh import CellMesh, cut_along_cells, polygon_edges
from ...solver.partition.division import Division, DivisionOptions, divide
from ...solver.partition.face_labels import FaceCells, follow_faces
from ...solver.partition.polar_coordinates import WindowMesh
from ...solver.partition.spacing import site_distances
from ...solver.progress import Steps, part_of

# Density where nothing is painted, next to where the weight is 1: no place is without a cell.
LEAST_DENSITY = 1e-3
# Share of the work that dividing takes.
DIVIDING = 0.95


@dataclass(frozen=True)
class SitePoints:
    """Sites as points: positions (k,3), normals (k,3), areas (k,) of their cells as masses, radii (k,) of disks as
    large as the cells."""

    positions: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    radii: np.ndarray


@dataclass(frozen=True)
class Partition:
    """A surface divided.

    cell (f,): of every polygon, -1 outside; borders (k,2): edges between polygons of different cells; mesh: cut along
    the cells, None unless asked for; points; figures for a report; warnings
    """

    cell: np.ndarray
    borders: np.ndarray
    mesh: CellMesh | None
    points: SitePoints
    figures: dict
    warnings: tuple[str, ...]


def partition_surface(
    surface: Surface, faces: np.ndarray | None, weights: np.ndarray | None, settings: PartitionSettings
) -> Steps[Partition]:
    """Divide the polygons (f,) bool of a surface into cells of the same area, or the same integral of weights (n,).

    Raises
    ------
    MeshError : nothing to divide, or fewer cells than parts
    """
    if settings.write == "materials" and settings.cells > MOST_MATERIALS:
        raise CountError(
            f"{settings.cells} material slots are more than {MOST_MATERIALS}",
            "Ask for fewer cells, or write an attribute",
        )
    _, corners, owner = chosen_triangles(surface, faces)
    triangles = surface.corner_vertex[corners]
    density = None if weights is None else _density(weights, triangles)
    options = DivisionOptions(relax=settings.relax, seed=settings.seed)
    dividing = divide(surface.positions, triangles, settings.cells, density, options)
    division = yield from part_of(dividing, 0.0, DIVIDING)
    mesh = cut_along_cells(surface.positions, triangles, division)
    polygons = _polygons(surface, np.unique(owner))
    whole = follow_faces(division, np.searchsorted(np.unique(owner), owner), *polygons)
    cell = np.full(len(surface.face_start) - 1, -1)
    cell[np.unique(owner)] = whole.cell
    torn = mesh.torn()
    points = _points(surface.positions, triangles, division, density)
    figures = _figures(division, whole, torn, surface.positions, triangles)
    return Partition(
        cell=cell,
        borders=_borders(surface, cell),
        mesh=mesh if settings.write == "mesh" else None,
        points=points,
        figures=figures,
        warnings=_warnings(division, whole, torn, settings),
    )


def _density(weights: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Density (m,) of triangles (m,3), the mean weight (n,) of their corners."""
    return np.maximum(np.clip(weights, 0, None)[triangles].mean(axis=1), LEAST_DENSITY * max(weights.max(), 1e-30))


def _polygons(surface: Surface, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of the corners (c,) of chosen polygons, and where each begins (k+1,)."""
    size = np.diff(surface.face_start)[chosen]
    start = np.r_[0, np.cumsum(size)]
    place = np.arange(start[-1]) - np.repeat(start[:-1], size) + np.repeat(surface.face_start[chosen], size)
    return surface.corner_vertex[place], start


def _borders(surface: Surface, cell: np.ndarray) -> np.ndarray:
    """Edges (k,2) between polygons of different cells (f,); those to polygons outside are none."""
    a, b, polygon = polygon_edges(surface.corner_vertex, surface.face_start)
    first, second = pair_up(pair_keys(a, b))
    one, other = cell[polygon[first]], cell[polygon[second]]
    rows = first[(one != other) & (one >= 0) & (other >= 0)]
    return np.stack([a[rows], b[rows]], axis=1)


def _points(positions: np.ndarray, triangles: np.ndarray, division: Division, density: np.ndarray | None) -> SitePoints:
    here = division.sites.triangle
    areas = division.cells.area
    local = areas if density is None else areas / density[here]
    return SitePoints(
        positions=division.sites.positions(positions, triangles),
        normals=face_normals(positions, triangles)[here],
        areas=areas,
        radii=np.sqrt(local / np.pi),
    )


def _figures(
    division: Division, whole: FaceCells, torn: np.ndarray, positions: np.ndarray, triangles: np.ndarray
) -> dict:
    """Figures for a report."""
    nearest = site_distances(WindowMesh(positions, triangles), division)
    near = nearest[np.isfinite(nearest)]
    return {
        "cells": len(division.asked),
        "area": float(face_areas(positions, triangles).sum()),
        "error": division.residual,
        "error_of_faces": float(np.abs(whole.mass / division.asked - 1).max()),
        "newton_steps": division.iterations,
        "all_newton_steps": division.steps,
        "unequal_parts": division.unequal,
        "torn": torn.tolist(),
        "empty": whole.empty.tolist(),
        "least_distance": float(near.min() / near.mean()) if len(near) else 1.0,
    }


def _warnings(division: Division, whole: FaceCells, torn: np.ndarray, settings: PartitionSettings) -> tuple[str, ...]:
    told = []
    if division.unequal > division.residual + 1e-6:
        told.append(
            "Every separate part has whole cells, so that cells of different parts differ by up to "
            + two_digits(division.unequal)
        )
    if settings.write == "mesh":
        if len(torn):
            told.append(f"{_cells(torn)} in several pieces")
        return tuple(told)
    if settings.write == "points":
        return tuple(told)
    if len(whole.empty):
        told.append(
            f"{_cells(whole.empty)} without a face, being smaller than one; cut the mesh, or ask for fewer cells"
        )
    if len(whole.torn):
        told.append(f"{_cells(whole.torn)} in several pieces")
    return tuple(told)


def _cells(numbers: np.ndarray) -> str:
    """Some cells in words, with a verb."""
    count = len(numbers)
    return f"{plural(count, '1 cell', '{} cells')} ({first_of(numbers)}) {'is' if count == 1 else 'are'}"
