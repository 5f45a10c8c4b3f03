"""What a Subdivision Surface modifier makes of a surface and of its UVs, as matrices."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..counts import MOST_LEVELS
from ..mesh.surface import Surface
from ..mesh.topology import next_corners
from .catmull_clark import SHARP, Cage, Subdivision, bilinear, straight_boundary, straight_corners, subdivide
from .quad_areas import quad_areas

SMOOTH_UV = "SMOOTH_ALL"
LINEAR_UV = "NONE"
STRAIGHT_UV = "PRESERVE_BOUNDARIES"


@dataclass(frozen=True)
class SubdivisionModifier:
    """What a Subdivision Surface modifier does to a mesh.

    levels : how often; uv_smooth : an identifier of Blender's; keep_corners : corners of an open boundary stay;
    simple : no smoothing; limit : vertices lie on the limit surface; ends (k,2), sharpness (k,) and corner_sharpness
    (n,): creased edges and vertices
    """

    levels: int
    uv_smooth: str = STRAIGHT_UV
    keep_corners: bool = False
    simple: bool = False
    limit: bool = True
    ends: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    sharpness: np.ndarray = field(default_factory=lambda: np.zeros(0))
    corner_sharpness: np.ndarray | None = None


@dataclass(frozen=True)
class SubdividedSurface:
    """Corners (q,4,3) in space of the quads of a subdivided surface, its vertices' matrix, and the level it is of."""

    corners: np.ndarray
    subdivision: Subdivision
    levels: int

    def polygon_areas(self, count: int) -> np.ndarray:
        """Areas (f,) of the polygons of the cage on the subdivided surface."""
        return np.bincount(self.subdivision.polygon, quad_areas(self.corners), count)


def subdivided_surface(surface: Surface, modifier: SubdivisionModifier, most: int) -> SubdividedSurface:
    """The subdivided surface at the level of the modifier, or at a lower one with at most so many quads."""
    quads = 4.0 ** np.arange(min(modifier.levels, MOST_LEVELS)) * len(surface.corner_vertex)
    levels = max(1, int((quads <= most).sum()))
    cage = Cage(
        corner_vertex=surface.corner_vertex,
        face_start=surface.face_start,
        count=len(surface.positions),
        ends=modifier.ends,
        sharpness=modifier.sharpness,
        corner_sharpness=_corner_sharpness(np.arange(len(surface.positions)), modifier),
    )
    if modifier.simple:
        found = bilinear(cage, levels)
    else:
        found = subdivide(straight_corners(cage) if modifier.keep_corners else cage, levels, modifier.limit)
    return SubdividedSurface((found.matrix @ surface.positions)[found.quads], found, levels)


def subdivided_uv(
    vertex: np.ndarray, face_start: np.ndarray, ids: np.ndarray, modifier: SubdivisionModifier, levels: int
) -> Subdivision:
    """How the modifier subdivides UVs whose vertex at each corner (c,) of polygons (f+1,) is given.

    ids (n,): vertices of the surface that the UVs' are at. Creases count as they do for the surface.
    """
    ends, sharpness = _creases(vertex, face_start, ids, modifier)
    cage = Cage(vertex, face_start, len(ids), ends, sharpness, _corner_sharpness(ids, modifier))
    smooth = modifier.uv_smooth
    if modifier.simple or smooth == LINEAR_UV:
        return bilinear(cage, levels)
    if smooth == STRAIGHT_UV:
        cage = straight_boundary(cage)
    elif smooth != SMOOTH_UV:
        cage = straight_corners(cage)
        if smooth != "PRESERVE_CORNERS":
            # Where three and more islands meet.
            several = np.bincount(ids + 1)[ids + 1] > 2
            cage = replace(cage, corner_sharpness=np.where(several, SHARP, cage.corner_sharpness))
    return subdivide(cage, levels, modifier.limit)


def _corner_sharpness(ids: np.ndarray, modifier: SubdivisionModifier) -> np.ndarray:
    """Sharpness (k,) of vertices (k,) of the surface; 0 of those that are none of its own, -1."""
    given = modifier.corner_sharpness
    return np.zeros(len(ids)) if given is None else np.where(ids >= 0, given[ids], 0.0)


def _creases(
    vertex: np.ndarray, face_start: np.ndarray, ids: np.ndarray, modifier: SubdivisionModifier
) -> tuple[np.ndarray, np.ndarray]:
    """Creased edges (k,2) between the vertices of UVs, and their sharpness (k,), as between the surface's vertices."""
    if not len(modifier.ends):
        return modifier.ends, modifier.sharpness
    n = int(max(ids.max(initial=0), modifier.ends.max())) + 1
    ends = np.column_stack([vertex, vertex[next_corners(face_start)]])
    low, high = np.sort(ids[ends], axis=1).T
    creased = modifier.ends.min(axis=1) * n + modifier.ends.max(axis=1)
    order = np.argsort(creased)
    at = np.minimum(np.searchsorted(creased[order], low * n + high), len(order) - 1)
    known = creased[order][at] == low * n + high
    return ends[known], modifier.sharpness[order][at][known]
