"""Measure how much of a UV map lies under more than one face, by samples and a grid of its faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..counts import BYTES_PER_ELEMENT, check_memory
from ..mesh.geometry import as_points, cross2, signed_areas
from ..mesh.topology import expand, order_of_numbers
from .contacts import lies_apart

SAMPLES = 200_000  # points by default: a standard error of 0.1 % of the area
CHUNK = 2_000_000  # pairs of a sample and a face tested at once, for memory
MOST_PAIRS = 100_000_000  # a map that lies many times over itself is judged by fewer samples, for time
ENTRIES_PER_FACE = 40  # the grid is coarsened until its lists are no longer than this on average
MOST_ENTRIES = 12_000_000  # or than this in all, where there are not many more faces, for memory
AT_ONCE = 50_000  # faces whose cells are found at once
INSIDE = 1e-9  # a point this close to a face's border, relative to the squared extent, is not inside
ASKED_FIRST = 32  # of the triangles that a cell lists: those of maps that lie on themselves as a whole tell at once
PAIR_WORK = 12  # comparisons of a point and a face that take as long as one of two faces, and half of them again


def overlap_share(uv: np.ndarray, *, samples: int = SAMPLES, seed: int = 0) -> float:
    """Share of the area of the triangles `uv` (m,3,2) that lies inside more than one of them.

    Points are drawn uniformly by area, so the standard error is sqrt(share / samples); the same seed gives the same
    points. 0 where no triangle has an area, and where a few triangles have less in common, pair by pair, than one
    point stands for. Time and memory stay bounded on maps that are mere noise.

    Raises
    ------
    CountError : more samples than this machine has memory for
    """
    check_memory(samples, BYTES_PER_ELEMENT, "A measure by {} samples")
    return _Areas(np.asarray(uv, float)).share(samples, seed)


def overlap_exceeds(uv: np.ndarray, bounds: Sequence[tuple[int, float]]) -> bool:
    """Whether `overlap_share` of triangles `uv` (m,3,2) is above the share of any of some bounds, each with the number
    of its samples: few first, which find what there is much of."""
    areas = _Areas(np.asarray(uv, float))
    return any(areas.share(samples) > share for samples, share in bounds)


class _Areas:
    """Those of triangles `uv` (m,3,2) that have an area, with their grid."""

    def __init__(self, uv: np.ndarray):
        area = np.abs(cross2(uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0])) / 2
        self.triangles, self.area = uv[area > 0], area[area > 0]
        self.grid = _Grid(self.triangles) if len(self.area) else None

    def share(self, samples: int, seed: int = 0) -> float:
        """Their `overlap_share`."""
        if self.grid is None:
            return 0.0
        few = PAIR_WORK * self.grid.pair_count() < samples
        if few and 2 * self.grid.common_area() * samples < self.area.sum():
            return 0.0
        points = _draw(self.triangles, self.area, samples, seed)
        pairs = np.cumsum(self.grid.candidates(points))
        points = points[: max(1, int(np.searchsorted(pairs, MOST_PAIRS)))]
        covered = [self.grid.covered_twice(chunk) for chunk in _chunks(points, pairs[: len(points)])]
        return float(np.concatenate(covered).mean())


def covered_share(w: np.ndarray, triangles: np.ndarray, samples: int = SAMPLES) -> float:
    """`overlap_share` of triangles (m,3) with places w (n,) complex; 0 without samples where their outline says so."""
    return 0.0 if lies_apart(w, triangles) else overlap_share(as_points(w)[triangles], samples=samples)


def cover_pairs(uv: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which points (k,2) lie in which triangles `uv` (m,3,2): their numbers (c,) each, a pair for every time."""
    return _pairs_in(_Grid(uv), points)


def _pairs_in(grid: _Grid, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for the triangles of a grid."""
    begin, found = 0, []
    for chunk in _chunks(points, np.cumsum(grid.candidates(points))):
        point, triangle = grid.inside(chunk)
        found.append((point + begin, triangle))
        begin += len(chunk)
    point, triangle = (np.concatenate(x) for x in zip(*found, strict=True))
    return point, triangle


def part_covered(flat: np.ndarray, corners: np.ndarray, part: np.ndarray) -> float:
    """Which share of some triangles (p,) others of them (t,3) with places (k,) complex cover, too: a small part of them
    is missed by samples of all. None of what has no area."""
    uv = as_points(flat)[corners]
    return _part_covered(uv, part, _Grid(uv))


def covers_little(
    w: np.ndarray, triangles: np.ndarray, part: np.ndarray, shares: tuple[float, float], samples: int
) -> bool:
    """Whether `part_covered` of triangles (p,) and `covered_share` of all (m,3) with places w (n,) complex are no more
    than these two shares."""
    if lies_apart(w, triangles):
        return True
    uv = as_points(w)[triangles]
    areas = _Areas(uv)
    if areas.grid is None or len(areas.area) < len(uv):
        return part_covered(w, triangles, part) <= shares[0] and overlap_share(uv, samples=samples) <= shares[1]
    # Most of the time is that of the grid.
    return _part_covered(uv, part, areas.grid) <= shares[0] and areas.share(samples) <= shares[1]


def _part_covered(uv: np.ndarray, part: np.ndarray, grid: _Grid) -> float:
    """`part_covered` of triangles `uv` (m,3,2) with their grid."""
    inside = 0.75 * np.eye(3) + 0.25 / 3
    point, over = _pairs_in(grid, np.einsum("kc,pcd->pkd", inside, uv[part]).reshape(-1, 2))
    twice = np.unique(point[over != part[point // 3]])
    area = np.abs(signed_areas(uv[part].reshape(-1, 2), np.arange(3 * len(part)).reshape(-1, 3)))
    return float(area[twice // 3].sum() / (3 * area.sum())) if area.any() else 0.0


def _chunks(points: np.ndarray, pairs: np.ndarray) -> list[np.ndarray]:
    """Points (k,2) in parts of about CHUNK pairs with triangles, of which there are so many (k,) up to each."""
    return np.split(points, np.unique(np.searchsorted(pairs, np.arange(CHUNK, pairs[-1], CHUNK))))


def _draw(tri: np.ndarray, area: np.ndarray, samples: int, seed: int) -> np.ndarray:
    """Points (samples,2) distributed uniformly over the triangles."""
    rng = np.random.default_rng(seed)
    owner = rng.choice(len(tri), samples, p=area / area.sum())
    cut = np.sort(rng.random((samples, 2)), axis=1)
    bary = np.column_stack([cut[:, 0], cut[:, 1] - cut[:, 0], 1 - cut[:, 1]])
    return np.einsum("ni,nid->nd", bary, tri[owner])


class _Grid:
    """Triangles listed by the cells of a square grid that their bounding boxes touch."""

    def __init__(self, tri):
        turned = cross2(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]) < 0
        # All counter-clockwise.
        self.tri = np.where(turned[:, None, None], tri[:, ::-1], tri)
        self.sides = np.roll(self.tri, -1, axis=1) - self.tri
        low, high = tri.min(1), tri.max(1)
        self.origin = low.min(0)
        # What lies in a point is in one cell.
        self.extent = (high.max(0) - self.origin).max() or 1.0
        self.side = int(np.clip(np.sqrt(len(tri)), 8, 1024))
        most = min(ENTRIES_PER_FACE * len(tri), max(MOST_ENTRIES, 8 * len(tri)))
        first, span = self._boxes(low, high)
        while self.side > 1 and span.prod(1).sum() > most:
            self.side //= 2
            first, span = self._boxes(low, high)
        cell, owner = self._entries(first, span)
        self.start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=self.side**2))])
        self.owner = owner[order_of_numbers(cell)]

    def _entries(self, first, span):
        """The cells and the triangles of all entries (e,), triangle by triangle: cells of boxes (m,2), (m,2)."""
        size = span.prod(1)
        end = np.cumsum(size)
        cell, owner = (np.empty(size.sum(), np.int32) for _ in range(2))
        for begin in range(0, len(size), AT_ONCE):
            here = slice(begin, begin + AT_ONCE)
            own, k = expand(size[here])
            some = slice(end[begin] - size[begin], end[begin] - size[begin] + len(own))
            column, row = first[here][own, 0] + k % span[here][own, 0], first[here][own, 1] + k // span[here][own, 0]
            cell[some], owner[some] = column * self.side + row, begin + own
        return cell, owner

    def _boxes(self, low, high):
        """First cell (m,2) of every bounding box, and how many columns and rows it touches (m,2)."""
        first = self._cells(low)
        return first, self._cells(high) - first + 1

    def _cells(self, points):
        """Column and row (k,2) of points (k,2)."""
        return np.clip(((points - self.origin) / self.extent * self.side).astype(np.int64), 0, self.side - 1)

    def _cell(self, points):
        """Number (k,) of the cell of points (k,2)."""
        column, row = self._cells(points).T
        return column * self.side + row

    def pair_count(self) -> int:
        """Pairs of triangles in the same cell."""
        inside = np.diff(self.start)
        return int(inside @ (inside - 1) // 2)

    def common_area(self) -> float:
        """No less than the areas that two of the triangles have in common, summed over all pairs.

        What a triangle has beyond the line of a side of another, its own side of it, is no wider than its farthest
        corner is from there, and within the other no longer than that side.
        """
        inside = np.diff(self.start)
        entry, k = expand(np.repeat(inside, inside))
        one, other = self.owner[entry], self.owner[np.repeat(self.start[:-1], inside)[entry] + k]
        pairs = np.unique(one.astype(np.int64) * len(self.tri) + other)
        one, other = np.divmod(pairs, len(self.tri))
        a, b = self.tri[one][:, :, None], self.sides[one][:, :, None]
        reach = cross2(b, self.tri[other][:, None] - a).max(axis=2).min(axis=1)
        # Every pair is there both ways: the better bound of the two, of those of different triangles.
        back = reach[np.searchsorted(pairs, other * len(self.tri) + one)]
        return float(np.maximum(np.minimum(reach, back), 0)[one < other].sum())

    def candidates(self, points):
        """With how many triangles each point (k,2) has to be compared."""
        cell = self._cell(points)
        return self.start[cell + 1] - self.start[cell]

    def covered_twice(self, points):
        """Whether each point (k,2) lies in more than one triangle; asks no further of what has been found in two."""
        cell, number = self._cell(points), np.zeros(len(points), np.int64)
        first, last = self.start[cell], self.start[cell + 1]
        left, many = np.arange(len(points)), ASKED_FIRST
        while len(left):
            end = np.minimum(first[left] + many, last[left])
            number[left] += np.bincount(self._among(points[left], first[left], end)[0], minlength=len(left))
            first[left] = end
            left, many = left[(number[left] < 2) & (end < last[left])], 3 * many
        return number > 1

    def inside(self, points):
        """Points (c,) of these (k,2) and the triangle (c,) that each lies in, a pair for every time."""
        cell = self._cell(points)
        return self._among(points, self.start[cell], self.start[cell + 1])

    def _among(self, points, first, end):
        """The same among the entries of cells from first (k,) to end (k,)."""
        query, k = expand(end - first)
        triangle = self.owner[first[query] + k]
        limit = INSIDE * self.extent**2
        for i in range(3):
            # What is outside of one side needs no other: most of what a cell lists.
            beyond = cross2(self.sides[triangle, i], points[query] - self.tri[triangle, i]) > limit
            query, triangle = query[beyond], triangle[beyond]
        return query, triangle
