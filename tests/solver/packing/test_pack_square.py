"""Packing: inside the square, apart by the margin, one scale, never mirrored."""

from __future__ import annotations

import tracemalloc

import hard_meshes
import numpy as np
import pytest
from flat_islands import FAN, corner, corners, least_distance, outline, rotation

from omt_uv.solver.errors import MarginError
from omt_uv.solver.mesh.geometry import cross2
from omt_uv.solver.packing import pack_square
from omt_uv.solver.packing.pack_square import stack
from omt_uv.solver.progress import drain


def pack(*arguments, **options):
    return drain(pack_square.pack(*arguments, **options))


@pytest.mark.parametrize(
    "count, margin, texture_size", [(1, 0, 1024), (2, 4, 1024), (6, 16, 1024), (6, 3, 128), (6, 2, 8192)]
)
def test_inside_and_apart(count, margin, texture_size):
    result = pack(corners(count), [FAN] * count, margin, texture_size)
    points = np.concatenate(result.islands)
    border = 0.5 * margin / texture_size
    assert border - 1e-9 <= points.min()
    assert points.max() <= 1 - border + 1e-9
    assert np.ptp(points, axis=0).max() == pytest.approx(1 - 2 * border)
    if count > 1:
        distance = least_distance(result.islands)
        assert distance > 0
        assert distance >= 2 * border


@pytest.mark.parametrize("count", [1, 5])
def test_vertices_that_no_triangle_uses_take_no_room(count):
    """Centres of filled holes: the packer leaves them anywhere."""
    islands = corners(count)
    plain = pack(islands, [FAN] * count)
    more = pack([np.concatenate([[[30.0, -20.0]], p]) for p in islands], [FAN + 1] * count)
    for expected, found in zip(plain.islands, more.islands, strict=True):
        np.testing.assert_array_equal(found[1:], expected)
        assert (found[0] >= expected.min(axis=0)).all() and (found[0] <= expected.max(axis=0)).all()


def test_one_scale_and_no_mirror_image():
    islands = corners(10)
    result = pack(islands, [FAN] * 10)
    for before, after in zip(islands, result.islands, strict=True):
        linear = np.linalg.lstsq(before - before.mean(axis=0), after - after.mean(axis=0), rcond=None)[0]
        np.testing.assert_allclose(linear @ linear.T, result.scale**2 * np.eye(2), atol=1e-9)
        assert np.linalg.det(linear) > 0
    assert 0.25 < result.coverage < 1


def bars(seed, count=14):
    """Rectangles, whose places hang on their order alone."""
    sizes = np.exp(np.random.default_rng(seed).normal(0, 0.8, (count, 2)))
    return [np.array([[0, 0], [w, 0], [w, h], [0, h]]) for w, h in sizes]


def test_other_orders_make_room_where_the_first_ones_do_not(monkeypatch):
    faces = [np.array([[0, 1, 2], [0, 2, 3]])] * 14
    more = np.array([pack(bars(seed), faces).coverage for seed in (0, 1, 5, 7)])
    monkeypatch.setattr(pack_square, "ORDERS", pack_square.STUCK_FIRST)
    monkeypatch.setattr(pack_square, "PLACES_TRIED", 0)
    fewer = np.array([pack(bars(seed), faces).coverage for seed in (0, 1, 5, 7)])
    # What fits by chance leads elsewhere, and may end a little lower.
    assert (more >= fewer - 0.002).all() and more.mean() > fewer.mean() + 0.003


@pytest.mark.parametrize("count", [2, 5, 9, 12, 13, 30])
def test_of_few_islands_more_orders_are_tried(monkeypatch, count):
    """About as many islands are placed for another order as of a dozen."""
    asked, fit = [], pack_square._fit
    monkeypatch.setattr(pack_square, "_fit", lambda *given: asked.append(given[-1]) or fit(*given))
    pack(bars(3, count), [np.array([[0, 1, 2], [0, 2, 3]])] * count)
    most = max(asked)
    assert most == 8 if count > 12 else 100 - count < most * count <= 100


def test_roughly_packed_islands_are_apart_and_fill_less(monkeypatch):
    """It ends where the finer raster begins."""
    faces, rasters, rasterised = [np.array([[0, 1, 2], [0, 2, 3]])] * 14, set(), pack_square._rasterised

    def kept(task, scale):
        rasters.add(task.raster)
        return rasterised(task, scale)

    monkeypatch.setattr(pack_square, "_rasterised", kept)
    rough = pack(bars(0), faces, roughly=True)
    assert rasters == {pack_square.COARSE}
    assert 0.5 * pack(bars(0), faces).coverage < rough.coverage < pack(bars(0), faces).coverage
    assert rasters == {pack_square.COARSE, pack_square.FINE}
    low, high = (np.array([f(p, axis=0) for p in rough.islands]) for f in (np.min, np.max))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
    assert gap[~np.eye(14, dtype=bool)].min() >= 4 / 1024 - 1e-9


def test_many_slim_islands_fill_the_square():
    """Hair cards, most of which are packed in blocks."""
    rng = np.random.default_rng(0)
    sizes = rng.uniform([0.03, 0.1], [0.05, 0.8], (150, 2))
    islands = [np.array([[0, 0], [w, 0], [w, h], [0, h]]) for w, h in sizes]
    result = pack(islands, [np.array([[0, 1, 2], [0, 2, 3]])] * 150)
    assert result.coverage > 0.25
    low, high = (np.array([f(p, axis=0) for p in result.islands]) for f in (np.min, np.max))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
    assert gap[~np.eye(150, dtype=bool)].min() >= 4 / 1024


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_do_not_matter(unit):
    plain, scaled = (pack(corners(5, unit=u), [FAN] * 5) for u in (1.0, unit))
    # Single precision may change a choice of the packer, but not how well it does.
    assert scaled.scale * unit == pytest.approx(plain.scale, rel=0.1)


def test_very_different_sizes():
    islands = [corner(100, 100), *corners(12, unit=1e-3)]
    result = pack(islands, [FAN] * 13, 2, 1024)
    assert least_distance(result.islands) >= 2 / 1024
    assert np.ptp(result.islands[0], axis=0).max() == pytest.approx(100 * result.scale)


def test_specks_do_not_make_the_others_smaller():
    """They are smaller than a cell of the raster."""
    islands = corners(6)
    plain, more = pack(islands, [FAN] * 6), pack([*islands, *corners(3, 1, 1e-7)], [FAN] * 9)
    assert more.scale > 0.8 * plain.scale
    assert least_distance(more.islands) >= 4 / 1024


def test_thousands_of_islands_that_no_texture_shows_take_no_room():
    # Remains of faces without area: a margin around each would fill the square.
    rng = np.random.default_rng(3)
    large, crumbs = corners(5), [1e-7 * rng.uniform(0.5, 1) * corner(1, 1) for _ in range(4000)]
    alone = pack(large, [FAN] * 5, 4, 1024)
    mixed = pack([*crumbs[:2000], *large, *crumbs[2000:]], [FAN] * 4005, 4, 1024)
    assert mixed.scale > 0.97 * alone.scale
    placed = [*mixed.islands[:2000], *mixed.islands[2005:]]
    for given, found in zip(crumbs, placed, strict=True):
        assert np.ptp(found, axis=0).max() == pytest.approx(mixed.scale * np.ptp(given, axis=0).max(), rel=1e-5)
    # Each has a place of its own in single precision, and these lie within a few pixels of each other.
    middle = np.array([p.mean(axis=0) for p in placed], np.float32)
    assert len(np.unique(middle, axis=0)) == len(middle)
    assert np.ptp(middle, axis=0).max() < 4 / 1024
    assert np.linalg.norm(middle - middle[0], axis=1).max() < least_distance([*mixed.islands[2000:2005], placed[0]])


def test_a_folded_island_is_placed_all_the_same():
    points = corner(2, 3)
    points[3] = [5, 5]
    result = pack([points, corner(1, 1)], [FAN, FAN], 4, 256)
    assert np.concatenate(result.islands).min() >= 0


@pytest.mark.parametrize("margin, texture_size, count", [(128, 128, 1), (200, 128, 1), (60, 128, 9)])
def test_margins_that_leave_no_room(margin, texture_size, count):
    with pytest.raises(MarginError, match="texture size"):
        pack(corners(count), [FAN] * count, margin, texture_size)


def test_stack_centres_at_one_scale():
    islands = corners(5)
    result = stack(islands)
    sizes = [np.ptp(p, axis=0).max() for p in result.islands]
    assert max(sizes) == pytest.approx(1)
    for before, after in zip(islands, result.islands, strict=True):
        np.testing.assert_allclose(0.5 * (after.min(axis=0) + after.max(axis=0)), 0.5)
        np.testing.assert_allclose(np.ptp(after, axis=0), result.scale * np.ptp(before, axis=0))


def test_slivers_that_single_precision_turns_over_tear_no_island():
    n = 8192
    turn = 2 * np.pi * np.arange(n) / n
    cap = np.column_stack([np.cos(turn), np.sin(turn)]).astype(np.float32).astype(float)
    ears = [np.arange(0, n, 2 * s)[:, None] + [0, s, 2 * s] for s in 2 ** np.arange(12)]
    islands = pack([cap, cap, 0.5 * cap], [np.concatenate(ears) % n] * 3, 4, 1024).islands
    radius = [np.ptp(p, axis=0).max() / 2 for p in islands]
    centre = [(p.min(axis=0) + p.max(axis=0)) / 2 for p in islands]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert np.linalg.norm(centre[i] - centre[j]) > radius[i] + radius[j] + 3.9 / 1024


@pytest.mark.parametrize("size", [0.5, 0.8])
def test_islands_are_packed_around_those_that_stay(size):
    stays = size * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + 0.1
    square = np.array([[0, 1, 2], [0, 2, 3]])
    found = pack(corners(4), [FAN] * 4, 8, 1024, [(stays, square)])
    points = np.concatenate([outline(p) for p in found.islands])
    away = np.maximum(stays.min(axis=0) - points, points - stays.max(axis=0)).max(axis=1)
    assert away.min() >= 8 / 1024 - 1e-9
    assert points.min() >= 4 / 1024 - 1e-9 and points.max() <= 1 - 4 / 1024 + 1e-9
    assert least_distance(found.islands) >= 8 / 1024


def test_the_largest_island_stays_upright_and_none_is_upside_down():
    islands = [corner(10, 9), *corners(6, 2)]
    found = pack(islands, [FAN] * 7)
    turns = []
    for before, after in zip(islands, found.islands, strict=True):
        turns.append(np.linalg.lstsq(before - before.mean(axis=0), after - after.mean(axis=0), rcond=None)[0])
    np.testing.assert_allclose(turns[0] / found.scale, np.eye(2), atol=1e-9)
    assert min(turn[0, 0] for turn in turns) > -1e-9


def test_a_single_island_is_in_the_middle_as_it_was():
    island = corner(2, 3, 0.4)
    packed = pack([island], [FAN])
    (found,) = packed.islands
    np.testing.assert_allclose(0.5 * (found.min(axis=0) + found.max(axis=0)), 0.5)
    np.testing.assert_allclose(found - found[0], packed.scale * (island - island[0]))


def test_where_islands_come_from_plays_no_part_in_blocks_either(monkeypatch):
    """Islands far from the origin, and more than are placed one by one: inside, apart, and where they were from 0."""
    monkeypatch.setattr(pack_square, "MOST_ITEMS", 16)
    monkeypatch.setattr(pack_square, "BLOCKS", 4)
    rng = np.random.default_rng(1)
    there = [corner(*rng.uniform(0.5, 2, 2), rng.uniform(0, 7)) for _ in range(24)]
    shifted = [points + rng.uniform(-30, 30, 2) for points in there]
    here, found = (pack(islands, [FAN] * 24, 1, 128).islands for islands in (there, shifted))
    for old, new in zip(here, found, strict=True):
        np.testing.assert_allclose(new, old, atol=1e-9)
    points = np.concatenate(found)
    assert points.min() > 0 and points.max() < 1 and least_distance(found) >= 1 / 128


@pytest.mark.parametrize("make", [hard_meshes.strip, hard_meshes.fan])
def test_memory_grows_no_faster_than_the_points_of_an_island(make):
    """Every point beside every other one were sixteen times as much for four times the points: gigabytes."""

    def peak(count):
        V, polygons = make(count)
        island = V[:, :2] * [1, 100]
        triangles = polygons[:, :3] if polygons.shape[1] == 3 else polygons[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
        tracemalloc.start()
        pack([island, corner(1, 1)], [triangles, FAN])
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    assert peak(16_000) < 5 * peak(4_000)


@pytest.mark.parametrize("exponent", [-1000, -450, 450, 900])
def test_islands_of_any_size_are_packed_alike(exponent):
    points = [np.array([[0, 0], [w, 0], [w, 1], [0, 1.0]]) for w in (1.0, 1.5, 2.0)]
    faces = [np.array([[0, 1, 2], [0, 2, 3]])] * 3
    before = drain(pack_square.pack(points, faces))
    after = drain(pack_square.pack([np.ldexp(p, exponent) for p in points], faces))
    assert all(np.array_equal(a, b) for a, b in zip(before.islands, after.islands, strict=True))
    assert after.scale == np.ldexp(before.scale, -exponent)


def test_no_order_is_tried_twice_at_a_scale(monkeypatch):
    tried, scales, real = [], [], (pack_square.place, pack_square._rasterised)

    def place(items, order, grid):
        tried.append((scales[-1], tuple(order)))
        return real[0](items, order, grid)

    def rasterised(task, scale):
        scales.append((task.raster, scale))
        return real[1](task, scale)

    monkeypatch.setattr(pack_square, "place", place)
    monkeypatch.setattr(pack_square, "_rasterised", rasterised)
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    pack([square, 2 * square, square * [3, 0.5]], [np.array([[0, 1, 2], [0, 2, 3]])] * 3)
    assert len(tried) > 6 and len(set(tried)) == len(tried)


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("shift", [(-0.3, 0.1), (0.1, -0.3), (-0.3, -0.25), (0.6, 0.7), (0.75, 0.2)], ids=str)
def test_what_stays_keeps_its_room_where_it_lies_over_a_border(shift, quarters):
    """A slender L, at every side and corner of the square: nothing comes nearer to it than the margin."""
    turn = rotation(quarters * np.pi / 2).round()
    stays = (corner(0.8, 0.45) + shift - 0.5) @ turn.T + 0.5
    found = pack(corners(5), [FAN] * 5, 8, 256, [(stays, FAN)]).islands
    points = np.concatenate([outline(p) for p in found])
    assert points.min() >= 4 / 256 - 1e-9 and points.max() <= 1 - 4 / 256 + 1e-9
    assert least_distance([*found, stays]) >= 8 / 256 - 1e-9
    sides = [cross2(stays[b] - stays[a], points - stays[a]) for a, b in zip(FAN, np.roll(FAN, -1, axis=1), strict=True)
             for a, b in zip(a, b, strict=True)]  # fmt: skip
    assert not (np.reshape(sides, (len(FAN), 3, -1)) > 0).all(axis=1).any()
