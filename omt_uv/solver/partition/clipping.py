"""Clip many convex polygons at once by half-planes (Sutherland, Hodgman 1974), and remember which one made which side.

CellPieces lie in their triangles: points are (s, t) of the barycentric coordinates (s, t, 1 - s - t).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Labels of the sides of a triangle: from corner 0 to 1, 1 to 2, 2 to 0. Others are numbers of sites, from 0.
SIDES = (-1, -2, -3)
CORNERS = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))


@dataclass(frozen=True)
class CellPieces:
    """Convex polygons: points (k,v,2) of which the first `count` (k,) are in use, and label (k,v) of the side from each
    to the next."""

    points: np.ndarray
    count: np.ndarray
    label: np.ndarray

    def chosen(self, rows: np.ndarray) -> CellPieces:
        """Those of some rows (r,)."""
        return CellPieces(self.points[rows], self.count[rows], self.label[rows])

    def used(self) -> np.ndarray:
        """Which slots (k,v) hold a point."""
        return np.arange(self.points.shape[1]) < self.count[:, None]

    def following(self) -> np.ndarray:
        """The next point (k,v,2) of every one."""
        ahead = (np.arange(self.points.shape[1]) + 1) % np.maximum(self.count, 1)[:, None]
        return np.take_along_axis(self.points, ahead[:, :, None], axis=1)

    def moments(self) -> tuple[np.ndarray, np.ndarray]:
        """Areas (k,), of the triangle's as a half, and centroids (k,2), those of thin ones as the mean of points."""
        # From the first point: differences of close points are exact.
        origin = self.points[:, :1]
        p, q = self.points - origin, self.following() - origin
        cross = np.where(self.used(), p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0], 0)
        area = cross.sum(axis=1) / 2
        weighted = ((p + q) * cross[..., None]).sum(axis=1) / 6
        mean = np.where(self.used()[..., None], p, 0).sum(axis=1) / np.maximum(self.count, 1)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            inner = np.where((area > 1e-14)[:, None], weighted / area[:, None], mean)
        return area, inner + origin[:, 0]


def whole_triangles(k: int) -> CellPieces:
    """The triangle itself, k times."""
    return CellPieces(np.tile(np.array(CORNERS), (k, 1, 1)), np.full(k, 3), np.tile(np.array(SIDES), (k, 1)))


def clip(polygons: CellPieces, values: np.ndarray, label: np.ndarray) -> tuple[CellPieces, np.ndarray]:
    """What is left of polygons where linear functions are negative, and which rows (r,) are left.

    values (k,3) at the corners of the triangle, label (k,) of the new sides
    """
    points, used = polygons.points, polygons.used()
    slope = values[:, :2] - values[:, 2:]
    height = values[:, 2, None] + (points * slope[:, None]).sum(axis=2)
    height = _at_corners(polygons, values, height)
    inside = (height < 0) & used
    rows = np.flatnonzero(inside.any(axis=1))
    cut = rows[(used & ~inside)[rows].any(axis=1)]
    if not len(cut):
        return polygons.chosen(rows), rows
    new = _cut(polygons.chosen(cut), height[cut], inside[cut], label[cut])
    width = max(new.points.shape[1], points.shape[1])
    kept = polygons.chosen(rows)
    points, labels, count = _widened(kept.points, width), _widened(kept.label, width), kept.count.copy()
    at = np.searchsorted(rows, cut)
    points[at], labels[at], count[at] = _widened(new.points, width), _widened(new.label, width), new.count
    most = int(count.max())
    return CellPieces(points[:, :most], count, labels[:, :most]), rows


def _at_corners(polygons: CellPieces, values: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Heights (k,v), taken from the values (k,3) themselves where a point is a corner of its triangle.

    Both triangles at an edge then decide alike about its ends.
    """
    for corner, (s, t) in enumerate(CORNERS):
        there = (polygons.points[..., 0] == s) & (polygons.points[..., 1] == t)
        height = np.where(there, values[:, corner, None], height)
    return height


def _widened(array: np.ndarray, width: int) -> np.ndarray:
    """An array (k,v,...) with room for `width` points."""
    more = width - array.shape[1]
    return np.pad(array, [(0, 0), (0, more)] + [(0, 0)] * (array.ndim - 2)) if more > 0 else array.copy()


def _cut(polygons: CellPieces, height: np.ndarray, inside: np.ndarray, label: np.ndarray) -> CellPieces:
    """CellPieces with points on both sides: points inside, and one where a side crosses over."""
    k, width = inside.shape
    ahead = (np.arange(width) + 1) % polygons.count[:, None]
    following = polygons.following()
    height_ahead, inside_ahead = np.take_along_axis(height, ahead, 1), np.take_along_axis(inside, ahead, 1)
    crossing = (inside != inside_ahead) & polygons.used()
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(crossing, height / (height - height_ahead), 0)
    middle = polygons.points + np.clip(along, 0, 1)[..., None] * (following - polygons.points)
    # In turn: a point that stays, then where its side crosses over.
    emitted = np.stack([inside, crossing], axis=2).reshape(k, 2 * width)
    places = np.stack([polygons.points, middle], axis=2).reshape(k, 2 * width, 2)
    leaving = np.where(inside, label[:, None], polygons.label)
    labels = np.stack([polygons.label, leaving], axis=2).reshape(k, 2 * width)
    count = emitted.sum(axis=1)
    row, column = np.nonzero(emitted)
    slot = (np.cumsum(emitted, axis=1) - 1)[row, column]
    points, new_labels = np.zeros((k, int(count.max()), 2)), np.zeros((k, int(count.max())), np.int64)
    points[row, slot], new_labels[row, slot] = places[row, column], labels[row, column]
    return CellPieces(points, count, new_labels)
