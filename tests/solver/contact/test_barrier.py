"""What is asked for is come near to, and nothing meets on the way; what is held is where it shall be."""

from __future__ import annotations

import numpy as np
from bodies import icosphere

from omt_uv.solver.contact.barrier import brought
from omt_uv.solver.contact.new_crossings import NewCrossings
from omt_uv.solver.contact.self_intersections import FaceCrossings, intersecting_pairs


def two_balls(gap):
    """Two balls side by side with a gap between them."""
    V, F = icosphere(2)
    return np.concatenate([V, V + [np.ptp(V[:, 0]) + gap, 0.03, 0.02]]), np.concatenate([F, F + len(V)])


def test_where_nothing_is_close_the_goal_is_met():
    V, F = icosphere(2)
    goal = V * [1.2, 1.0, 0.9]
    at = brought(V, goal, NewCrossings(V, FaceCrossings(F)), np.ones(len(V), bool))
    np.testing.assert_allclose(at, goal, atol=1e-9)


def test_a_ball_that_is_pushed_gives_way_to_what_pushes():
    V, F = two_balls(0.05)
    held = np.zeros(len(V), bool)
    half = len(V) // 2
    held[half + V[half:, 0].argmin()] = True
    goal = V.copy()
    goal[held, 0] -= 0.4
    assert len(intersecting_pairs(goal, F))
    at = brought(V, goal, NewCrossings(V, FaceCrossings(F)), ~held)
    assert not len(intersecting_pairs(at, F))
    np.testing.assert_array_equal(at[held], goal[held])
    moved = np.linalg.norm(at - goal, axis=1)
    assert moved.max() < 0.45 and (moved > 0.01).mean() < 0.3


def test_points_that_pass_one_another_carry_what_is_between_them():
    """Two vertices of a coarse ball change places: its faces fold, and each step of the way keeps them apart."""
    V, F = icosphere(2)
    V = V * [1.0, 0.7, 0.12]
    ends = np.array([np.square(V - p).sum(axis=1).argmin() for p in ([0.1, 0, 0.12], [-0.1, 0.05, -0.12])])
    free = np.ones(len(V), bool)
    free[ends] = False
    crossings, at = NewCrossings(V, FaceCrossings(F)), V
    for _ in range(6):
        goal = at.copy()
        goal[ends] += [[-0.03, 0, -0.06], [0.03, 0, 0.06]]
        at = brought(at, goal, crossings, free)
        np.testing.assert_array_equal(at[ends], goal[ends])
    assert not len(intersecting_pairs(at, F))
    flat = V.copy()
    flat[ends] = at[ends]
    assert len(intersecting_pairs(flat, F)) > 5


def test_what_is_stuck_stops_nothing_else():
    """One ball is pushed against one that is held; another, far away, goes where it shall."""
    V, F = two_balls(0.05)
    half = len(V) // 2
    far, _ = icosphere(2)
    V, F = np.concatenate([V, far + [0, 9, 0]]), np.concatenate([F, F[: len(F) // 2] + len(V)])
    goal = V + np.where(np.arange(len(V)) < half, 0.5, 0.0)[:, None] * [1, 0, 0]
    goal[2 * half :] += [0, 0, 0.3]
    held = (np.arange(len(V)) >= half) & (np.arange(len(V)) < 2 * half)
    at = brought(V, goal, NewCrossings(V, FaceCrossings(F)), ~held)
    assert not len(intersecting_pairs(at, F))
    np.testing.assert_allclose(at[2 * half :], goal[2 * half :], atol=1e-6)
