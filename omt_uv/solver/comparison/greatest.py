"""The greatest distance of a surface from another, with a bound from above: branch and bound over triangles.

The distance from a triangle of the other surface is convex, so that within a triangle of this one it is greatest at a
corner, and bounds the distance from the whole other surface. Where that bound is above the greatest distance that was
found, the triangle is cut into four (Guthe, Borodin, Klein 2005).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.closest_point import ClosestPoint, SurfacePoints, closest_on_triangles
from ..mesh.topology import expand
from ..progress import Progress, Steps

# How far the bound may be above the distance, relative to it.
TOLERANCE = 1e-3
# Lengths below this share of the other surface's diagonal are nothing.
NOTHING = 1e-6
# Points that are looked for at most; what is left then shows in the bound.
MOST_POINTS = 400_000
# Triangles that are cut in a round, those with the highest bounds first.
MOST_AT_ONCE = 20_000
# A triangle's corners and the middles of the edges opposite of them, as four triangles.
QUARTERS = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2], [3, 4, 5]])
# Points whose distances are made exact at first; then twice as many.
FEW = 32
# Distances that differ by no more are the same.
ROUNDING = 1e-9


@dataclass(frozen=True)
class GreatestDistance:
    """distance : the greatest that was found; bound : none is above it"""

    distance: float
    bound: float


@dataclass(frozen=True)
class _Pieces:
    """Parts of triangles: corners (k,3,3), triangles of the other surface (k,3) near to them, and upper bounds (k,) of
    the distance from that surface."""

    corners: np.ndarray
    nearest: np.ndarray
    bound: np.ndarray

    def taken(self, which: np.ndarray) -> _Pieces:
        return _Pieces(self.corners[which], self.nearest[which], self.bound[which])


def by_position(index: ClosestPoint, points: np.ndarray) -> SurfacePoints:
    """The closest points to points (k,3) by position alone, whichever way the surface looks there; seldom one is found
    that is not the closest of all, see `exact_distances`."""
    return index.walk(points, index.near_by_position(points))


def exact_distances(index: ClosestPoint, points: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Distances (k,) of a few points (k,3) from the surface of an index, of which (k,) are known to be no less."""
    return nearest_of_all(index, points, most)[0]


def nearest_of_all(index: ClosestPoint, points: np.ndarray, most: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`exact_distances` and a triangle (k,) that is so near, -1 where none is nearer: all that may be are tried."""
    V, F = index.vertices, index.triangles
    middle = V[F].mean(axis=1)
    radius = np.linalg.norm(V[F] - middle[:, None], axis=2).max(axis=1)
    lists = cKDTree(middle).query_ball_point(points, most + radius.max() * (1 + 1e-9))
    owner, place = expand(np.array([len(x) for x in lists]))
    faces = np.concatenate([np.asarray(x, np.int64) for x in lists])
    near = np.linalg.norm(middle[faces] - points[owner], axis=1) <= (most[owner] + radius[faces]) * (1 + 1e-9)
    owner, faces = owner[near], faces[near]
    a, b, c = (V[F[faces, k]] for k in range(3))
    weights = closest_on_triangles(points[owner], a, b, c)
    off = np.linalg.norm(weights[:, :1] * a + weights[:, 1:2] * b + weights[:, 2:] * c - points[owner], axis=1)
    order = np.lexsort((off, owner))
    first = order[np.append(True, np.diff(owner[order]) > 0)] if len(order) else order
    first = first[off[first] < most[owner[first]]]
    found, nearest = most.copy(), np.full(len(points), -1)
    found[owner[first]], nearest[owner[first]] = off[first], faces[first]
    return found, nearest


def greatest_distance(
    V: np.ndarray, F: np.ndarray, index: ClosestPoint, nearest: np.ndarray, seen: tuple[np.ndarray, np.ndarray]
) -> Steps[GreatestDistance]:
    """The greatest distance of the surface of positions (n,3) and triangles (m,3) from that of an index.

    nearest : triangles (n,) of the index near to the vertices; seen : points (k,3) of the surface and their distances
    (k,), of which the search begins
    """
    nothing = NOTHING * float(np.linalg.norm(np.ptp(index.vertices, axis=0)))
    found = farthest(index, *seen)
    pieces = _bounded(index, V[F], nearest[F])
    points = 0
    while True:
        least = max(found * (1 + TOLERANCE), nothing)
        pieces = pieces.taken(pieces.bound > least)
        if not len(pieces.bound) or points >= MOST_POINTS:
            return GreatestDistance(found, max(least, float(pieces.bound.max(initial=0.0))))
        order = np.argsort(-pieces.bound)
        parts, found, count = _cut(index, pieces.taken(order[:MOST_AT_ONCE]), found)
        pieces = _joined(parts, pieces.taken(order[MOST_AT_ONCE:]))
        points += count
        yield Progress("greatest distance", min(points / MOST_POINTS, 1.0))


def farthest(index: ClosestPoint, points: np.ndarray, most: np.ndarray, least: float = 0.0) -> float:
    """The greatest exact distance of points (k,3) whose distances (k,) may be too great; `least` if none is greater."""
    count = FEW
    order = np.argsort(-most)
    while len(order := order[most[order] > least * (1 + ROUNDING)]):
        few, order = order[:count], order[count:]
        exact = exact_distances(index, points[few], most[few])
        least, count = max(least, float(exact.max())), 2 * count
    return least


def _cut(index: ClosestPoint, pieces: _Pieces, found: float) -> tuple[_Pieces, float, int]:
    """Four pieces of each; then the greatest distance, which was `found` before, and how many points were looked for:
    the middles of their edges."""
    middles = 0.5 * (pieces.corners[:, [1, 2, 0]] + pieces.corners[:, [2, 0, 1]])
    # Neighbours share their edges.
    points, place = np.unique(middles.reshape(-1, 3), axis=0, return_inverse=True)
    closest = by_position(index, points)
    distance, faces = np.linalg.norm(closest.points - points, axis=1), closest.faces.copy()
    # Bounds by triangles that are not the nearest would never come down to what was found.
    doubtful = np.flatnonzero(distance > found * (1 + ROUNDING))
    if len(doubtful):
        distance[doubtful], nearest = nearest_of_all(index, points[doubtful], distance[doubtful])
        faces[doubtful] = np.where(nearest >= 0, nearest, faces[doubtful])
        found = max(found, float(distance[doubtful].max()))
    six = np.concatenate([pieces.corners, middles], axis=1)[:, QUARTERS].reshape(-1, 3, 3)
    near = np.concatenate([pieces.nearest, faces[place.reshape(-1, 3)]], axis=1)[:, QUARTERS].reshape(-1, 3)
    parts = _bounded(index, six, near)
    # What bounds the whole bounds its parts.
    return replace(parts, bound=np.minimum(parts.bound, np.repeat(pieces.bound, 4))), found, len(points)


def _bounded(index: ClosestPoint, corners: np.ndarray, nearest: np.ndarray) -> _Pieces:
    """Pieces of corners (k,3,3) and triangles near to them (k,3), bounded by these triangles, and by how far corners
    are from the surface and from one another."""
    from_each = np.sqrt(np.stack([index.distance(corners[:, k], nearest)[1] for k in range(3)], axis=1))
    by_triangle = from_each.max(axis=1).min(axis=1)
    apart = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).max(axis=2)
    by_corner = (np.diagonal(from_each, axis1=1, axis2=2) + apart).min(axis=1)
    return _Pieces(corners, nearest, np.minimum(by_triangle, by_corner))


def _joined(a: _Pieces, b: _Pieces) -> _Pieces:
    return _Pieces(*(np.concatenate(pair) for pair in zip(vars(a).values(), vars(b).values(), strict=True)))
