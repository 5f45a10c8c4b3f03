"""Find which of many boxes in the plane meet, by a grid."""

from __future__ import annotations

import numpy as np

from ..mesh.topology import expand

# The grid in which they are found is made coarser until a box touches so many of its cells at most, on average,
# and has at most so many along a side.
CELLS_PER_BOX = 12
MOST_CELLS = 2**24


def box_pairs(
    low1: np.ndarray, high1: np.ndarray, low2: np.ndarray, high2: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs i, j (p,) of boxes that meet, by a uniform grid: their corners are (k,2) each, and (l,2) each."""
    low = np.minimum(low1.min(0), low2.min(0))
    extent = float((np.maximum(high1.max(0), high2.max(0)) - low).max())
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
    which, place = expand(end - begin)
    i, j = box1[which], box2[begin[which] + place]
    meet = (low1[i] <= high2[j]).all(1) & (low2[j] <= high1[i]).all(1)
    key = np.unique(i[meet] * len(low2) + j[meet])
    return key // len(low2), key % len(low2)


def _rasterise(low, high, size):
    """Boxes and the cells of this size that they touch, (p,) each; the corners (k,2) are not negative."""
    first = (low / size).astype(np.int64)
    span = (high / size).astype(np.int64) - first + 1
    box, k = expand(span.prod(1))
    return box, (first[box, 0] + k % span[box, 0]) * (2 * MOST_CELLS) + first[box, 1] + k // span[box, 0]
