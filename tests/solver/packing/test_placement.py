"""Items on a raster by plain counting: their turns, the cells beside them, and places where none lies on another."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.packing.placement import BESIDE, place, turned_masks
from omt_uv.solver.packing.raster_grid import RasterGrid


def random_mask(rng):
    """A mask that fills its rows and columns."""
    mask = rng.random(rng.integers(1, 7, 2)) < 0.6
    mask[rng.integers(len(mask)), :] = True
    mask[:, rng.integers(mask.shape[1])] = True
    return mask


@pytest.mark.parametrize("seed", range(4))
def test_turns_have_the_cells_of_the_mask_and_what_lies_beside(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        mask = random_mask(rng)
        item = turned_masks(mask, (0, 1, 2, 3))
        assert item.widest == max(mask.shape) and item.cells == mask.sum()
        for quarters, turned in enumerate(item.turns):
            assert turned.quarters == quarters and (turned.mask == np.rot90(mask, -quarters)).all()
            taken = {(x, y) for y, x in np.argwhere(turned.mask)}
            h, w = turned.mask.shape
            beside = {
                (x, y)
                for x in range(-BESIDE, w + BESIDE)
                for y in range(-BESIDE, h + BESIDE)
                if (x, y) not in taken and min(abs(x - a) + abs(y - b) for a, b in taken) <= BESIDE
            }
            assert set(map(tuple, turned.beside.tolist())) == beside and len(turned.beside) == len(beside)


@pytest.mark.parametrize("side", [8, 16, 30])
@pytest.mark.parametrize("seed", range(3))
def test_no_item_lies_on_another_or_outside(side, seed):
    rng = np.random.default_rng(seed)
    masks = [random_mask(rng) for _ in range(12)]
    items = [turned_masks(mask, (0, 1) if k % 2 else (0,)) for k, mask in enumerate(masks)]
    order = rng.permutation(12)
    places, stuck = place(items, order, RasterGrid(side, max(item.widest for item in items) + 8))
    if stuck >= 0:
        # That there is no room is said of the first such item: with those before it alone there is.
        assert places == [] and side < 30
        order = order[: list(order).index(stuck)]
        places, stuck = place(items, order, RasterGrid(side, max(item.widest for item in items) + 8))
    assert stuck == -1
    count = np.zeros((side, side), int)
    for k in order:
        mask = np.rot90(masks[k], -places[k].quarters)
        assert places[k].quarters in [turned.quarters for turned in items[k].turns]
        x, y = places[k].x, places[k].y
        assert 0 <= x <= side - mask.shape[1] and 0 <= y <= side - mask.shape[0]
        count[y : y + mask.shape[0], x : x + mask.shape[1]] += mask
    assert count.max() <= 1 and count.sum() == sum(items[k].cells for k in order)
