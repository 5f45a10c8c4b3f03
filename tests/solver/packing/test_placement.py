"""Items on a raster by plain counting: their turns, the cells beside them, and places where none lies on another."""

from __future__ import annotations

from dataclasses import replace

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
        assert item.turns[0].quarters == 0
        for turned in item.turns:
            assert (turned.mask == np.rot90(mask, -turned.quarters)).all()
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


@pytest.mark.parametrize(("shape", "turns"), [((3, 3), [0]), ((2, 5), [0, 1]), ((4, 4), [0, 1, 2, 3])])
def test_turns_that_are_alike_are_tried_once(shape, turns):
    mask = np.ones(shape, bool)
    # A corner that is missing tells all turns apart.
    mask[0, 0] = len(turns) < 4
    item = turned_masks(mask, (0, 1, 2, 3))
    assert [turned.quarters for turned in item.turns] == turns
    for one in item.turns:
        assert not any(np.array_equal(one.mask, other.mask) for other in item.turns if other is not one)


def test_what_is_alike_when_turned_is_placed_as_if_all_turns_were_tried():
    rng = np.random.default_rng(4)
    masks = [np.ones(rng.integers(2, 9, 2), bool) for _ in range(25)]
    items = [turned_masks(mask, (0, 1, 2, 3)) for mask in masks]
    every = []
    for mask in masks:
        some = [turned_masks(np.rot90(mask, -k), (0,)).turns[0] for k in range(4)]
        every.append(replace(items[0], turns=tuple(replace(one, quarters=k) for k, one in enumerate(some))))
    order = np.argsort([-mask.size for mask in masks], kind="stable").tolist()
    found, expected = (place(given, order, RasterGrid(48, 16))[0] for given in (items, every))
    assert len(found) == 25 and found == expected


def test_what_is_as_high_or_as_wide_as_the_raster_has_a_place():
    for shape in ((16, 3), (3, 16), (16, 16)):
        item = turned_masks(np.ones(shape, bool), (0,))
        (found,), stuck = place([item], [0], RasterGrid(16, 24))
        assert stuck == -1 and (found.x if shape[1] == 16 else found.y) == 0
    for shape in ((17, 3), (3, 17)):
        assert place([turned_masks(np.ones(shape, bool), (0,))], [0], RasterGrid(16, 25)) == ([], 0)
