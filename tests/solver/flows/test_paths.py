"""Paths start and end where they shall, turn evenly, and are the same way back."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.errors import HandleError, NonFiniteError
from omt_uv.solver.flows.handles import FlowHandle, check_handles, farthest_points, joined, sampled_handles
from omt_uv.solver.flows.options import BLEND, PATHS, RADIUS, RIGID, STRAIGHT
from omt_uv.solver.flows.paths import handle_paths, rotation_between

MIDDLE = np.zeros(3)


def quarter_turn(k=5):
    rng = np.random.default_rng(3)
    start = rng.normal(size=(k, 3))
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    return start, start @ turn.T + [1.0, 2, 3]


@pytest.mark.parametrize("kind", PATHS)
def test_every_path_is_the_same_way_back(kind):
    start, end = quarter_turn()
    owner = np.zeros(len(start), int)
    there = handle_paths(start, end, owner, kind, 8, MIDDLE, 2.0)
    back = handle_paths(end, start, owner, kind, 8, MIDDLE, 2.0)
    np.testing.assert_array_equal(there[0], start)
    np.testing.assert_array_equal(there[-1], end)
    np.testing.assert_allclose(there, back[::-1], atol=1e-9)


def test_rigid_handles_keep_their_shape_on_the_way():
    start, end = quarter_turn()
    path = handle_paths(start, end, np.zeros(len(start), int), RIGID, 10, MIDDLE, 1.0)
    lengths = np.linalg.norm(path[:, :, None] - path[:, None], axis=3)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), atol=1e-9)
    np.testing.assert_allclose(rotation_between(start, end) @ [1, 0, 0], [0, 1, 0], atol=1e-9)


def test_radius_paths_turn_about_the_middle_and_blends_lie_between():
    start, end = np.array([[1.0, 0, 0]]), np.array([[0.0, 3, 0]])
    owner = np.zeros(1, int)
    path = handle_paths(start, end, owner, RADIUS, 2, MIDDLE, 4.0)
    np.testing.assert_allclose(path[1, 0], [2 / 2**0.5, 2 / 2**0.5, 0], atol=1e-12)
    straight = handle_paths(start, end, owner, STRAIGHT, 2, MIDDLE, 4.0)[1, 0]
    blend = handle_paths(start, end, owner, BLEND, 2, MIDDLE, 4.0)[1, 0]
    np.testing.assert_allclose(blend, (straight + path[1, 0]) / 2, atol=1e-12)
    opposite = handle_paths(start, -start, owner, RADIUS, 4, MIDDLE, 4.0)
    np.testing.assert_allclose(np.linalg.norm(opposite, axis=2), 1.0, atol=1e-6)
    with pytest.raises(ValueError, match="rigid"):
        handle_paths(start, end, owner, "round", 2, MIDDLE, 4.0)


@pytest.mark.parametrize("kind", [RADIUS, BLEND])
def test_what_comes_from_the_middle_or_goes_there_goes_straight(kind):
    """There is no direction to turn from, nor to; others beside it turn as they do alone."""
    rng = np.random.default_rng(2)
    middle, ends = rng.normal(size=3), rng.normal(size=(4, 3))
    start, end = np.stack([middle, ends[0], ends[1], middle]), np.stack([ends[2], middle, ends[3], middle])
    path = handle_paths(start, end, np.arange(4), kind, 6, middle, 9.0)
    straight = handle_paths(start, end, np.arange(4), STRAIGHT, 6, middle, 9.0)
    np.testing.assert_allclose(path[:, [0, 1, 3]], straight[:, [0, 1, 3]], atol=1e-12)
    alone = handle_paths(start[2:3], end[2:3], np.arange(1), kind, 6, middle, 9.0)
    np.testing.assert_allclose(path[:, 2:3], alone, atol=1e-12)
    assert np.abs(path[3, 2] - straight[3, 2]).max() > 1e-2


def test_handles_are_thinned_out_evenly_and_checked():
    rng = np.random.default_rng(0)
    cloud = rng.uniform(size=(400, 3))
    rows = farthest_points(cloud, 0.3, 50)
    apart = np.linalg.norm(cloud[rows][:, None] - cloud[rows][None], axis=2) + np.eye(len(rows))
    assert len(rows) < 50 and apart.min() >= 0.3
    assert np.linalg.norm(cloud[:, None] - cloud[rows], axis=2).min(axis=1).max() < 0.3
    (thin,) = sampled_handles((FlowHandle(cloud, cloud + 1, np.arange(400)),), 0.3, 96)
    np.testing.assert_array_equal(thin.end, thin.start + 1)
    np.testing.assert_array_equal(cloud[thin.vertices], thin.start)
    one, other = FlowHandle(cloud[:1], cloud[:1] + 1, name="a"), FlowHandle(cloud[:1], cloud[:1], name="b")
    with pytest.raises(HandleError, match="a and b"):
        joined((one, other), 0.2)
    start, *_ = joined((one, one), 0.2)
    assert len(start) == 1
    with pytest.raises(HandleError, match="No handle moves"):
        check_handles((other,), 3)
    with pytest.raises(HandleError, match="has no points"):
        check_handles((FlowHandle(cloud, cloud[:3]),), 3)
    with pytest.raises(NonFiniteError, match="Coordinates of the handle number"):
        check_handles((FlowHandle(cloud * np.nan, cloud),), 3)


@pytest.mark.parametrize("kind", PATHS)
def test_every_handle_goes_its_own_way_whatever_others_do(kind):
    """Handles together, in any order of their points, go as each does alone."""
    rng = np.random.default_rng(7)
    start, owner = rng.normal(size=(12, 3)), np.repeat([0, 1, 2], 4)[rng.permutation(12)]
    end = np.empty_like(start)
    for k in range(3):
        turn = rotation_between(np.eye(3), np.linalg.qr(rng.normal(size=(3, 3)))[0])
        end[owner == k] = start[owner == k] @ turn.T + rng.normal(size=3)
    together = handle_paths(start, end, owner, kind, 6, MIDDLE, 2.0)
    for k in range(3):
        mine = owner == k
        alone = handle_paths(start[mine], end[mine], np.zeros(4, int), kind, 6, MIDDLE, 2.0)
        np.testing.assert_allclose(together[:, mine], alone, atol=1e-12)


@pytest.mark.parametrize("farther", [1.0, 1.5, 20.0])
def test_from_its_reach_on_a_blend_is_a_radius_path(farther):
    start, end = quarter_turn()
    owner, distance = np.arange(len(start)), (np.linalg.norm(start, axis=1) + np.linalg.norm(end, axis=1)) / 2
    reach = distance.min() / farther
    blend, turned = (handle_paths(start, end, owner, kind, 8, MIDDLE, reach) for kind in (BLEND, RADIUS))
    np.testing.assert_allclose(blend, turned, atol=1e-12)
