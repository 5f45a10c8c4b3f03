"""Find which of many boxes in the plane meet: few by a sweep over the plane, many by a grid.

Boxes that meet along both axes meet along every direction between them, and rounded sums keep the order of what is
summed. So a slanting sweep misses none, and there is no side of a square whose boxes all meet along it.
"""

from __future__ import annotations

import numpy as np

from ..mesh.topology import expand

# The grid in which they are found is made coarser until a box touches so many of its cells at most, on average,
# and has at most so many along a side.
CELLS_PER_BOX = 12
# Along what the sweep goes: the longer axis, and so much of the other one.
SLANT = 0.25
# A sweep compares so many boxes with each on average at most; where more lie one above the other, a grid is faster.
SWEPT_PER_BOX = 40
MOST_CELLS = 2**24


def box_pairs(
    low1: np.ndarray, high1: np.ndarray, low2: np.ndarray, high2: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs i, j (p,) of boxes that meet, in their order: their corners are (k,2) each, and (l,2) each."""
    found = pairs_up_to(np.inf, low1, high1, low2, high2)
    assert found is not None
    return found


def pairs_up_to(
    most: float, low1: np.ndarray, high1: np.ndarray, low2: np.ndarray, high2: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """`box_pairs`, or None where more than `most` pairs would have to be looked at."""
    if not len(low1) or not len(low2):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    low = np.minimum(low1.min(0), low2.min(0))
    extents = np.maximum(high1.max(0), high2.max(0)) - low
    pairs = _swept(low1, high1, low2, high2, int(extents.argmax()))
    if pairs is None:
        pairs = _in_grid(low1, high1, low2, high2, low, float(extents.max()), most)
    if pairs is None:
        return None
    i, j = pairs
    meet = np.ones(len(i), bool)
    # Axis by axis: millions of edges have many millions of pairs.
    for axis in range(2):
        meet &= (low1[:, axis][i] <= high2[:, axis][j]) & (low2[:, axis][j] <= high1[:, axis][i])
    key = np.sort(i[meet] * len(low2) + j[meet])
    key = key[np.append(True, key[1:] != key[:-1])] if len(key) else key
    return key // len(low2), key % len(low2)


def _swept(low1, high1, low2, high2, axis: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Pairs (p,) of boxes that meet along a sweep mostly along an axis, or None where these are too many."""
    begin1, end1, begin2, end2 = (x[:, axis] + SLANT * x[:, 1 - axis] for x in (low1, high1, low2, high2))
    order1, order2 = np.argsort(begin1), np.argsort(begin2)
    sorted1, sorted2 = begin1[order1], begin2[order2]
    # Of two that meet, one begins in the other: the second in the first or at its beginning, or else the first.
    first2, last2 = np.searchsorted(sorted2, begin1), np.searchsorted(sorted2, end1, side="right")
    first1, last1 = np.searchsorted(sorted1, begin2, side="right"), np.searchsorted(sorted1, end2, side="right")
    count1, count2 = np.maximum(last2 - first2, 0), np.maximum(last1 - first1, 0)
    if count1.sum() + count2.sum() > SWEPT_PER_BOX * (len(low1) + len(low2)):
        return None
    # Pairs of a million edges take more memory than all else: what they come from is no longer needed.
    del sorted1, sorted2, last1, last2
    middle = int(count1.sum())
    i, j = np.empty((2, middle + int(count2.sum())), np.int64)
    i[:middle], k = expand(count1)
    j[:middle] = order2[first2[i[:middle]] + k]
    j[middle:], k = expand(count2)
    i[middle:] = order1[first1[j[middle:]] + k]
    return i, j


def _in_grid(
    low1, high1, low2, high2, low, extent: float, most: float = np.inf
) -> tuple[np.ndarray, np.ndarray] | None:
    """Pairs (p,) of boxes that touch the same cell of a uniform grid, some of them several times; None where these are
    more than `most`."""
    span = np.concatenate([high1 - low1, high2 - low2]).max(axis=1)
    # As the boxes are, however little of the plane they fill: those of a strip lie on a line.
    size = max(float(np.median(span)), extent / MOST_CELLS, 1e-300)
    while (np.floor(span / size) + 2).astype(float) @ (np.floor(span / size) + 2) > CELLS_PER_BOX * len(span):
        size *= 2
    box1, cell1 = _rasterise(low1 - low, high1 - low, size)
    box2, cell2 = _rasterise(low2 - low, high2 - low, size)
    order = np.argsort(cell2, kind="stable")
    box2, cell2 = box2[order], cell2[order]
    begin, end = np.searchsorted(cell2, cell1), np.searchsorted(cell2, cell1, side="right")
    if (end - begin).sum() > most:
        return None
    which, place = expand(end - begin)
    return box1[which], box2[begin[which] + place]


def _rasterise(low, high, size):
    """Boxes and the cells of this size that they touch, (p,) each; the corners (k,2) are not negative."""
    first = (low / size).astype(np.int64)
    span = (high / size).astype(np.int64) - first + 1
    box, k = expand(span.prod(1))
    return box, (first[box, 0] + k % span[box, 0]) * (2 * MOST_CELLS) + first[box, 1] + k // span[box, 0]
