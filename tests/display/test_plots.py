"""Curves: their exponents, and that points, lines and names lie where they belong."""

from __future__ import annotations

import numpy as np
import pytest


def coloured(picture, colour):
    """Rows and columns of pixels of a colour."""
    return np.argwhere(np.abs(picture - colour).max(axis=2) < 0.02)


def test_exponents(package):
    plots = package("display.plots")
    x = np.array([1.0, 10, 200, 3000])
    for p in (-1.5, 0.0, 2.0):
        assert plots.slope(list(zip(x, 7 * x**p, strict=True))) == pytest.approx(p, abs=1e-12)
    assert plots.slope([(1, 2), (4, 8), (0, 5), (3, -1)]) == pytest.approx(1)
    assert np.isnan(plots.slope([(1, 2)])) and np.isnan(plots.slope([(2, 1), (2, 5)])) and np.isnan(plots.slope([]))


@pytest.mark.parametrize("cloud", [False, True])
def test_points_and_names_have_places_and_colours_of_their_own(package, cloud):
    plots = package("display.plots")
    curves = {"rising": [(10, 1), (1000, 100)], "falling": [(10, 100), (100, 10), (1000, 1)]}
    picture = plots.plot(curves, "title", cloud)
    assert picture.shape == (plots.HEIGHT, plots.WIDTH, 3) and picture.min() >= 0 and picture.max() <= 1
    right, low = plots.WIDTH - plots.RIGHT, plots.HEIGHT - plots.BOTTOM
    ends = []
    for k in range(2):
        place = coloured(picture, plots.COLOURS[k])
        inside = place[place[:, 1] < right]
        assert inside[:, 0].min() > plots.TOP and inside[:, 0].max() < low and inside[:, 1].min() > plots.LEFT
        # The name stands to the right of the curves, one below the other, and whole.
        name = place[place[:, 1] >= right]
        assert len(name) > 20 and name[:, 1].max() < plots.WIDTH - 2 and name[:, 1].min() < right + 40
        assert abs(name[:, 0].mean() - (plots.TOP + 16 + 22 * k)) < 12
        first, last = inside[inside[:, 1].argmin()], inside[inside[:, 1].argmax()]
        ends.append((first, last))
    (low_first, high_last), (high_first, low_last) = ends
    # Up is more, right is more; both have the same ends.
    assert low_first[0] > high_last[0] and high_first[0] < low_last[0]
    assert abs(low_first[0] - low_last[0]) < 6 and abs(high_first[0] - high_last[0]) < 6
    assert abs(low_first[1] - high_first[1]) < 3 and abs(high_last[1] - low_last[1]) < 3
    middle = coloured(picture, plots.COLOURS[0])
    between = (middle[:, 1] > low_first[1] + 20) & (middle[:, 1] < high_last[1] - 20)
    assert between.any() == (not cloud)
    grey = coloured(picture, plots.GREY)
    # Lines of the grid from side to side, as many as 1, 2 and 5 times powers of ten there are.
    assert (np.bincount(grey[:, 0]) > 400).sum() == 7 and (grey[:, 1] <= right).all()


def test_what_is_not_positive_is_left_out(package):
    plots = package("display.plots")
    good = {"a": [(1, 1), (10, 10)]}
    more = {"a": [(1, 1), (10, 10), (0, 5), (5, -3)]}
    np.testing.assert_array_equal(plots.plot(good, "t"), plots.plot(more, "t"))
    empty = plots.plot({"a": [(0, 1)]}, "t")
    assert empty.min() < 0.5 and not np.array_equal(empty, plots.plot(good, "t"))
    # One point alone has room around it.
    assert len(coloured(plots.plot({"a": [(3, 3)]}, "t"), plots.COLOURS[0])) > 5


def test_discs_at_the_edge_of_a_picture_are_those_of_a_larger_one(package):
    """Wherever their middles are, within the picture or outside."""
    plots, rng = package("display.plots"), np.random.default_rng(0)
    at = np.concatenate(
        [rng.uniform(-6, 46, (60, 2)), [[0, 0], [39.5, 29.5], [0.5, 29.9], [39, 0], [-50, 10], [90, 5]]]
    )
    for radius in (0.8, 3.0, 5.5):
        small, large = np.ones((30, 40, 3)), np.ones((230, 240, 3))
        for middle in at:
            plots.dots(small, middle[None], (0.2, 0.4, 0.1), radius)
            plots.dots(large, middle[None] + 100, (0.2, 0.4, 0.1), radius)
        np.testing.assert_allclose(small, large[100:130, 100:140], atol=1e-12)
        assert small.min() < 0.5


@pytest.mark.parametrize("cloud", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_curve_is_drawn_from_left_to_right_however_its_points_come(package, cloud, seed):
    plots = package("display.plots")
    rng = np.random.default_rng(seed)
    points = [(10.0 * 3**k, 2.0 + rng.random()) for k in range(6)] + [(0.0, 1.0), (5.0, -1.0)]
    ordered = plots.plot({"a": points, "b": [(y, x) for x, y in points[:3]]}, "title", cloud)
    mixed = [points[k] for k in rng.permutation(len(points))]
    found = plots.plot({"a": mixed, "b": [(y, x) for x, y in points[2::-1]]}, "title", cloud)
    np.testing.assert_allclose(found, ordered, atol=1e-9)
