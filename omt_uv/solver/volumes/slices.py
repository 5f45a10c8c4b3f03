"""Cut a body by a plane, and colour the cut by how much its map dilates there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .shells import level_surface
from .tet_mesh import tet_volumes
from .transfer import TetLocation

# Shares of volumes in a map below this, over the mean, are taken for it, or for those in the body where these are less,
# and those in a body that are not positive: flat and inverted tetrahedra have no logarithm.
LEAST = 1e-3


@dataclass(frozen=True)
class Slice:
    """Vertices (n,3), triangles (m,3), and binary logarithms (m,) of volume in the map over volume in the body."""

    vertices: np.ndarray
    triangles: np.ndarray
    dilation: np.ndarray


def dilation(points: np.ndarray, positions: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Binary logarithm (m,) of the ratio of shares, there over here, of tetrahedra (m,4): 0 where a volume is right."""
    here, there = (x / x.sum() for x in (tet_volumes(points, tets), tet_volumes(positions, tets)))
    least = LEAST / len(tets)
    here = np.where(here > 0, here, least)
    return np.log2(np.maximum(there, np.minimum(here, least)) / here)


def plane_slice(
    points: np.ndarray, positions: np.ndarray, tets: np.ndarray, normal: np.ndarray, offset: float
) -> Slice:
    """The cut of tetrahedra (m,4) of points (n,3) by the plane normal.x = offset; positions (n,3): the map."""
    cut = level_surface(points, tets, points @ normal, offset)
    owner, _ = TetLocation(points, tets)(cut.vertices[cut.triangles].mean(axis=1))
    return Slice(cut.vertices, cut.triangles, dilation(points, positions, tets)[owner])
