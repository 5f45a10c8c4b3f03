"""Measure how even the sites of a division are."""

from __future__ import annotations

import numpy as np

from .division import Division
from .polar_coordinates import WindowMesh, polar_coordinates
from .relaxation import sights

# Windows reach so many radii of a cell, to see all neighbours.
NEIGHBOURS = 3.0


def site_distances(mesh: WindowMesh, division: Division) -> np.ndarray:
    """Geodesic distance (k,) of every site of a division to the nearest other one; infinite without one in reach."""
    sites, n = division.sites, len(division.asked)
    area = np.bincount(division.pairs.site[division.cells.pair], _areas(mesh, division), n)
    pairs = polar_coordinates(mesh, sites, NEIGHBOURS * np.sqrt(area / np.pi), np.arange(n))
    i, _, _, distance = sights(mesh, sites, pairs)
    least = np.full(n, np.inf)
    np.minimum.at(least, i, distance)
    return least


def _areas(mesh: WindowMesh, division: Division) -> np.ndarray:
    """Areas (k,) of the pieces of a division, whatever the density."""
    face = division.pairs.face[division.cells.pair]
    return 2 * np.maximum(division.cells.polygons.moments()[0], 0) * mesh.areas[face]
