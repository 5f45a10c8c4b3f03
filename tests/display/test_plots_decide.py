"""What is drawn of points that are none, of one place, and of meshes without extent."""

from __future__ import annotations

import numpy as np
import pytest


def test_slopes_are_of_points_that_have_logarithms(package):
    slope = package("display.plots").slope
    points = [(x, 2 * x**-0.5) for x in (1.0, 4.0, 9.0)]
    for given in (points, [*points, (0.0, 1.0), (1.0, 0.0), (-2.0, 3.0), (2.0, -1.0)]):
        assert slope(given) == pytest.approx(-0.5)
    for given in ([], points[:1], [(2.0, 1.0), (2.0, 3.0)], [(2.0, 1.0), (0.0, 3.0)]):
        assert np.isnan(slope(given))


def test_a_plot_of_nothing_says_so_and_of_one_point_is_drawn(package):
    plots = package("display.plots")
    nothing = plots.plot({"a": [(0.0, 1.0)], "b": []}, "title")
    some = plots.plot({"a": [(3.0, 5.0)], "b": [(-1.0, 2.0)]}, "title")
    assert nothing.shape == some.shape and nothing.min() >= 0 and some.max() <= 1
    assert (some < 0.99).any(axis=2).sum() > 2 * (nothing < 0.99).any(axis=2).sum() > 0


@pytest.mark.parametrize("extent", [(2.0, 1.0), (0.0, 3.0), (0.0, 0.0)])
def test_whatever_is_drawn_is_in_the_middle_and_fits(package, extent):
    preview = package("display.preview")
    low = np.array([5.0, -3.0])
    high = low + extent
    flat = np.array([[low, high, (low + high) / 2]])
    found = preview._fitted(flat, (low, high), 100)
    np.testing.assert_allclose(found[0, 2], 50)
    size = (1 - 2 * preview.FREE) * 100
    largest = max(extent)
    np.testing.assert_allclose(np.ptp(found[0], axis=0), np.array(extent) * (size / largest if largest else 0))
