"""Pieces of packing, against loops over cells and rectangles, and what the search for a scale decides."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.solver.errors import MarginError
from omt_uv.solver.packing import outline_raster, pack_square, placement, raster_grid, shelves, single_precision
from omt_uv.solver.packing.raster_grid import RasterGrid
from omt_uv.solver.progress import drain


@pytest.mark.parametrize("growth", [0.0, 1.3, 2.0])
@pytest.mark.parametrize("level", [False, True])
def test_cells_are_marked_that_come_near_an_outline(growth, level):
    rng = np.random.default_rng(0)
    p = rng.uniform(6, 18, (5, 2))
    # Sides along rows, also between two of them, and one of no length.
    p = np.array([[6, 6.5], [15, 6.5], [15, 6.5], [15, 12], [6.3, 12.0]]) if level else p
    outline = outline_raster.IslandOutline(p, np.roll(p, -1, axis=0))
    size = np.tile([24, 24], (5, 1))
    boxes = outline_raster._CellRows(np.zeros(5, np.int64), size, 25 * 24)
    cells = (boxes.near(outline, growth) > 0).reshape(24, 25)
    t = np.linspace(0, 1, 4000)[:, None]
    points = np.concatenate([a + t * (b - a) for a, b in zip(outline.tail, outline.head, strict=True)])
    for y in range(24):
        for x in range(24):
            away = np.hypot(*np.maximum(0, np.abs(points - [x + 0.5, y + 0.5]) - 0.5).T).min()
            # A cell that is touched from outside may be marked or not, by rounding.
            if abs(away - growth) > 2e-6 + 1e-3 * (growth > 0):
                assert cells[y, x] == (away < growth + 1e-6)
    assert not cells[:, 24].any()


def test_areas_of_islands_have_no_sign():
    square = np.array([[0, 0], [2, 0], [2, 2], [0, 2.0]])
    F = np.array([[0, 1, 2], [0, 2, 3]])
    found = outline_raster.island_areas([square, 0.1 * square], [F, F[:, ::-1]])
    np.testing.assert_allclose(found, [4, 0.04])
    assert pack_square.covered_area([0.3 * square, 0.1 * square], [F, F]) == pytest.approx(0.4)


def test_points_of_no_triangle_lie_in_the_middle():
    points = np.array([[1.0, 2], [3, 6]])
    assert pack_square._spread(points, np.array([0, 1]), 2) is points
    np.testing.assert_allclose(
        pack_square._spread(points, np.array([3, 0]), 5), [[3, 6], [2, 4], [2, 4], [1, 2], [2, 4]]
    )


def test_one_island_alone_lies_in_the_middle():
    (placed,), scale = pack_square._alone(np.array([[2.0, 3], [6, 4]]), 0.8)
    assert scale == pytest.approx(0.2)
    np.testing.assert_allclose(placed, [[0.1, 0.4], [0.9, 0.6]])


def test_bits_of_cells_from_every_one_of_eight_on():
    cells = np.random.default_rng(0).random((3, 24)) > 0.5
    found = raster_grid._shifted(cells)
    assert found.shape == (8, 3, 2)
    for s in range(8):
        for row in range(3):
            for k in range(2):
                bits = cells[row, 8 * k + s : 8 * k + s + 8]
                assert found[s, row, k] == int("".join("1" if b else "0" for b in bits), 2)


@pytest.mark.parametrize("seed", range(3))
def test_blocks_are_rows_of_rectangles_about_as_wide_as_high(seed):
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.5, 2, (17, 2))
    sizes = sizes[np.argsort(-sizes[:, 1])]
    found = shelves._block(np.arange(17), sizes)
    ends = found.corners + sizes
    np.testing.assert_allclose(
        found.size,
        [
            ends[:, 0].max(),
            np.unique(found.corners[:, 1])[-1] + sizes[found.corners[:, 1] == found.corners[:, 1].max()][0, 1],
        ],
    )
    wide = max(sizes[:, 0].max(), np.sqrt(sizes.prod(axis=1).sum()))
    assert found.size[0] <= wide * (1 + 1e-6)
    for i in range(17):
        for j in range(i):
            apart = (found.corners[i] >= ends[j] - 1e-9) | (found.corners[j] >= ends[i] - 1e-9)
            assert apart.any()
    rows = np.unique(found.corners[:, 1])
    for low, high in pairwise(rows):
        row = found.corners[:, 1] == low
        assert high - low == pytest.approx(sizes[row, 1].max()) and found.corners[row, 0].min() == 0
        # The first of the next row would not have had room.
        following = int(np.flatnonzero(row)[-1]) + 1
        assert ends[row, 0].max() + sizes[following, 0] > wide


def test_places_near_by_have_the_fewest_folds():
    # A corner that single precision has rounded beyond the side across from it.
    near = np.array([[1000.0, 1000], [1001, 1000], [1000.5, 1000 - 6e-5]])
    triangles, side = np.array([[0, 1, 2]]), np.array([1.0])
    found = single_precision._bettered(near, triangles, side, np.array([2]), np.array([0]), np.array([2]))
    assert found[0, 1] > 1000 and np.abs(found[0] - near[2]).max() <= 3.01 * np.spacing(np.float32(1000.5))
    assert (found == found.astype(np.float32)).all()
    folded = single_precision._bettered(near, triangles, -side, np.array([2]), np.array([0]), np.array([2]))
    np.testing.assert_allclose(folded, near[2:], atol=1e-9)


def task_of(**given):
    fields = {
        "raster": 64,
        "areas": np.array([100.0, 50]),
        "sizes": np.array([[10.0, 10], [5, 10]]),
        "growth": 1.0,
        "outlines": [1, 2],
        "margin": 3.0,
        "staying": [],
        "texture_size": 1024,
    }
    return SimpleNamespace(**fields | given)


@pytest.mark.parametrize("fits", [1, 4, None])
def test_smaller_scales_are_tried_until_one_fits(fits, monkeypatch):
    scales = []

    def fit(task, scale, order, orders):
        assert orders == 3
        scales.append(scale)
        return (("found", scale) if len(scales) == fits else None), [*order, 1]

    monkeypatch.setattr(pack_square, "_fit", fit)
    if fits is None:
        with pytest.raises(MarginError, match="No room for 2 islands with a margin of 3 pixels"):
            drain(pack_square._first(task_of()))
        assert scales[-1] >= 1e-3 * scales[0] / np.sqrt(0.75) > scales[-1] * 0.95 * 0.99 ** (len(scales) - 1)
        return
    assert drain(pack_square._first(task_of())) == ("found", scales[-1])
    start = min(np.sqrt(64**2 / 150), (64 - 2) / 10)
    expected, step = [start * np.sqrt(0.75)], 0.95
    for _ in range(fits - 1):
        expected.append(expected[-1] * step)
        step *= 0.99
    np.testing.assert_allclose(scales, expected)


@pytest.mark.parametrize("most", [1.05, 1.2, np.inf])
def test_larger_scales_are_tried_while_an_order_has_room_and_then_with_others(most, monkeypatch):
    """The first order has room up to 1.06, others up to 1.1 and 1.13, and none beyond."""
    tried, room = [], [1.06, 1.1, 1.13]

    def fit(task, scale, order, orders):
        (number,) = order
        tried.append((scale, orders))
        better = next((k for k in range(number, 3 if orders > 1 else number + 1) if scale <= room[k]), None)
        return (None, order) if better is None else (pack_square._Found(task, scale, None, [], [better]), order)

    monkeypatch.setattr(pack_square, "_fit", fit)
    start = pack_square._Found(task_of(), 1.0, None, [], [0])
    found = drain(pack_square._larger(start, most))
    end = min(room[-1], most)
    assert end / 1.0081 <= found.scale <= end and max(scale for scale, _ in tried) <= min(most, 1.04 * end)
    assert {orders for _, orders in tried} == ({1} if most == 1.05 else {1, pack_square.PLACES_TRIED})
    monkeypatch.setattr(pack_square, "_fit", lambda task, scale, order, orders: (None, order))
    assert drain(pack_square._larger(start, most)) is start


@pytest.mark.parametrize("failures, orders", [(0, 1), (1, 2), (2, 3), (99, 8)])
def test_what_found_no_room_comes_first_in_the_next_orders(failures, orders, monkeypatch):
    tried = []

    def place(items, order, grid):
        tried.append(list(order))
        return (None, order[-1]) if len(tried) <= failures else (["placed"], -1)

    items = [SimpleNamespace(turns=[SimpleNamespace(mask=np.ones((k + 1, 2)))], widest=3, cells=4) for k in range(5)]
    monkeypatch.setattr(pack_square, "_rasterised", lambda task, scale: SimpleNamespace(items=items))
    monkeypatch.setattr(pack_square, "place", place)
    found, order = pack_square._fit(task_of(), 1.0, [], 8)
    assert tried[0] == [4, 3, 2, 1, 0] and len(tried) <= orders
    if failures:
        assert tried[1] == [0, 4, 3, 2, 1]
    if failures > 1:
        assert tried[2] == [1, 0, 4, 3, 2]
    # From then on chance decides, not what got stuck.
    for before, after in pairwise(tried[pack_square.STUCK_FIRST :]):
        assert after != [before[-1], *before[:-1]]
    assert (found is None) == (failures == 99) and (found is not None or order == [4, 3, 2, 1, 0])
    assert found is None or found.order == tried[-1] == order
    tried.clear()
    again, _ = pack_square._fit(task_of(), 1.0, [2, 1, 0, 3, 4], 8)
    assert tried[0] == [2, 1, 0, 3, 4]
    items[0].cells = 64**2
    tried.clear()
    assert pack_square._fit(task_of(), 1.0, [], 8)[0] is None and not tried
    items[0].cells, items[0].widest = 4, 65
    assert pack_square._fit(task_of(), 1.0, [], 8)[0] is None and not tried


def test_islands_fill_the_square_but_for_half_of_the_margin():
    task = task_of(cells_per_pixel=0.5)
    placed = [np.array([[0.2, 0.3], [0.5, 0.4]]), np.array([[0.6, 0.3], [0.7, 0.9]])]
    found, scale = pack_square._filled(placed, task, 2.0)
    border = 1.5 / 1024
    every = np.concatenate(found)
    assert every.min() == pytest.approx(border) and every.max() == pytest.approx(1 - border)
    more = (1 - 2 * border) / 0.6
    np.testing.assert_allclose(found[1][1] - found[0][0], (placed[1][1] - placed[0][0]) * more)
    assert scale == pytest.approx(2.0 / 512 * more)
    task.staying = [1]
    same, scale = pack_square._filled(placed, task, 2.0)
    assert same is placed and scale == pytest.approx(2.0 / 512)


@pytest.mark.parametrize("better", [True, False])
def test_a_finer_raster_goes_on_where_the_coarse_one_ended(better, monkeypatch):
    calls = []

    def larger(found, most):
        calls.append((found.task.raster, found.scale, most))
        return (
            found
            if len(calls) == 2 and not better
            else pack_square._Found(found.task, found.scale * 1.05, None, [], [])
        )
        yield

    def first(task):
        return pack_square._Found(task, 2.0, None, [], [])
        yield

    stays = SimpleNamespace(scaled=lambda factor, shift: ("scaled", factor))
    monkeypatch.setattr(pack_square, "_larger", larger)
    monkeypatch.setattr(pack_square, "_first", first)
    monkeypatch.setattr(pack_square, "replace", lambda one, **changes: type(one)(**{**vars(one), **changes}))
    found = drain(pack_square._search(task_of(raster=256, staying=[stays])))
    assert calls == [(256, 2.0, np.inf), (512, 2.1 * 2, 1.1)]
    assert found.task.raster == (512 if better else 256) and found.scale == pytest.approx(4.2 * 1.05 if better else 2.1)
    assert not better or found.task.staying == [("scaled", 2.0)]


def test_the_best_place_touches_most_then_is_low_and_left():
    grid = RasterGrid(16, 16)
    mask = np.ones((3, 4), bool)
    item = placement.Item(placement.turned_masks(mask, [0, 1]).turns)
    turned, x, y = placement._best(item, grid)
    assert (x, y) == (0, 0) and turned is item.turns[0]
    grid.take(np.ones((16, 12), bool), 0, 0)
    turned, x, y = placement._best(item, grid)
    assert (x, y) == (12, 0) and turned is item.turns[0]
    grid.take(np.ones((14, 4), bool), 12, 0)
    assert placement._best(item, grid) is None
