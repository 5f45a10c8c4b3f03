"""Volumes come back after faces were taken apart, and what meets then is said."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.contact.self_intersections import intersecting_pairs
from omt_uv.solver.flows.creases import regions_around
from omt_uv.solver.flows.shape import FlowShape


def two_balls():
    """Two balls close to one another."""
    V, F = icosphere(2)
    return np.concatenate([V, V + [2.02, 0.03, 0.02]]), np.concatenate([F, F + len(V)])


def test_volumes_come_back_though_faces_are_in_the_way():
    V, F = two_balls()
    shape = FlowShape(V, F, np.ones(len(V), bool))
    half = len(V) // 2
    # A ball that has lost volume is to grow towards the other one, which it nearly touches.
    smaller = V.copy()
    smaller[:half] = 0.9 * V[:half] + [0.1, 0, 0]
    everything = np.arange(len(F)).reshape(-1, 2)
    regions = regions_around((V, smaller), F, everything, np.ones(len(V), bool), shape.free)
    found = shape.settled(smaller, regions)
    assert not len(found.pairs) and not len(intersecting_pairs(found.positions, F))
    np.testing.assert_allclose(shape.changes(found.positions), 0, atol=1e-9)


def test_what_is_closed_counts_and_what_is_held_stays():
    V, F = two_balls()
    free = np.ones(len(V), bool)
    free[:10] = False
    shape = FlowShape(V, F[1:], free)
    found = shape.sound(1.1 * V, mend=True)
    assert len(shape.changes(V)) == 1 and shape.changes(1.1 * V)[0] == pytest.approx(1.1**3 - 1)
    np.testing.assert_allclose(shape.changes(found.positions), 0, atol=1e-9)
    np.testing.assert_array_equal(found.positions[:10], 1.1 * V[:10])


@pytest.mark.parametrize("shift", [0.05, 0.6, 1.5])
@pytest.mark.parametrize("part", ["ball", "tips"])
def test_all_faces_that_meet_after_mending_are_told(shift, part):
    """Those that are left where a ball, or a tip of it, is pressed into another, and that meet by what volumes did."""
    V, F = two_balls()
    half = len(V) // 2
    pressed = V + 0.01 * np.random.default_rng(0).normal(size=V.shape)
    moved = np.arange(half, len(V))
    moved = moved if part == "ball" else moved[V[moved, 0].argsort()[: int(8 * shift) + 1]]
    pressed[moved] -= [0.2 if part == "tips" else shift, 0, 0]
    shape = FlowShape(V, F, np.ones(len(V), bool))
    assert not len(intersecting_pairs(V, F)) and len(intersecting_pairs(pressed, F))
    found = shape.sound(pressed, mend=True)
    meeting = {frozenset(pair) for pair in intersecting_pairs(found.positions, F).tolist()}
    assert {frozenset(pair) for pair in found.pairs.tolist()} == meeting
    np.testing.assert_allclose(shape.changes(found.positions), 0, atol=1e-9)
    assert not len(shape.sound(pressed, mend=False).pairs)
