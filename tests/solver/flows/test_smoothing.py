"""What is crumpled is smoothed until nothing meets, and the rest stays."""

from __future__ import annotations

import numpy as np
from bodies import icosphere

from omt_uv.solver.contact.self_intersections import FaceCrossings, intersecting_pairs
from omt_uv.solver.flows.smoothing import smoothed_apart


def test_a_crumpled_spot_is_smoothed_and_the_rest_stays():
    V, F = icosphere(3)
    spot = V[:, 2] > 0.8
    crumpled = V.copy()
    crumpled[spot] += 0.15 * np.random.default_rng(0).standard_normal((int(spot.sum()), 3))
    assert len(intersecting_pairs(crumpled, F)) > 20
    held = int(V[:, 2].argmax())
    free = np.arange(len(V)) != held
    position, left = smoothed_apart(V, crumpled, FaceCrossings(F), free)
    assert not len(left) and not len(intersecting_pairs(position, F))
    np.testing.assert_array_equal(position[held], crumpled[held])
    np.testing.assert_array_equal(position[V[:, 2] < 0], V[V[:, 2] < 0])
    assert np.linalg.norm(position - V, axis=1).max() < 0.4


def test_what_met_before_may_meet():
    V, F = icosphere(2)
    both = np.concatenate([V, V + [1.0, 0.1, 0.2]])
    faces = FaceCrossings(np.concatenate([F, F + len(V)]))
    position, left = smoothed_apart(both, both, faces, np.ones(len(both), bool))
    assert position is both and not len(left)
