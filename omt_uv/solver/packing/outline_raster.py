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

# Cells that rounding may take from what is near.
ROUNDING = 1e-9
# Cells of boxes that are found at once.
MOST_CELLS = 2_000_000
# What is lower is a row, and what is shorter a point.
TINY = 1e-30


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


def grown_cells(outlines: Sequence[IslandOutline], growth: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Cells (h,w) bool, rows upwards, that touch each island grown by `growth` cells, and the lower left of them (2,).

    All at once, as far as memory is no matter: the cells of one box after another, row by row, with one cell more at
    the end of every row.
    """
    if not len(outlines):
        return []
    tail, head = (np.concatenate([getattr(o, end) for o in outlines]) for end in ("tail", "head"))
    count = np.array([len(o.tail) for o in outlines])
    first, owner = np.cumsum(count) - count, np.repeat(np.arange(len(outlines)), count)
    low = np.floor(np.minimum.reduceat(np.minimum(tail, head), first) - growth).astype(np.int64)
    high = np.floor(np.maximum.reduceat(np.maximum(tail, head), first) + growth).astype(np.int64)
    size = high + 1 - low
    cells = (size[:, 0] + 1) * size[:, 1]
    if cells.sum() > MOST_CELLS and len(outlines) > 1:
        half = len(outlines) // 2
        return grown_cells(outlines[:half], growth) + grown_cells(outlines[half:], growth)
    begin = np.cumsum(cells) - cells
    frame = _CellRows(begin[owner], size[owner], int(cells.sum()))
    moved = IslandOutline(tail - low[owner], head - low[owner])
    marked = (np.abs(frame.turns(moved)) > 0.5) | (frame.near(moved, growth) > 0)
    boxes = np.split(marked, begin[1:])
    return [(box.reshape(h, w + 1)[:, :-1], corner) for box, (w, h), corner in zip(boxes, size, low, strict=True)]


@dataclass(frozen=True)
class _CellRows:
    """For each of e segments where the cells of its box `begin` (e,), and the `size` (e,2) of that; `count` cells in
    all. Sums along rows are sums along all: what begins in a row ends in it."""

    begin: np.ndarray
    size: np.ndarray
    count: int

    def turns(self, outline: IslandOutline) -> np.ndarray:
        """How often the outlines go around the centre of every cell."""
        a, b = outline.tail, outline.head
        # A segment crosses the lines through the centres of these rows.
        one, other = a[:, 1] - 0.5, b[:, 1] - 0.5
        first = np.ceil(np.minimum(one, other)).astype(np.int64)
        edge, step = expand(np.ceil(np.maximum(one, other)).astype(np.int64) - first)
        row = first[edge] + step
        rise = (other - one)[edge]
        x = a[edge, 0] + (b - a)[edge, 0] * ((row - one[edge]) / rise)
        column = np.clip(np.ceil(x - 0.5).astype(np.int64), 0, self.size[edge, 0])
        return np.cumsum(np.bincount(self._numbers(edge, row, column), np.sign(rise), self.count))

    def near(self, outline: IslandOutline, growth: float) -> np.ndarray:
        """How many segments come as near to every cell as `growth`.

        What is as near to a segment is convex: two disks, and a rectangle between. In a row it goes from the leftmost
        of these to the rightmost.
        """
        a, b = outline.tail, outline.head
        # Cells that are touched from outside count, whatever rounding says.
        reach = growth + ROUNDING
        bottom = np.maximum(np.floor(np.minimum(a[:, 1], b[:, 1]) - reach).astype(np.int64), 0)
        top = np.minimum(np.floor(np.maximum(a[:, 1], b[:, 1]) + reach).astype(np.int64), self.size[:, 1] - 1)
        edge, step = expand(top - bottom + 1)
        row = bottom[edge] + step
        a, b = a[edge], b[edge]
        left, right = np.full(len(edge), np.inf), np.full(len(edge), -np.inf)
        for centre in (a, b):
            away = np.maximum(0, np.maximum(row - centre[:, 1], centre[:, 1] - row - 1))
            half = np.sqrt(np.maximum(reach**2 - away**2, 0))
            left = np.where(away <= reach, np.minimum(left, centre[:, 0] - half), left)
            right = np.where(away <= reach, np.maximum(right, centre[:, 0] + half), right)
        along = b - a
        length = np.maximum(np.hypot(*along.T), TINY)
        aside = reach * np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
        # A side that lies in one row comes and leaves at infinity.
        rise = np.where(np.abs(along[:, 1]) < TINY, TINY, along[:, 1])
        for side in (aside, -aside):
            begin = a + side
            comes, leaves = np.sort((row + np.array([[0], [1]]) - begin[:, 1]) / rise, axis=0)
            is_there = (leaves >= 0) & (comes <= 1)
            x = begin[:, 0] + along[:, 0] * np.clip([comes, leaves], 0, 1)
            left = np.where(is_there, np.minimum(left, x.min(axis=0)), left)
            right = np.where(is_there, np.maximum(right, x.max(axis=0)), right)
        # Rounding may have found a row that is out of reach.
        there = left <= right
        edge, row = edge[there], row[there]
        ends = (np.floor(x[there]).astype(np.int64) for x in (left, right))
        column, last = (np.clip(x, 0, self.size[edge, 0] - 1) for x in ends)
        begun = np.bincount(self._numbers(edge, row, column), minlength=self.count)
        ended = np.bincount(self._numbers(edge, row, last + 1), minlength=self.count)
        return np.cumsum(begun - ended)

    def _numbers(self, edge: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """The cells in rows and columns of the boxes of segments."""
        return self.begin[edge] + row * (self.size[edge, 0] + 1) + column
