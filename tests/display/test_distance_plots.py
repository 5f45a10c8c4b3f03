"""Pictures of distances: what is far is light, neighbours stand together, and nobody is left out."""

from __future__ import annotations

import numpy as np
import pytest

NAMES = ["ape", "bee", "cat", "dog"]
PLACES = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 2.0]])


@pytest.fixture
def plots(package):
    return package("display.distance_plots")


def distances():
    return np.linalg.norm(PLACES[:, None] - PLACES, axis=2)


def inside(plots, picture, row, column):
    """The colour of a cell of the matrix."""
    at = [plots.MARGIN + int((k + 0.5) * plots.SIDE / len(NAMES)) for k in (row, column)]
    return picture[at[0], at[1]]


@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("factor", [1e-300, 1.0, 1e300])
def test_cells_are_as_light_as_they_are_far_and_unknown_ones_have_a_colour(plots, unknown, factor):
    values = factor * distances()
    values[0, 3] = unknown
    picture = plots.matrix_picture(values)
    for i in range(4):
        for j in range(4):
            colour = inside(plots, picture, i, j)
            if (i, j) == (0, 3):
                assert np.ptp(colour) > 0.05
            else:
                np.testing.assert_allclose(colour, distances()[i, j] / distances().max(), atol=1e-6)
    # Rows of one class stand together: 0, 2, 1, 3.
    sorted_ = plots.matrix_picture(distances(), ["even", "odd", "even", "odd"])
    for (i, j), (a, b) in {(0, 1): (0, 2), (1, 2): (2, 1), (3, 0): (3, 0)}.items():
        np.testing.assert_allclose(inside(plots, sorted_, i, j), distances()[a, b] / distances().max(), atol=1e-6)


@pytest.mark.parametrize("k", range(4))
def test_every_name_class_and_point_is_drawn(plots, k):
    without = [*NAMES[:k], "", *NAMES[k + 1 :]]
    whole = plots.map_picture(PLACES, NAMES)
    assert (whole != plots.map_picture(PLACES, without)).any()
    x, y = plots.MARGIN + plots.SIDE / 2 + (PLACES[k] - [1.5, 1.0]) / 3 * [plots.SIDE, -plots.SIDE]
    assert whole[round(y), round(x)].max() - whole[round(y), round(x)].min() > 0.1
    classes = ["even", "odd", "even", "odd"]
    coloured = plots.map_picture(PLACES, NAMES, classes)
    assert (coloured != whole).any() and (coloured[round(y), round(x)] != whole[round(y), round(x)]).any() == (k % 2)
    matrix = plots.matrix_picture(distances(), classes)
    other = plots.matrix_picture(distances(), [*classes[:k], "none", *classes[k + 1 :]])
    assert (matrix != other).any()


def test_names_of_classes_stand_beside_their_rows(package):
    plots = package("display.distance_plots")
    classes = ["low"] * 2 + ["high"] * 5 + ["mid"] * 3
    picture = plots.matrix_picture(np.ones((10, 10)), classes)
    begin = 0
    for k, (_, count) in enumerate(sorted([("low", 2), ("high", 5), ("mid", 3)])):
        colour = plots.COLOURS[k]
        right = picture[:, plots.MARGIN + plots.SIDE + 1 :]
        rows = np.argwhere(np.abs(right - colour).max(axis=2) < 0.05)[:, 0]
        low, high = (plots.MARGIN + x * plots.SIDE / 10 for x in (begin, begin + count))
        begin += count
        assert len(rows) > 10 and low < rows.min() and rows.max() < high
        # In the middle of them.
        assert abs((rows.min() + rows.max()) / 2 - (low + high) / 2) < 10
