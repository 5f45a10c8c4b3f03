"""Points at which the branches of a tree meet."""

import numpy as np
import pytest
from scipy.sparse.csgraph import minimum_spanning_tree

from omt_uv.solver.cutting.steiner_points import _tree_costs, meeting_points


def distances(points, ends):
    return np.linalg.norm(points[ends][:, None] - points, axis=2)


def test_three_ends_meet_in_the_middle():
    angle = 2 * np.pi * np.arange(3) / 3
    points = np.concatenate([np.column_stack([np.cos(angle), np.sin(angle)]), [[0, 0], [0.2, 0.1], [3, 3]]])
    distance = distances(points, [0, 1, 2])
    assert meeting_points(distance, distance[:, :3]).tolist() == [3]


def test_ends_on_a_line_need_no_point():
    points = np.column_stack([np.arange(5.0), np.zeros(5)])
    distance = distances(points, [0, 2, 4])
    assert len(meeting_points(distance, distance[:, [0, 2, 4]])) == 0


def test_what_saves_less_than_a_tenth_is_no_branch():
    points = np.array([[-1, 0], [1, 0], [0, 1], [0, 0.577]])
    distance = distances(points, [0, 1, 2])
    direct = distance[2, 0] + distance[2, 1]
    assert 0 < 1 - distance[:, 3].sum() / direct < 0.1
    assert len(meeting_points(distance, distance[:, :3])) == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_tree_through_the_point_is_shorter_in_any_order_of_the_ends(seed):
    points = np.random.default_rng(seed).random((500, 2))
    distance = distances(points, [0, 1, 2])
    found = [meeting_points(distance[order], distance[order][:, order]) for order in ([0, 1, 2], [2, 0, 1])]
    np.testing.assert_array_equal(*found)
    direct = distance[:, :3].sum() / 2 - distance[:, :3].max()
    assert all(distance[:, point].sum() < direct for point in found[0])


def test_trees_are_as_short_as_those_of_another_program():
    rng = np.random.default_rng(3)
    points = rng.random((40, 9, 2))
    between = np.linalg.norm(points[:, :, None] - points[:, None], axis=3)
    expected = [minimum_spanning_tree(one).sum() for one in between]
    np.testing.assert_allclose(_tree_costs(between), expected, rtol=1e-12)


@pytest.mark.parametrize("unit", [1e-9, 1e-2, 1e3, 1e9])
@pytest.mark.parametrize("flat", [1.0, 0.2])
def test_where_branches_meet_hangs_on_no_unit_of_length(unit, flat):
    """Three ends meet where that saves a tenth, in whatever unit, and in none where it does not."""
    points = np.random.default_rng(0).random((300, 2)) + [2, 0]
    angle = 2 * np.pi * np.arange(3) / 3
    points[:3], points[3] = np.column_stack([np.sin(angle), flat * np.cos(angle)]), 0
    distance = distances(points, range(3))
    plain = meeting_points(distance, distance[:, :3])
    assert plain.tolist() == ([] if flat < 0.5 else [3])
    np.testing.assert_array_equal(meeting_points(unit * distance, unit * distance[:, :3]), plain)
