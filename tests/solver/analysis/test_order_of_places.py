"""The order of vertices by their places: a file's own order plays no part."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.order_of_places import lowest_first, order_of_places, order_of_rows


def test_the_order_of_a_file_plays_no_part():
    V, F = meshes.head()
    random = np.random.default_rng(0)
    shuffle = random.permutation(len(V))
    other = np.argsort(shuffle)[F][random.permutation(len(F))]
    order = order_of_places(V[shuffle], other)
    assert np.array_equal(np.sort(order), np.arange(len(V)))
    assert np.array_equal(V[order_of_places(V, F)], V[shuffle][order])


@pytest.mark.parametrize("power", [-1000, -40, 40, 1021])
def test_the_unit_plays_no_part(power):
    """Sums of coordinates near the largest number are infinite: a mesh there ended in an error of linear algebra."""
    V, F = meshes.head()
    V = V / np.abs(V).max()
    assert np.array_equal(order_of_places(np.ldexp(V, power), F), order_of_places(V, F))


@pytest.mark.parametrize("seed", range(3))
def test_neither_pose_nor_place_plays_a_part(seed):
    V, F = meshes.head()
    V = V * [1.0, 1.6, 0.7] + 0.1 * V[:, [1, 2, 0]] ** 2
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn[0] *= np.linalg.det(turn)
    assert np.array_equal(order_of_places(V @ turn + [3, -1, 2], F), order_of_places(V, F))


def test_vertices_in_one_place_go_by_their_triangles():
    """As along a cut: two triangles that touch, each with vertices of its own."""
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
    F = np.array([[0, 1, 2], [3, 5, 4]])
    swapped = np.array([3, 1, 4, 2, 0, 5])
    order, other = order_of_places(V, F), order_of_places(V[swapped], np.argsort(swapped)[F])
    assert np.array_equal(order, swapped[other])


def test_triangles_begin_at_their_lowest_vertex():
    F = np.array([[4, 2, 7], [1, 3, 2], [5, 6, 0]])
    turned, corners = lowest_first(F)
    assert np.array_equal(turned, [[2, 7, 4], [1, 3, 2], [0, 5, 6]])
    assert np.array_equal(np.take_along_axis(F, corners, axis=1), turned)


@pytest.mark.parametrize("far", [1e100, -1e300, 2.7e307, 1.7e308])
def test_points_that_are_much_farther_away_than_they_are_apart_have_an_order(far):
    """All in one place along two axes: what is left of them there plays no part."""
    z = np.random.default_rng(0).normal(size=90)
    triangles = np.arange(90).reshape(-1, 3)
    near = order_of_places(np.column_stack([np.zeros(90), np.zeros(90), z]), triangles)
    found = order_of_places(np.column_stack([np.full(90, far), np.full(90, -far), z]), triangles)
    np.testing.assert_array_equal(found, near)
    assert (np.diff(z[found]) >= 0).all()


@pytest.mark.parametrize("bits", [(3, 4, 5), (40, 20, 2), (62, 62), (0, 1)])
def test_the_order_of_rows_is_that_of_their_columns(bits):
    rng = np.random.default_rng(0)
    columns = [rng.integers(0, 1 << b, 500) for b in bits]
    assert (order_of_rows(*columns) == np.lexsort(columns[::-1])).all()


@pytest.mark.parametrize("seed", range(4))
def test_along_a_cut_rounding_of_what_lies_around_decides_nothing(seed):
    """Both sides of a tube that is cut open are mirror images: only across the cut are their triangles elsewhere."""
    rows, around = 7, 12
    turn, height = np.meshgrid(2 * np.pi * np.arange(around + 1) / around, np.linspace(0, 3.1, rows))
    V = np.column_stack([1.3 * np.cos(turn.ravel()), np.sin(turn.ravel()), height.ravel()])
    V[around :: around + 1] = V[:: around + 1]
    F = meshes.grid(around, rows - 1)[1]
    order, rng = order_of_places(V, F), np.random.default_rng(seed)
    for _ in range(5):
        shuffle = rng.permutation(len(V))
        other = np.argsort(shuffle)[np.roll(F, rng.integers(3), axis=1)][rng.permutation(len(F))]
        assert np.array_equal(shuffle[order_of_places(V[shuffle], other)], order)


@pytest.mark.parametrize("seed", range(3))
def test_points_nearer_to_each_other_than_cells_are_wide_have_an_order_of_their_own(seed):
    """Though no triangle tells them apart."""
    rng = np.random.default_rng(seed)
    V, F = meshes.head()
    close = V[7] + 1e-9 * np.ptp(V, axis=0) * rng.random((20, 3))
    points = np.concatenate([V, close])
    shuffle = np.concatenate([np.arange(len(V)), len(V) + rng.permutation(20)])
    found, other = order_of_places(points, F), order_of_places(points[shuffle], F)
    assert np.array_equal(points[found], points[shuffle][other])
