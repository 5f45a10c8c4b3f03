"""Overlap: shares that are known, and what they do not depend on."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps import overlap
from omt_uv.solver.maps.overlap import overlap_exceeds, overlap_share


def square(n=8):
    V, F = meshes.grid(n, n)
    return V[:, :2][F]


def test_a_map_that_covers_nothing_twice():
    assert overlap_share(square()) == 0


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 1.0])
def test_two_squares_that_are_shifted(shift):
    """Both lie under two faces where they meet, (1 - shift) of each."""
    uv = np.concatenate([square(), square() + [shift, 0]])
    assert overlap_share(uv) == pytest.approx(1 - shift, abs=0.01)


def test_mirror_images_turns_and_scales_change_nothing():
    uv = np.concatenate([square(), square() + [0.5, 0.3]])
    expected = overlap_share(uv)
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    for other in (uv * [-1, 1], 1e6 * uv + 1e7, uv @ turn):
        assert overlap_share(other) == pytest.approx(expected, abs=0.01)


def test_the_same_seed_gives_the_same_share():
    uv = np.random.default_rng(0).random((50, 3, 2))
    assert overlap_share(uv, samples=1000, seed=3) == overlap_share(uv, samples=1000, seed=3)
    assert 0 < overlap_share(uv, samples=1000) <= 1


def strips(gap):
    """Triangles of a square and of one `gap` to its right, turned, every other one mirrored, as a file has them."""
    uv = np.concatenate([square(), square() + [1 + gap, 0]]) @ np.array([[0.8, -0.6], [0.6, 0.8]])
    uv[::2] = uv[::2, ::-1]
    return uv.astype(np.float32)


def test_triangles_that_touch_need_no_samples(monkeypatch):
    expected = overlap_share(strips(-1e-3))
    monkeypatch.setattr("omt_uv.solver.maps.overlap._draw", None)
    assert overlap_share(strips(0.0)) == 0 and overlap_share(strips(1e-3)) == 0
    with pytest.raises(TypeError):
        overlap_share(strips(-1e-3))
    assert expected == pytest.approx(1e-3, rel=0.2)


@pytest.mark.parametrize("width", [1e-4, 1e-3, 0.03, 0.1, 0.3])
def test_pairs_say_what_samples_say(monkeypatch, width):
    """Of triangles by chance, small ones apart and larger ones over one another."""
    rng = np.random.default_rng(1)
    uv = rng.random((30, 1, 2)) + width * rng.normal(size=(30, 3, 2))
    found = overlap_share(uv)
    monkeypatch.setattr("omt_uv.solver.maps.overlap.PAIR_WORK", np.inf)
    assert found == overlap_share(uv) and (found > 0) == (width > 0.01)


def test_a_map_without_area():
    assert overlap_share(np.zeros((4, 3, 2))) == 0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [0.0, 1.0])
def test_a_part_without_area_is_covered_by_nothing(size):
    """A triangle in a point inside another one, or all in that point."""
    flat = np.array([0, size, 1j * size, 0.2 * size * (1 + 1j)])
    triangles = np.array([[0, 1, 2], [3, 3, 3]])
    assert overlap.part_covered(flat, triangles, np.array([1])) == 0
    assert overlap.covers_little(flat, triangles, np.array([1]), (0.0, 0.0), 100)


@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_samples_are_looked_at_in_parts_of_any_size(chunk, monkeypatch):
    rng = np.random.default_rng(0)
    uv = rng.random((30, 1, 2)) + 0.3 * rng.random((30, 3, 2))
    share = overlap.overlap_share(uv, samples=500)
    points = rng.random((40, 2))
    pairs = overlap.cover_pairs(uv, points)
    monkeypatch.setattr(overlap, "CHUNK", chunk)
    assert overlap.overlap_share(uv, samples=500) == share > 0
    for one, other in zip(overlap.cover_pairs(uv, points), pairs, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("first", [1, 3, 10**6])
def test_who_is_asked_first_decides_nothing(first, monkeypatch):
    """Triangles by chance, of which dozens lie in a cell, and points in none, in one and in many."""
    rng = np.random.default_rng(2)
    uv = rng.random((300, 1, 2)) + 0.12 * rng.normal(size=(300, 3, 2))
    points = rng.random((500, 2))
    point, _ = overlap.cover_pairs(uv, points)
    number = np.bincount(point, minlength=len(points))
    monkeypatch.setattr(overlap, "ASKED_FIRST", first)
    np.testing.assert_array_equal(overlap._Grid(uv).covered_twice(points), number > 1)
    assert set(number[number < 3]) == {0, 1, 2} and number.max() > 5


def test_a_coarser_grid_finds_the_same(monkeypatch):
    """Long triangles lie in many cells, and lists of these would fill the memory."""
    rng = np.random.default_rng(0)
    uv = rng.random((400, 1, 2)) + rng.normal(size=(400, 3, 2)) * [1.0, 0.01]
    found = overlap_share(uv)
    monkeypatch.setattr(overlap, "MOST_ENTRIES", 1)
    monkeypatch.setattr(overlap, "AT_ONCE", 7)
    grid = overlap._Grid(uv)
    assert len(grid.owner) <= 8 * len(uv) and grid.side < overlap._Grid(uv[:1]).side * 20
    assert overlap_share(uv) == found > 0.1


@pytest.mark.parametrize("shift", [0.2, 0.9, 0.999, 1.0, 3.0])
def test_overlap_exceeds_bounds_where_it_is_above_any_of_them(shift):
    square = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    uv = np.concatenate([square, square + [shift, 0]])
    for bounds in ([(100, 0.5), (4000, 0.01)], [(4000, 0.0)], [(100, 1.0), (100, 0.9)], []):
        above = any(overlap_share(uv, samples=samples) > share for samples, share in bounds)
        assert overlap_exceeds(uv, bounds) == above
    assert overlap_exceeds(uv, [(4000, 0.0)]) == (shift < 0.9995)


@pytest.mark.parametrize("points", [0.9, 1.05, 1.5, 1.9, 4.0])
def test_what_more_than_a_point_stands_for_is_found_on_average_and_what_less_does_never(points):
    """Two triangles that look at one another, over which so many of the samples lie."""
    samples, seeds = 2000, 60
    # w - 3/4 w^2 is what they have in common where they overlap by w, of an area of 1/2 each; a point of it is of both.
    w = points / (2 * samples)
    left = np.array([[0.0, 0.5], [1.0, 0.0], [1.0, 1.0]])
    uv = np.stack([left, left * [-1, 1] + [2 - w, 0]])
    found = [overlap_share(uv, samples=samples, seed=seed) * samples for seed in range(seeds)]
    if points < 1:
        assert not any(found)
    else:
        assert np.mean(found) == pytest.approx(points, abs=4 * np.sqrt(points / seeds))
