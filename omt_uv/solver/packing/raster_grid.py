"""Find all places of a mask on a raster that is partly taken, at once, by shifted copies of the raster in bits.

The rows of a mask are runs of cells, and every run is covered by two whose lengths are a power of two; of runs that lie
upon one another as many rows are covered at once. The raster is kept with its taken cells widened by all powers of two,
eight times, shifted by 0 to 7 bits: then a run takes two disjunctions of whole bytes for all places of the mask.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

# Cells beyond the last ones of rows and columns that are there, and taken. No run of a mask that lies on the raster
# reaches them: they are for what looks beside it, and for whole bytes.
BEYOND = 8


def rectangles_of(mask: np.ndarray) -> np.ndarray:
    """Rectangles (k,4) of `power` by `tall`, `row`, `column` that together are the mask (h,w) bool.

    A rectangle has 2^power columns and 2^tall rows from `row` and `column` on. Rows that begin or end alike are one.
    """
    height, width = mask.shape
    padded = np.zeros((height, width + 2), np.int8)
    padded[:, 1:-1] = mask
    change = padded[:, 1:] - padded[:, :-1]
    row, begin = np.divmod(np.flatnonzero(change == 1), width + 1)
    end = np.flatnonzero(change == -1) % (width + 1)
    power = _whole_log2(end - begin)
    last = end - (1 << power)
    more = last != begin
    columns = np.concatenate([begin, last[more]]) + (width + 1) * np.concatenate([power, power[more]])
    # Between the last row of a column and the first of the next is a number that is none.
    key = np.sort(columns * (height + 1) + np.concatenate([row, row[more]]))
    first = np.flatnonzero(np.diff(key, prepend=-2) != 1)
    length = np.diff(first, append=len(key))
    columns, row = np.divmod(key[first], height + 1)
    power, column = np.divmod(columns, width + 1)
    tall = _whole_log2(length)
    found = np.column_stack([power, tall, row, column])
    rest = found[length != 1 << tall]
    rest[:, 2] += (length - (1 << tall))[length != 1 << tall]
    return np.concatenate([found, rest])


def _whole_log2(numbers: np.ndarray) -> np.ndarray:
    """The whole part of the logarithms (k,) of positive numbers to the base of two."""
    return np.frexp(numbers)[1].astype(np.int64) - 1


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
        self._high: dict[tuple[int, int, int], np.ndarray] = {}
        # What was taken since the copies of a power were made: rows, and columns from and to.
        self._late: list[list[tuple[slice, int, int]]] = [[] for _ in widened]

    def copy(self) -> RasterGrid:
        """A raster of which as much is taken."""
        other = copy(self)
        other._widened, other._bits, other._high = self._widened.copy(), self._bits.copy(), {}
        other._late = list(map(list, self._late))
        return other

    @property
    def taken(self) -> np.ndarray:
        """Cells (side,side) bool that are taken."""
        return self._widened[0][: self.side, : self.side]

    def taken_share(self, cells: np.ndarray, places: np.ndarray) -> np.ndarray:
        """The share (p,) of cells (k,2) x, y that are taken, or outside, where they are moved to places (p,2) x, y."""
        # Cells of negative numbers are the last ones, of the row before or of all, which are beyond the raster: they
        # are taken, too.
        across = self._widened.shape[-1]
        numbers = (cells[:, 1] * across + cells[:, 0]) + (places[:, 1] * across + places[:, 0])[:, None]
        return np.count_nonzero(self._widened[0].reshape(-1)[numbers], axis=1) / len(cells)

    def take(self, mask: np.ndarray, x: int, y: int) -> None:
        """Take the cells of a mask (h,w) bool whose lower left is at column x and row y."""
        height, width = mask.shape
        self._widened[0][y : y + height, x : x + width] |= mask
        self._high.clear()
        for late in self._late:
            late.append((slice(y, y + height), x, x + width))

    def _renew(self, power: int) -> None:
        """Bring the copies that are widened by 2^power up to date: small masks have no use for those of large ones."""
        late, self._late[power] = self._late[power], []
        if late and power and self._late[power - 1]:
            self._renew(power - 1)
        step, wider = 2**power, self._widened[power]
        for rows, x, end in late:
            begin = max(0, x - step) // 8 * 8
            if power:
                narrow, half = self._widened[power - 1], step // 2
                # No run reaches so far that what lies beyond matters.
                reach = min(end, wider.shape[1] - half)
                wider[rows, begin:end] = narrow[rows, begin:end]
                wider[rows, begin:reach] |= narrow[rows, begin + half : reach + half]
            # Bits that are shifted by s come from s cells farther on.
            begin, stop = max(0, begin - 8), min(self._width, 8 * -(-end // 8))
            self._bits[power, :, rows, begin // 8 : stop // 8] = _shifted(wider[rows, begin : stop + 8])

    def places(self, rectangles: list[list[int]], height: int, width: int) -> FreePlaces | None:
        """Lower left cells at which a mask of these rectangles, this height and width is free, or None."""
        rows, columns = self.side - height + 1, self.side - width + 1
        if rows <= 0 or columns <= 0:
            return None
        # Rows one after the other: a shift is one stretch of memory, and what runs over the end of a row is not read.
        stride, count = self._width // 8, -(-columns // 8)
        blocked = np.zeros(rows * stride, np.uint8)
        length = (rows - 1) * stride + count
        ahead = blocked[:length]
        for power in {power for power, *_ in rectangles}:
            self._renew(power)
        for power, tall, row, column in rectangles:
            start = row * stride + (column >> 3)
            ahead |= self._stacked(power, column & 7, tall)[start : start + length]
        free = ~blocked.reshape(rows, stride)[:, :count]
        # Of the last byte only the first bits are places.
        free[:, -1] &= 0xFF & 0xFF00 >> (columns - 1) % 8 + 1
        return FreePlaces(free) if free.any() else None

    def _stacked(self, power: int, shift: int, tall: int) -> np.ndarray:
        """Bytes of all rows: from cell `shift` on, of cells of which one of 2^power to the right in one of 2^tall rows
        from theirs on is taken."""
        found = self._high.get((power, shift, tall))
        if found is None:
            if tall:
                lower, more = self._stacked(power, shift, tall - 1), (self._width // 8) << tall - 1
                found = lower[:-more] | lower[more:]
            else:
                found = self._bits[power, shift].reshape(-1)
            self._high[power, shift, tall] = found
        return found


@dataclass(frozen=True)
class FreePlaces:
    """Lower left cells at which a mask is free, as `bits` (rows,bytes), the first column in the highest bit."""

    bits: np.ndarray

    def ends(self) -> set[tuple[int, int]]:
        """Places (x, y) at the ends of the outermost rows and columns that have any."""
        rows = np.flatnonzero(self.bits.any(axis=1))
        columns = np.flatnonzero(np.unpackbits(np.bitwise_or.reduce(self.bits, axis=0)))
        found = set()
        for y in (int(rows[0]), int(rows[-1])):
            there = np.flatnonzero(np.unpackbits(self.bits[y]))
            found |= {(int(there[0]), y), (int(there[-1]), y)}
        for x in (int(columns[0]), int(columns[-1])):
            there = np.flatnonzero(self.bits[:, x >> 3] & 128 >> (x & 7))
            found |= {(x, int(there[0])), (x, int(there[-1]))}
        return found


def _shifted(cells: np.ndarray) -> np.ndarray:
    """Cells (h,8w+8) bool in bits, those from cell s on for s from 0 to 7, (8,h,w)."""
    bits = np.packbits(cells, axis=1).astype(np.uint16)
    pairs = bits[:, :-1] << 8 | bits[:, 1:]
    return (pairs >> np.arange(8, 0, -1, dtype=np.uint16)[:, None, None]).astype(np.uint8)
