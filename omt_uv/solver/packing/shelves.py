"""Pack many small islands as rectangles into blocks, row by row, so that a block is placed as one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Block:
    """A rectangle of `size` (2,), and the lower left corners (k,2) in it of the rectangles `members` (k,)."""

    members: np.ndarray
    corners: np.ndarray
    size: np.ndarray


def blocks_of(sizes: np.ndarray, count: int) -> list[Block]:
    """At most `count` blocks of rectangles of `sizes` (k,2), those of like height in one, of like areas in sum."""
    order = np.lexsort((-sizes[:, 0], -sizes[:, 1]))
    area = np.cumsum(sizes[order].prod(axis=1))
    which = np.minimum((count * (area - 0.5 * sizes[order].prod(axis=1)) / area[-1]).astype(np.int64), count - 1)
    start = np.flatnonzero(np.r_[True, which[1:] != which[:-1]])
    return [_block(members, sizes[members]) for members in np.split(order, start[1:])]


def _block(members: np.ndarray, sizes: np.ndarray) -> Block:
    """A block as wide as high, roughly, of rectangles (k,2) that become less high."""
    along = np.cumsum(sizes[:, 0])
    wide = max(float(sizes[:, 0].max()), float(np.sqrt(sizes.prod(axis=1).sum())))
    corners = np.zeros((len(sizes), 2))
    begin, height, reach = 0, 0.0, 0.0
    while begin < len(sizes):
        before = along[begin] - sizes[begin, 0]
        end = max(begin + 1, int(np.searchsorted(along, before + wide * (1 + 1e-9), side="right")))
        corners[begin:end, 0] = along[begin:end] - sizes[begin:end, 0] - before
        corners[begin:end, 1] = height
        reach = max(reach, float(along[end - 1] - before))
        height += float(sizes[begin, 1])
        begin = end
    return Block(members, corners, np.array([reach, height]))
