"""Crumbs: islands that no texture shows lie in one heap, and come out of it as they went in."""

import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.packing.crumbs import gathered

TRIANGLE, QUAD = np.array([[0, 1, 2]]), np.array([[0, 1, 2], [0, 2, 3]])


def mixed(count, seed=0, size=5e-4):
    """Islands of which every third is large, and all triangles."""
    rng = np.random.default_rng(seed)
    points, triangles = [], []
    for k in range(count):
        unit = 1.0 if k % 3 == 0 else size
        corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])[: 4 if k % 2 else 3]
        # Any corner may come first.
        corners = np.roll(corners, k // 3, axis=0)
        points.append(unit * corners * rng.uniform(0.4, 1, 2) ** 4 + rng.normal(size=2))
        triangles.append(QUAD if k % 2 else TRIANGLE)
    return points, triangles


@pytest.mark.parametrize("seed", range(5))
def test_every_island_comes_out_in_its_place_moved_alone(seed):
    points, triangles = mixed(1200, seed)
    heaped = gathered(points, triangles, 4, 1024)
    assert len(heaped.points) == 401 and heaped.crumb.sum() == 800
    found = heaped.apart(heaped.points)
    for before, after in zip(points, found, strict=True):
        np.testing.assert_allclose(after - after[0], before - before[0], rtol=0, atol=1e-13)
    heap, index = heaped.points[-1], heaped.triangles[-1]
    assert (signed_areas(heap, index) > 0).all() and index.max() == len(heap) - 1
    small = [found[k] for k in np.flatnonzero(heaped.crumb)]
    low, high = (np.array([f(p, axis=0) for p in small]) for f in (np.min, np.max))
    # No box meets another.
    apart = (low[:, None] > high[None]) | (low[None] > high[:, None])
    assert (apart.any(axis=2) | np.eye(len(small), dtype=bool)).all()


@pytest.mark.parametrize("count, size, margin", [(1200, 1e-2, 4), (30, 1e-7, 4), (1200, 1e-7, 0)])
def test_what_shows_or_whose_margins_take_little_stays_by_itself(count, size, margin):
    points, triangles = mixed(count, size=size)
    heaped = gathered(points, triangles, margin, 1024)
    assert not heaped.crumb.any() and heaped.points == points and heaped.triangles == triangles
    assert heaped.apart(points) == points


def test_crumbs_alone_are_islands_as_any_others():
    points, triangles = mixed(1200)
    small = [k for k in range(1200) if k % 3]
    heaped = gathered([points[k] for k in small], [triangles[k] for k in small], 4, 1024)
    assert not heaped.crumb.any() and len(heaped.points) == 800


@pytest.mark.parametrize("seed", range(3))
def test_marks_of_islands_go_with_those_that_are_by_themselves_and_a_heap_has_none(seed):
    """As whether an island may be turned: the boxes of those in a heap would meet."""
    points, triangles = mixed(1200, seed)
    heaped, marks = gathered(points, triangles, 4, 1024), np.random.default_rng(seed).random(1200) < 0.5
    assert heaped.kept(marks).tolist() == [*marks[~heaped.crumb].tolist(), False]
    assert gathered(points, triangles, 0, 1024).kept(marks) is marks


def test_what_is_long_shows_however_thin_it_is():
    points, triangles = mixed(1200)
    thin = [np.array([[0, 0], [0.5, 0], [0.5, 1e-7]]), np.array([[0, 0], [1e-7, 0], [0, 0.5]])]
    heaped = gathered([*points, *thin], [*triangles, TRIANGLE, TRIANGLE], 4, 1024)
    assert heaped.crumb.sum() == 800 and not heaped.crumb[-2:].any()


@pytest.mark.parametrize("unit", [2.0**-20, 2.0**20])
@pytest.mark.parametrize("size", [5e-4, 1e-2, 1e-12])
def test_crumbs_are_the_same_in_every_unit(unit, size):
    """Those as well that are so small that their size says nothing about how far apart they are to lie."""
    points, triangles = mixed(1200, size=size)
    plain, other = (gathered([u * p for p in points], triangles, 4, 1024) for u in (1.0, unit))
    assert np.array_equal(other.crumb, plain.crumb) and plain.crumb.any() == (size < 1e-3)
    for a, b in zip(plain.points, other.points, strict=True):
        np.testing.assert_allclose(b / unit, a, rtol=1e-12)
