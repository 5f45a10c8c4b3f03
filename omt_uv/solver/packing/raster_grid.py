"""Find all places of a mask on a raster that is partly taken, at once, by shifted copies of the raster in bits.

The rows of a mask are runs of cells, and every run is covered by two whose lengths are a power of two. The raster is
kept with its taken cells widened by all powers of two, eight times, shifted by 0 to 7 bits: then a run takes two
disjunctions of whole bytes for all places of the mask.
"""

from __future__ import annotations

from copy import copy

import numpy as np

# Cells beyond the last ones of rows and columns that are there, and taken. No run of a mask that lies on the raster
# reaches them: they are for what looks beside it, and for whole bytes.
BEYOND = 8


def runs_of(mask: np.ndarray) -> list[list[int]]:
    """Runs [k, row, column], from `column` over 2^k cells of `row`, that together are the mask (h,w) bool."""
    height, width = mask.shape
    padded = np.zeros((height, width + 2), np.int8)
    padded[:, 1:-1] = mask
    change = padded[:, 1:] - padded[:, :-1]
    row, begin = np.nonzero(change == 1)
    end = np.nonzero(change == -1)[1]
    power = np.floor(np.log2(end - begin)).astype(np.int64)
    keys = np.unique([(power * height + row) * (width + 1) + x for x in (begin, end - 2**power)])
    rest, column = np.divmod(keys, width + 1)
    return np.column_stack([*np.divmod(rest, height), column]).tolist()


class RasterGrid:
    """A square raster of `side` cells, rows upwards, for masks of at most `widest` cells along a side."""

    def __init__(self, side: int, widest: int):
        self.side = side
        self._width = 8 * -(-(side + BEYOND) // 8)
        # All rows are as one: what lies outside is taken.
        row = np.ones(self._width + 8, dtype=bool)
        row[:side] = False
        widened = [row]
        while 2 ** len(widened) <= widest:
            wider, step = widened[-1].copy(), 2 ** (len(widened) - 1)
            wider[:-step] |= widened[-1][step:]
            widened.append(wider)
        self._widened = np.ones((len(widened), side + BEYOND, len(row)), dtype=bool)
        self._widened[:, :side] = np.stack(widened)[:, None]
        self._bits = np.full((len(widened), 8, side + BEYOND, self._width // 8), 255, np.uint8)
        self._bits[:, :, :side] = np.stack([_shifted(wider[None]) for wider in widened])

    def copy(self) -> RasterGrid:
        """A raster of which as much is taken."""
        other = copy(self)
        other._widened, other._bits = self._widened.copy(), self._bits.copy()
        return other

    @property
    def taken(self) -> np.ndarray:
        """Cells (side,side) bool that are taken."""
        return self._widened[0][: self.side, : self.side]

    @property
    def taken_around(self) -> np.ndarray:
        """Cells that are taken, and after the last ones of rows and columns some of those beyond: all are taken."""
        return self._widened[0]

    def take(self, mask: np.ndarray, x: int, y: int) -> None:
        """Take the cells of a mask (h,w) bool whose lower left is at column x and row y."""
        rows, end = slice(y, y + mask.shape[0]), x + mask.shape[1]
        self._widened[0][rows, x:end] |= mask
        for k, wider in enumerate(self._widened):
            step = 2**k
            begin = max(0, x - step) // 8 * 8
            if k:
                narrow, half = self._widened[k - 1], step // 2
                wider[rows, begin:end] = narrow[rows, begin:end]
                # No run reaches so far that what lies beyond matters.
                reach = min(end, wider.shape[1] - half)
                wider[rows, begin:reach] |= narrow[rows, begin + half : reach + half]
            # Bits that are shifted by s come from s cells farther on.
            begin, stop = max(0, begin - 8), min(self._width, 8 * -(-end // 8))
            self._bits[k, :, rows, begin // 8 : stop // 8] = _shifted(wider[rows, begin : stop + 8])

    def places(self, runs: list[list[int]], height: int, width: int) -> np.ndarray | None:
        """Lower left cells (rows,columns) bool at which a mask of these runs, height and width is free, or None."""
        rows, columns = self.side - height + 1, self.side - width + 1
        if rows <= 0 or columns <= 0:
            return None
        # Rows one after the other: a shift is one stretch of memory, and what runs over the end of a row is not read.
        stride, count = self._width // 8, -(-columns // 8)
        blocked = np.zeros(rows * stride, np.uint8)
        length = (rows - 1) * stride + count
        ahead, flat = blocked[:length], self._bits.reshape(len(self._bits), 8, -1)
        for k, row, column in runs:
            start = row * stride + (column >> 3)
            ahead |= flat[k, column & 7, start : start + length]
        free = np.unpackbits(~blocked.reshape(rows, stride)[:, :count], axis=1, count=columns).view(bool)
        return free if free.any() else None


def _shifted(cells: np.ndarray) -> np.ndarray:
    """Cells (h,8w+8) bool in bits, those from cell s on for s from 0 to 7, (8,h,w)."""
    bits = np.packbits(cells, axis=1).astype(np.uint16)
    pairs = bits[:, :-1] << 8 | bits[:, 1:]
    return (pairs >> np.arange(8, 0, -1, dtype=np.uint16)[:, None, None]).astype(np.uint8)
