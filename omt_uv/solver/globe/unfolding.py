"""Lay a map to the sphere out in the plane, no face torn, by placing every corner on a copy of the unit square.

A corner lies on the copy on which its face hangs together: a face that crosses the seam of a cylinder goes on past u =
1, one that crosses a side of the octahedral square goes on beyond that side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.geometry import cross3
from .pole_vertices import move_vertices_onto, singular_points
from .projections import OCTAHEDRAL, check_projection, octahedral_to_plane, to_plane

# Of the width of the square: a corner this far left of the seam, by rounding, still counts as on it.
SEAM_SLACK = 1e-6


@dataclass(frozen=True)
class Polygons:
    """The faces of one closed component, by their corners.

    vertex (c,) of every corner; polygon (c,) ascending from 0, the face it belongs to; triangles (m,3) of corners.
    """

    vertex: np.ndarray
    polygon: np.ndarray
    triangles: np.ndarray

    @property
    def vertex_triangles(self) -> np.ndarray:
        """The triangles by vertices instead of corners, (m,3)."""
        return self.vertex[self.triangles]


@dataclass(frozen=True)
class Unfolding:
    """Points of the plane, and for every corner the point and the copy of the square: sign * uv[index] + offset.

    uv (k,2); index (c,); sign (c,) of 1 or -1; offset (c,2). fixed (k,2) bool: coordinates that make the copies fit,
    and may not move. poles (k,) bool: points that are corners at a pole. missed: how many of the projection's singular
    points lie within a face.
    """

    uv: np.ndarray
    index: np.ndarray
    sign: np.ndarray
    offset: np.ndarray
    fixed: np.ndarray
    poles: np.ndarray
    missed: int

    def with_points(self, uv: np.ndarray) -> Unfolding:
        """The unfolding with its points at uv (k,2)."""
        return replace(self, uv=uv)

    def corners(self) -> np.ndarray:
        """UV (c,2) of every corner."""
        return self.sign[:, None] * self.uv[self.index] + self.offset


def gather_polygons(corners: np.ndarray, triangles: np.ndarray, faces: np.ndarray) -> tuple[Polygons, np.ndarray]:
    """Gather the polygons of a Chart: triangles (m,3) of its vertices, their corners (m,3) on the surface, faces (m,).

    Also returns the surface's corner (c,) of every corner.
    """
    ids, index, inverse = np.unique(corners.ravel(), return_index=True, return_inverse=True)
    polygon = np.repeat(faces, 3)[index]
    # Corners of one face are neighbours in a surface.
    number = np.unique(polygon, return_inverse=True)[1].ravel()
    return Polygons(triangles.ravel()[index], number, inverse.reshape(-1, 3)), ids


def unfold(points: np.ndarray, polygons: Polygons, projection: str) -> tuple[Unfolding, np.ndarray]:
    """Lay the unit vectors (n,3) of a sphere map out in the plane; also returns them as they were laid out.

    The vertices nearest to the poles (to the midpoints of the sides of the octahedral square) are pushed onto them
    first, `move_vertices_onto`. A corner at a pole gets the mean u of the other corners of its face.
    """
    check_projection(projection)
    targets = singular_points(projection)
    points, singular = move_vertices_onto(points, polygons.vertex_triangles, targets)
    points = points + 0.0  # no -0.0, whose sign would count
    if projection == OCTAHEDRAL:
        unfolded = _unfold_octahedron(points, polygons, singular)
    else:
        unfolded = _unfold_cylinder(points, polygons, projection, singular)
    return unfolded, points


# ---- cylinders ----------------------------------------------------------------------------------------------


def _unfold_cylinder(points: np.ndarray, polygons: Polygons, projection: str, singular: np.ndarray) -> Unfolding:
    """The unfolding of a cylinder: u of every corner within half a turn of the first usable one of its face."""
    uv = to_plane(points, projection)
    vertex, polygon = polygons.vertex, polygons.polygon
    at_pole = np.isin(vertex, singular[singular >= 0])
    at_pole |= _pole_corners(points, polygons)
    u = uv[vertex, 0]
    u = u - np.round(u - u[_first_usable(polygon, ~at_pole)][polygon])
    count = polygon.max() + 1
    others = np.bincount(polygon[~at_pole], minlength=count)
    mean = np.bincount(polygon[~at_pole], u[~at_pole], count) / np.maximum(others, 1)
    u[at_pole] = mean[polygon[at_pole]]
    least = np.minimum.reduceat(u, np.searchsorted(polygon, np.arange(count)))
    u -= np.floor(least + SEAM_SLACK)[polygon]
    # A pole is a point of its own in every face.
    own = np.cumsum(at_pole) - 1 + len(points)
    index = np.where(at_pole, own, vertex)
    uv = np.concatenate([uv, np.column_stack([u[at_pole], uv[vertex[at_pole], 1]])])
    offset = np.column_stack([np.where(at_pole, 0, np.round(u - uv[index, 0])), np.zeros(len(u))])
    poles = np.arange(len(uv)) >= len(points)
    fixed = np.column_stack([poles, poles])
    fixed[np.setdiff1d(np.arange(len(points)), index)] = True
    return Unfolding(
        uv=uv,
        index=index,
        sign=np.ones(len(u)),
        offset=offset,
        fixed=fixed,
        poles=poles,
        missed=int((singular < 0).sum()),
    )


def brought_into_square(unfolded: Unfolding, polygons: Polygons) -> Unfolding:
    """Bring faces that have left the square, of a cylinder whose points were moved, back by a whole turn."""
    u, polygon = unfolded.corners()[:, 0], polygons.polygon
    start = np.searchsorted(polygon, np.arange(polygon.max() + 1))
    mean = np.bincount(polygon, u) / np.bincount(polygon)
    turn = np.where(mean < 0, 1.0, np.where(np.minimum.reduceat(u, start) >= 1, -1.0, 0.0))
    offset = unfolded.offset.copy()
    offset[:, 0] += turn[polygon]
    return replace(unfolded, offset=offset)


def _pole_corners(points: np.ndarray, polygons: Polygons) -> np.ndarray:
    """Corners (c,) bool that stand for a pole inside their face: the nearest one of every triangle around a pole."""
    chosen = np.zeros(len(polygons.vertex), bool)
    p = points[polygons.vertex_triangles]
    normal = cross3(p, np.roll(p, -1, axis=1))
    north, south = (normal[..., 2] > 0).all(axis=1), (normal[..., 2] < 0).all(axis=1)
    around = np.flatnonzero(north | south)
    chosen[polygons.triangles[around, np.abs(p[around, :, 2]).argmax(axis=1)]] = True
    return chosen


def _first_usable(polygon: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """The first usable corner of every polygon, or the first one where none is."""
    order = np.lexsort((~usable, polygon))
    return order[np.searchsorted(polygon[order], np.arange(polygon.max() + 1))]


# ---- octahedron ---------------------------------------------------------------------------------------------


def _unfold_octahedron(points: np.ndarray, polygons: Polygons, singular: np.ndarray) -> Unfolding:
    """The unfolding of the octahedron: every corner on the copy that the arc from its face's first one leads to."""
    vertex, polygon = polygons.vertex, polygons.polygon
    square = octahedral_to_plane(points)
    first = _first_usable(polygon, ~np.isin(vertex, singular))
    sign, offset = _copies_along_arcs(points[vertex[first][polygon]], points[vertex])
    sign, offset = _copies_of_middles(square[vertex], polygon, sign, offset)
    fixed = np.zeros((len(points), 2), bool)
    fixed[singular[singular >= 0]] = True
    fixed[np.setdiff1d(np.arange(len(points)), vertex)] = True
    # From [-1, 1] to [0, 1].
    offset = 0.5 * (offset + 1 - sign[:, None])
    none = np.zeros(len(points), bool)
    return Unfolding(
        uv=0.5 * (square + 1),
        index=vertex,
        sign=sign,
        offset=offset,
        fixed=fixed,
        poles=none,
        missed=int((singular < 0).sum()),
    )


def _copies_along_arcs(p: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sign (c,) and offset (c,2) that bring the image of q to the copy of p, for arcs between unit vectors (c,3).

    The square is cut along the southern halves of the meridians of its sides' midpoints c; beyond one it goes on as
    x -> 2 c - x.
    """
    times, sides = [], []
    for axis, other in ((1, 0), (0, 1)):
        a, b = p[:, axis], q[:, axis]
        size = np.abs(a) + np.abs(b)
        t = np.abs(a) / np.where(size > 0, size, 1)
        at = (1 - t)[:, None] * p + t[:, None] * q
        times.append(np.where(((a < 0) != (b < 0)) & (at[:, 2] < 0), t, np.inf))
        sides.append(at[:, other])
    both = np.isfinite(times[0]) & np.isfinite(times[1])
    x_last = times[1] > times[0]
    # Between two crossings at the pole itself, only the ends tell which of the four cuts it is.
    sides[0] = np.where(both, np.where(x_last, p[:, 0], q[:, 0]), sides[0])
    sides[1] = np.where(both, np.where(x_last, q[:, 1], p[:, 1]), sides[1])
    centres = [np.zeros((len(p), 2)), np.zeros((len(p), 2))]
    for k in (0, 1):
        centres[k][:, k] = np.where(sides[k] < 0, -1, 1)
    sign, offset = np.ones(len(p)), np.zeros((len(p), 2))
    # The copies are left one by one, so the turn about the last cut is done first.
    for k in (0, 1):
        crossed = np.isfinite(np.where(x_last, times[1 - k], times[k]))
        centre = np.where(x_last[:, None], centres[1 - k], centres[k])
        sign = np.where(crossed, -sign, sign)
        offset = np.where(crossed[:, None], 2 * centre - offset, offset)
    return sign, offset


def _copies_of_middles(
    square: np.ndarray, polygon: np.ndarray, sign: np.ndarray, offset: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sign and offset of all corners with every polygon moved to the copy that holds its middle."""
    uv = sign[:, None] * square + offset
    count = np.bincount(polygon)
    middle = np.column_stack([np.bincount(polygon, x) / count for x in uv.T])[polygon]
    there = sign[:, None] * (middle - offset)
    excess = np.abs(there).max(axis=1)
    order = np.lexsort((np.round(excess, 9), polygon))
    best = order[np.searchsorted(polygon[order], np.arange(polygon.max() + 1))][polygon]
    return sign[best] * sign, sign[best][:, None] * (offset - offset[best])
