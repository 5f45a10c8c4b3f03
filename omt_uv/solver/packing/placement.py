"""Place masks one after the other, each where it touches most of what is there: the bottom and the sides first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .raster_grid import RasterGrid, rectangles_of

# What is at most so many cells beside a mask touches it.
BESIDE = 2
# A turned mask is placed where it touches more than the upright one by this share of its outline.
UPRIGHT = 0.02


@dataclass(frozen=True)
class Turned:
    """A mask (h,w) bool turned by `quarters` counterclockwise, its rectangles, and the cells (k,2) x, y beside it."""

    mask: np.ndarray
    quarters: int
    rectangles: list[list[int]]
    beside: np.ndarray


@dataclass(frozen=True)
class Item:
    """What is placed as one, as all turns it may have."""

    turns: tuple[Turned, ...]

    @property
    def widest(self) -> int:
        """Cells along its longest side."""
        return max(self.turns[0].mask.shape)

    @property
    def cells(self) -> int:
        """Cells it takes."""
        return int(self.turns[0].mask.sum())


@dataclass(frozen=True)
class Place:
    """Lower left cell of an item, and by how many quarters it is turned."""

    x: int
    y: int
    quarters: int


def turned_masks(mask: np.ndarray, quarters: Sequence[int]) -> Item:
    """A mask (h,w) bool in the turns it may have, the first of which is preferred."""
    turns: list[Turned] = []
    beside, halves = _beside(mask), dict[int, np.ndarray]()
    for number in quarters:
        turned, cells, (height, width) = mask, beside, mask.shape
        for _ in range(number):
            cells = np.column_stack([height - 1 - cells[:, 1], cells[:, 0]])
            height, width = width, height
        turned = np.ascontiguousarray(np.rot90(mask, -number))
        if any(np.array_equal(turned, other.mask) for other in turns):
            # It fits where that one does, which comes first: rectangles have two turns, squares one.
            continue
        if number % 2 in halves:
            # Turned by half.
            power, tall, row, column = halves[number % 2].T
            found = np.column_stack([power, tall, height - (1 << tall) - row, width - (1 << power) - column])
        else:
            found = halves[number % 2] = rectangles_of(turned)
        turns.append(Turned(turned, number, _in_order(found), cells))
    return Item(tuple(turns))


def _in_order(rectangles: np.ndarray) -> list[list[int]]:
    """Rectangles (k,4), those that look at the same copy of a raster one after the other."""
    power, tall, row, column = rectangles.T
    return rectangles[np.lexsort((row, tall, column & 7, power))].tolist()


def _beside(mask: np.ndarray) -> np.ndarray:
    """Cells (k,2) x, y outside a mask (h,w) bool that at most `BESIDE` steps from cell to cell lead to."""
    inside = np.zeros((mask.shape[0] + 2 * BESIDE, mask.shape[1] + 2 * BESIDE), dtype=bool)
    inside[BESIDE:-BESIDE, BESIDE:-BESIDE] = mask
    near = inside
    for _ in range(BESIDE):
        grown = near.copy()
        grown[1:] |= near[:-1]
        grown[:-1] |= near[1:]
        grown[:, 1:] |= near[:, :-1]
        grown[:, :-1] |= near[:, 1:]
        near = grown
    return np.argwhere(near & ~inside)[:, ::-1] - BESIDE


def place(items: Sequence[Item], order: Sequence[int], grid: RasterGrid) -> tuple[list[Place], int]:
    """Places of all items in a grid, which takes them in an order (k,); or an empty list and the first without room."""
    places: list[Place] = [Place(0, 0, 0)] * len(items)
    for number in order:
        found = _best(items[number], grid)
        if found is None:
            return [], number
        turned, x, y = found
        grid.take(turned.mask, x, y)
        places[number] = Place(x, y, turned.quarters)
    return places, -1


def _best(item: Item, grid: RasterGrid) -> tuple[Turned, int, int] | None:
    """The turn and place of an item that touches most; None where there is none."""
    best, most = None, -np.inf
    for turned in item.turns:
        height, width = turned.mask.shape
        free = grid.places(turned.rectangles, height, width)
        if free is None:
            continue
        ends = np.array(sorted(free.ends()))
        # Of places that touch as much, the lowest, then the leftmost.
        value = grid.taken_share(turned.beside, ends) - UPRIGHT * (turned is not item.turns[0])
        value -= 1e-3 * (ends[:, 1] + height + 1e-3 * ends[:, 0]) / grid.side
        first = int(np.argmax(value))
        if value[first] > most:
            best, most = (turned, *ends[first].tolist()), value[first]
    return best
