"""Turned to fit: closer than upright, and the same however islands lie when they come."""

import numpy as np
import pytest
from flat_islands import FAN, corner, corners, least_distance, rotation
from scipy.spatial import ConvexHull

from omt_uv.solver.errors import MarginError
from omt_uv.solver.packing.pack_square import pack
from omt_uv.solver.packing.turning import in_smallest_box, pack_turned
from omt_uv.solver.progress import drain

SQUARE = np.array([[0, 1, 2], [0, 2, 3]])


def turned(islands, **given):
    return drain(pack_turned(islands, [FAN] * len(islands), **given))


@pytest.mark.parametrize("count", [1, 2, 6])
def test_it_packs_closer_than_upright_and_keeps_the_margin(count):
    islands = [points @ rotation(0.6).T for points in corners(count)]
    upright, found = drain(pack(islands, [FAN] * count, 16)), turned(islands, margin=16)
    assert found.coverage > 1.05 * upright.coverage
    points = np.concatenate(found.islands)
    assert points.min() >= 8 / 1024 - 1e-9 and points.max() <= 1 - 8 / 1024 + 1e-9
    if count > 1:
        assert least_distance(found.islands) >= 16 / 1024
    for before, after in zip(islands, found.islands, strict=True):
        linear = np.linalg.lstsq(before - before.mean(axis=0), after - after.mean(axis=0), rcond=None)[0]
        # One scale, and turned, not mirrored.
        np.testing.assert_allclose(linear @ linear.T, found.scale**2 * np.eye(2), atol=1e-9)
        assert np.linalg.det(linear) > 0


@pytest.mark.parametrize("count", [1, 2, 5])
def test_how_islands_lay_before_does_not_matter(count):
    islands = corners(count)
    found = turned(islands)
    for angles in (np.linspace(0.3, 2.9, count), np.full(count, -1.1)):
        other = turned([p @ rotation(angle).T for p, angle in zip(islands, angles, strict=True)])
        assert other.coverage == pytest.approx(found.coverage, rel=1e-6)


def test_a_large_island_goes_on_any_side():
    """Two triangles that fill a square lie with their long sides together, however they come."""
    half = np.array([[0, 0], [1, 0], [0, 1.0]])
    found = drain(pack_turned([half, half], [np.array([[0, 1, 2]])] * 2, 0))
    assert found.coverage > 0.9
    beside = drain(pack([half, half], [np.array([[0, 1, 2]])] * 2, 0))
    assert beside.coverage < 0.6


def test_a_large_island_lies_where_it_packs_closest():
    """A thin bar by itself lies on the diagonal of the square."""
    bar = np.array([[0, 0], [10, 0], [10, 0.5], [0, 0.5]])
    (found,) = drain(pack_turned([bar], [SQUARE], 0)).islands
    along = found[1] - found[0]
    assert np.linalg.norm(along) > 1.3 and abs(abs(along[0]) - abs(along[1])) < 0.1
    assert drain(pack([bar], [SQUARE], 0)).coverage < 0.6 * 1.3**2 * 0.05 * 1.05


def test_only_what_is_loose_is_turned():
    islands = [corner(3, 2, 0.4), corner(2, 1, 0.7), corner(1, 1, 1.0)]
    found = turned(islands, turnable=np.array([True, False, True])).islands
    stays = np.array([0, 1, 3])
    for k, is_loose in enumerate([True, False, True]):
        before, after = (p[k][1:] - p[k][:1] for p in (islands, found))
        angle = np.arctan2(*(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)))
        quarters = np.round(angle / (np.pi / 2), 6) % 1
        assert (np.minimum(quarters, 1 - quarters)[stays].max() > 1e-3) == is_loose


def test_nothing_of_no_area_is_turned_and_what_has_no_room_is_told():
    flat = np.array([[0, 0], [1, 1], [2, 2], [3, 3.0]])
    found = drain(pack_turned([flat, corner(2, 1)], [SQUARE, FAN], 2))
    assert np.isfinite(np.concatenate(found.islands)).all() and found.coverage > 0
    with pytest.raises(MarginError):
        turned(corners(3), margin=2000)


def test_islands_that_stay_keep_their_room():
    stays = np.array([[0, 0], [0.5, 0], [0.5, 1], [0, 1]])
    found = turned(corners(3), around=[(stays, SQUARE)])
    assert np.concatenate(found.islands)[:, 0].min() >= 0.5


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_the_smallest_box_lies_along_a_side_of_the_hull(angle):
    uv = np.array([[0, 0], [4, 0], [4, 1], [0, 1], [9, 9]]) @ rotation(-angle).T
    found = in_smallest_box(uv, SQUARE)
    assert np.ptp(found[:4], axis=0) == pytest.approx([4, 1])
    np.testing.assert_allclose(np.linalg.norm(found[1] - found[2]), 1)
    # It is turned, not mirrored.
    a, b = found[1] - found[0], found[3] - found[0]
    assert a[0] * b[1] - a[1] * b[0] == pytest.approx(4)


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.5, 4.0])
def test_the_smallest_box_is_the_same_however_a_map_lay(angle):
    points = corner(3, 2, 0.4)
    found, expected = (in_smallest_box(points @ turn.T, FAN) for turn in (rotation(angle), np.eye(2)))
    np.testing.assert_allclose(found - found.mean(axis=0), expected - expected.mean(axis=0), atol=1e-9)
    height = found[ConvexHull(found).vertices, 1]
    assert np.ptp(found[:, 0]) >= np.ptp(found[:, 1]) and height.mean() <= (height.min() + height.max()) / 2


def test_islands_that_may_be_turned_are_all_by_default():
    """But for those of no area, which have no smallest box."""
    flat = np.array([[0, 0], [1, 3], [2, 6], [3, 9.0]])
    islands, triangles = [flat, *corners(3)], [SQUARE, FAN, FAN, FAN]
    found, asked = (drain(pack_turned(islands, triangles, 2, turnable=t)) for t in (None, np.ones(4, bool)))
    for one, other in zip(found.islands, asked.islands, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_large_island_that_may_not_be_turned_lies_as_it_lay():
    """But for quarter turns, as it has them where nothing is turned."""
    bar = np.array([[0, 0], [10, 0], [10, 0.5], [0, 0.5]])
    stays, plain = (
        drain(packing).islands[0]
        for packing in (pack_turned([bar], [SQUARE], 0, turnable=np.zeros(1, bool)), pack([bar], [SQUARE], 0))
    )
    np.testing.assert_allclose(stays, plain, atol=1e-12)
