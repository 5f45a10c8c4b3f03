"""Find boxes that overlap, by grids of cells: one for each class of sizes, so that a large box costs no more than many
small ones.

A box of a class is no larger than a cell, so that it lies in eight cells at most. Two boxes share several cells; they
are counted in the one that holds the lowest corner of what they have in common.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..mesh.topology import expand

# Cells along each axis at most, so that numbers of cells fit into 63 bits.
MOST_CELLS = 1 << 20
# Cells along the longest side that tell what is near to what is concerned, and how many entries that may take.
COARSE_CELLS = 64
MOST_ENTRIES = 1 << 20
# Pairs that are looked at together: their arrays stay in the cache.
BLOCK = 1 << 16


def box_pairs(low: np.ndarray, high: np.ndarray, concerned: np.ndarray | None = None) -> np.ndarray:
    """Pairs (k,2), the smaller number first, of boxes from low to high (m,3) that overlap or touch, each once; only
    those with one that is `concerned` (m,) bool where this is given."""
    none = np.zeros((0, 2), np.int64)
    if not len(low) or (concerned is not None and not concerned.any()):
        return none
    rows = np.arange(len(low))
    if concerned is not None:
        # Most are far from what is concerned.
        rows = np.flatnonzero(_near(low, high, concerned))
        low, high, concerned = low[rows], high[rows], concerned[rows]
    size = (high - low).max(axis=1)
    least = max(float(np.median(size)), float((high.max(axis=0) - low.min(axis=0)).max()) / MOST_CELLS)
    if not least > 0:
        least = 1.0
    level = np.maximum(np.ceil(np.log2(np.maximum(size / least, 1e-9))), 0).astype(int)
    found = [none]
    for k in np.unique(level):
        grid = _BoxCells(tuple(low.T.copy()), tuple(high.T.copy()), least * 2.0**k)
        here, below = level == k, level <= k
        mine = here if concerned is None else here & concerned
        found += grid.within(np.flatnonzero(mine))
        found += grid.between(np.flatnonzero(mine), np.flatnonzero(below & ~mine))
        if concerned is not None:
            smaller = concerned & (level < k)
            found += grid.between(np.flatnonzero(smaller), np.flatnonzero(here & ~concerned))
    return rows[np.sort(np.concatenate(found), axis=1)]


def _near(low: np.ndarray, high: np.ndarray, concerned: np.ndarray) -> np.ndarray:
    """Which boxes (m,) bool may overlap some that are `concerned` (m,) bool: all that do, and others close by."""
    least, most = low[concerned].min(axis=0), high[concerned].max(axis=0)
    edge = float((most - least).max()) / COARSE_CELLS
    near = (low <= most).all(axis=1) & (high >= least).all(axis=1)
    if not edge > 0:
        return near
    first, last = (np.clip((x - least) / edge, 0, COARSE_CELLS).astype(np.int64) for x in (low, high))
    wide = last - first + 1
    count = wide.prod(axis=1)
    if count[concerned].sum() > MOST_ENTRIES:
        return near
    owner, place = expand(count[concerned])
    begin, across = first[concerned][owner], wide[concerned][owner]
    taken = np.zeros((COARSE_CELLS + 1,) * 3, bool)
    taken[
        begin[:, 0] + place % across[:, 0],
        begin[:, 1] + place // across[:, 0] % across[:, 1],
        begin[:, 2] + place // (across[:, 0] * across[:, 1]),
    ] = True
    # A box of two cells along each axis at most has its corners in all of its cells; larger ones are few.
    met = (wide > 2).any(axis=1)
    for x in (first, last):
        for y in (first, last):
            for z in (first, last):
                met |= taken[x[:, 0], y[:, 1], z[:, 2]]
    return near & met


@dataclass(frozen=True)
class _BoxCells:
    """Cells of one edge length, and boxes from low to high, (m,) along each axis, that are no larger than a cell."""

    low: tuple[np.ndarray, ...]
    high: tuple[np.ndarray, ...]
    edge: float

    @cached_property
    def first(self) -> list[np.ndarray]:
        """First cell (m,) of every box along each axis."""
        return [((x - x.min()) / self.edge).astype(np.int32) for x in self.low]

    @cached_property
    def wide(self) -> list[np.ndarray]:
        """In how many cells every box is, (m,) along each axis."""
        axes = zip(self.low, self.high, self.first, strict=True)
        return [((high - low.min()) / self.edge).astype(np.int32) - first + 1 for low, high, first in axes]

    def _entries(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Number of the cell and of the box, (e,) each, for every cell that a box reaches."""
        owner, place = expand(np.prod([wide[rows] for wide in self.wide], axis=0))
        owner = rows[owner]
        key = np.zeros(len(owner), np.int64)
        for first, wide in zip(self.first, self.wide, strict=True):
            here = wide[owner]
            key = (key << 21) | (first[owner] + place % here)
            place = place // here
        return key, owner

    def _sorted_entries(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key, owner = self._entries(rows)
        order = np.argsort(key, kind="stable")
        return key[order], owner[order]

    def within(self, rows: np.ndarray) -> list[np.ndarray]:
        """Pairs among some boxes."""
        if not len(rows):
            return []
        key, owner = self._sorted_entries(rows)
        end = _run_ends(key)
        place = np.arange(len(key))
        return self._looked_at(key, owner, place + 1, end - place - 1, owner)

    def between(self, rows: np.ndarray, others: np.ndarray) -> list[np.ndarray]:
        """Pairs of one of some boxes and one of others."""
        if not len(rows) or not len(others):
            return []
        for low, high in zip(self.low, self.high, strict=True):
            others = others[(low[others] <= high[rows].max()) & (high[others] >= low[rows].min())]
        key, owner = self._sorted_entries(rows)
        far, other = self._entries(others)
        begin, end = np.searchsorted(key, far), np.searchsorted(key, far, side="right")
        return self._looked_at(far, other, begin, end - begin, owner)

    def _looked_at(self, key, mine: np.ndarray, begin, count, owner: np.ndarray) -> list[np.ndarray]:
        """Pairs that overlap and whose cell this is, of boxes `mine` (e,) with boxes owner[begin : begin + count]."""
        some = np.flatnonzero(count > 0)
        key, mine, begin, count = key[some], mine[some], begin[some], count[some]
        found = []
        edges = np.searchsorted(np.cumsum(count), np.arange(BLOCK, count.sum() + BLOCK, BLOCK))
        start = 0
        for stop in np.unique(np.minimum(edges + 1, len(count))):
            row, place = expand(count[start:stop])
            one, other = mine[start:stop][row], owner[begin[start:stop][row] + place]
            found.append(self._overlapping(one, other, key[start:stop][row]))
            start = stop
        return found

    def _overlapping(self, one: np.ndarray, other: np.ndarray, key: np.ndarray) -> np.ndarray:
        """Those (k,2) of pairs (p,) and (p,) that overlap and that no other cell counts."""
        for axis, (low, high, first) in enumerate(zip(self.low, self.high, self.first, strict=True)):
            near = np.maximum(low[one], low[other]) <= np.minimum(high[one], high[other])
            one, other, key = one[near], other[near], key[near]
            cell = (key >> 21 * (2 - axis)) & (2**21 - 1)
            mine = np.maximum(first[one], first[other]) == cell
            one, other, key = one[mine], other[mine], key[mine]
        return np.stack([one, other], axis=1)


def _run_ends(key: np.ndarray) -> np.ndarray:
    """For every one of sorted keys (e,) where the run of its equals ends."""
    start = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    return np.repeat(np.r_[start[1:], len(key)], np.diff(np.r_[start, len(key)]))
