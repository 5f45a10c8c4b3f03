"""Rasterise islands that are grown by half of a margin: the cells that two islands may not share.

Where the cells of two islands are disjoint, their outlines are as far apart as the margin: half way between two points
that are nearer lies a point that is within half of the margin of both, and its cell belongs to both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import signed_areas
from ..mesh.topology import boundary_edges, expand

# Cells between two points that stand for the outline.
SPACING = 0.5
# Growth in cells from which on it is measured from cell to cell, which costs less and adds a cell.
FAR = 4.0
# Points of an outline that are treated at once.
BATCH = 20_000


@dataclass(frozen=True)
class IslandOutline:
    """The boundary of an island, surface on the left, as segments from `tail` (e,2) to `head` (e,2)."""

    tail: np.ndarray
    head: np.ndarray

    def scaled(self, scale: float, origin: np.ndarray) -> IslandOutline:
        """The outline times a scale, less an origin (2,)."""
        return IslandOutline(self.tail * scale - origin, self.head * scale - origin)


def side_by_side(points: Sequence[np.ndarray], triangles: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,2) and triangles (m,3) of all islands (n_i,2), (m_i,3) as one mesh."""
    first = np.cumsum([0, *map(len, points)])[:-1]
    shifted = np.concatenate(triangles) + np.repeat(first, list(map(len, triangles)))[:, None]
    return np.concatenate(points), shifted


def island_areas(islands: Sequence[np.ndarray], triangles: Sequence[np.ndarray]) -> np.ndarray:
    """Area (k,) of every island (n_i,2) with triangles (m_i,3)."""
    points, index = side_by_side(islands, triangles)
    owner = np.repeat(np.arange(len(islands)), list(map(len, triangles)))
    return np.bincount(owner, np.abs(signed_areas(points, index)), len(islands))


def outlines_of(points: Sequence[np.ndarray], triangles: Sequence[np.ndarray]) -> list[IslandOutline]:
    """The outlines of islands of points (n_i,2) and triangles (m_i,3), of all at once."""
    if not len(points):
        return []
    every, shifted = side_by_side(points, triangles)
    edges, first = boundary_edges(shifted), np.cumsum([0, *map(len, points)])
    tail, head = every[edges[:, 0]], every[edges[:, 1]]
    # Edges come in the order of their triangles, and these island by island.
    ends = np.searchsorted(np.searchsorted(first, edges[:, 0], side="right"), np.arange(2, len(points) + 1))
    return list(map(IslandOutline, np.split(tail, ends), np.split(head, ends)))


def grown_cells(outline: IslandOutline, growth: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells (h,w) bool, rows upwards, that touch an island grown by `growth` cells, and the lower left of them (2,)."""
    corner = np.concatenate([outline.tail, outline.head])
    low = np.floor(corner.min(axis=0) - growth).astype(np.int64)
    width, height = np.floor(corner.max(axis=0) + growth).astype(np.int64) + 1 - low
    moved = outline.scaled(1.0, low)
    cells = _inside(moved, int(width), int(height))
    if growth < FAR:
        _mark_near(cells, moved, growth)
    else:
        from scipy.ndimage import distance_transform_edt

        _mark_near(cells, moved, 0.0)
        # Two points are farther apart than the centres of their cells by a diagonal at most.
        cells = distance_transform_edt(~cells) <= growth + np.sqrt(2)
    return cells, low


def _inside(outline: IslandOutline, width: int, height: int) -> np.ndarray:
    """Cells (h,w) bool whose centre the outline goes around."""
    a, b = outline.tail, outline.head
    # A segment crosses the lines through the centres of these rows.
    one, other = a[:, 1] - 0.5, b[:, 1] - 0.5
    first = np.ceil(np.minimum(one, other)).astype(np.int64)
    edge, step = expand(np.ceil(np.maximum(one, other)).astype(np.int64) - first)
    row = first[edge] + step
    rise = (other - one)[edge]
    x = a[edge, 0] + (b - a)[edge, 0] * ((row - one[edge]) / rise)
    column = np.clip(np.ceil(x - 0.5).astype(np.int64), 0, width)
    turns = np.bincount(row * (width + 1) + column, np.sign(rise), height * (width + 1)).reshape(height, width + 1)
    return np.abs(np.cumsum(turns, axis=1)[:, :width]) > 0.5


def _mark_near(cells: np.ndarray, outline: IslandOutline, growth: float) -> None:
    """Mark in `cells` (h,w) bool those that come within `growth` cells of the outline."""
    along = outline.head - outline.tail
    count = np.maximum(1, np.ceil(np.linalg.norm(along, axis=1) / SPACING)).astype(np.int64)
    edge, step = expand(count)
    points = outline.tail[edge] + along[edge] * (step / count[edge])[:, None]
    # Ends are among the points, and each stands for half of the spacing on either side.
    radius = np.hypot(growth, SPACING / 2) + 1e-9
    reach = int(np.ceil(radius))
    shift = np.arange(-reach, reach + 1)
    marked = np.zeros((cells.shape[0] + 2 * reach, cells.shape[1] + 2 * reach), dtype=bool)
    for start in range(0, len(points), BATCH):
        some = points[start : start + BATCH]
        cell = np.floor(some).astype(np.int64)
        away = np.maximum(0, np.abs(shift - (some - cell - 0.5)[..., None]) - 0.5)
        near = away[:, 1, :, None] ** 2 + away[:, 0, None, :] ** 2 < radius**2
        k, row, column = np.nonzero(near)
        marked[cell[k, 1] + row, cell[k, 0] + column] = True
    cells |= marked[reach : reach + cells.shape[0], reach : reach + cells.shape[1]]
