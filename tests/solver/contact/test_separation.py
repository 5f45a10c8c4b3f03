"""Faces that came into one another go back behind the plane that was between them, and no farther."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.contact import separation
from omt_uv.solver.contact.self_intersections import FaceCrossings, intersecting_pairs
from omt_uv.solver.contact.separation import separated
from omt_uv.solver.flows.creases import without_new_intersections


def two_balls(gap):
    """Two balls side by side with a gap between them."""
    V, F = icosphere(3)
    return np.concatenate([V, V + [np.ptp(V[:, 0]) + gap, 0.03, 0.02]]), np.concatenate([F, F + len(V)])


def test_two_balls_pressed_together_part_again():
    V, F = two_balls(0.05)
    half = len(V) // 2
    after = V.copy()
    after[half:, 0] -= 0.07
    pairs = intersecting_pairs(after, F)
    assert len(pairs)
    mended, left = without_new_intersections(V, after, FaceCrossings(F), np.ones(len(V), bool))
    assert not len(left) and not len(intersecting_pairs(mended, F))
    assert np.abs(mended - after).max() < 0.05
    assert ((mended != after).any(axis=1)).mean() < 0.1


def test_what_is_held_stays_and_the_other_gives_way():
    V, F = two_balls(0.05)
    half = len(V) // 2
    after = V.copy()
    after[half:, 0] -= 0.06
    free = np.arange(len(V)) >= half
    pairs = intersecting_pairs(after, F)
    mended = separated(V, after, F, pairs, free)
    np.testing.assert_array_equal(mended[:half], after[:half])
    assert not set(map(tuple, pairs)) & set(map(tuple, intersecting_pairs(mended, F)))


def test_planes_turn_where_both_sides_are_held(monkeypatch):
    """Two corners that pass one another are on both sides of no plane that keeps its direction."""
    rng, n = np.random.default_rng(0), 300
    V = rng.normal(size=(n, 6, 3))
    V[:, :3, 2] = np.abs(V[:, :3, 2]) + 0.02
    V[:, 3:, 2] = -np.abs(V[:, 3:, 2]) - 0.02
    V[:, :, 0] += 20.0 * np.arange(n)[:, None]
    after = V.copy()
    after[:, [0, 3]] += 1.2 * rng.normal(size=(n, 2, 3))
    before, after, F = V.reshape(-1, 3), after.reshape(-1, 3), np.arange(6 * n).reshape(-1, 3)
    pairs, free = intersecting_pairs(after, F), np.arange(6 * n) % 3 > 0
    assert len(pairs) > 10
    mended = separated(before, after, F, pairs, free)
    np.testing.assert_array_equal(mended[~free], after[~free])
    left = len(intersecting_pairs(mended, F))
    monkeypatch.setattr(separation, "TURNING", 0.0)
    assert left <= 1 < len(intersecting_pairs(separated(before, after, F, pairs, free), F))


def test_faces_with_a_common_vertex_part_too():
    V = np.array([[0.0, 0, 0], [1, 0.2, 0.3], [1, -0.2, 0.3], [1.3, 0.2, -0.3], [1.3, -0.2, -0.3]])
    F = np.array([[0, 1, 2], [0, 4, 3]])
    after = V.copy()
    after[1, 2], after[3, 2] = -0.1, 0.1
    pairs = intersecting_pairs(after, F)
    assert len(pairs) == 1
    mended = separated(V, after, F, pairs, np.ones(5, bool))
    assert not len(intersecting_pairs(mended, F))
    assert np.abs(mended - after).max() < 0.2


def test_planes_that_turn_stay_planes(monkeypatch):
    """Their normals keep their length, round by round: what is beyond a plane is measured along them."""
    V, F = two_balls(0.05)
    half, lengths = len(V) // 2, []
    after = V.copy()
    after[half:, 0] -= 0.09
    shared = separation._shared

    def watched(missing, place, normal, movable):
        lengths.append(np.linalg.norm(normal, axis=1))
        return shared(missing, place, normal, movable)

    monkeypatch.setattr(separation, "_shared", watched)
    separated(V, after, F, intersecting_pairs(after, F), np.arange(len(V)) % 2 == 0)
    assert len(lengths) > 3
    np.testing.assert_allclose(np.concatenate(lengths), 1, atol=1e-12)


@pytest.mark.parametrize("longer", [0.3, 1.0, 3.0, 8.0])
def test_what_is_as_far_apart_as_it_was_is_let_alone_however_all_else_was_stretched(longer):
    """A tip above the middle of a face, which the plane between them stays along."""
    before = np.array([[-2.0, -1, 0], [2, -1, 0], [0, 2, 0], [0, 0, 0.01], [0.5, 0, 1], [-0.5, 0, 1]])
    F, free = np.arange(6).reshape(2, 3), np.ones(6, bool)
    after = before * [1, 1, longer]
    for share, stays in ((1.1, True), (0.5, False)):
        # What is pressed together as a whole was not pushed into one another.
        after[3, 2] = share * 0.01 * min(longer, 1.0)
        found = separated(before, after, F, np.array([[0, 1]]), free)
        assert np.array_equal(found, after) == stays and not len(intersecting_pairs(found, F))
