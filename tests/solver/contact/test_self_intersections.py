"""Pairs of triangles that pass through one another: all of them, and no others."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.contact.self_intersections import FaceCrossings, intersecting_pairs


def by_sampling(V, F):
    """Pairs by brute force: every edge against every triangle without a common vertex."""
    found = set()
    for i, one in enumerate(F):
        for j, other in enumerate(F):
            for a, b in (one[[0, 1]], one[[1, 2]], one[[2, 0]]):
                if {a, b} & set(other.tolist()):
                    continue
                p, q, (u, v, w) = V[a], V[b], V[other]
                matrix = np.stack([q - p, u - v, u - w], axis=1)
                if abs(np.linalg.det(matrix)) < 1e-12:
                    continue
                t, s, r = np.linalg.solve(matrix, u - p)
                if 0 < t < 1 and s > 0 and r > 0 and s + r < 1:
                    found.add((min(i, j), max(i, j)))
    return sorted(found)


def test_random_triangles_agree_with_brute_force():
    rng = np.random.default_rng(0)
    V = rng.uniform(size=(30, 3))
    F = np.array([rng.choice(30, 3, replace=False) for _ in range(40)])
    F = F[np.unique(np.sort(F, axis=1), axis=0, return_index=True)[1]]
    # Triangles with an edge in common pass by the rule, and here none of them would be told anyway.
    assert [tuple(p) for p in intersecting_pairs(V, F)] == by_sampling(V, F)


@pytest.mark.parametrize("size", [1e-20, 1e-4, 1e3, 1e20])
@pytest.mark.parametrize("place", [[2.0, -1.0, 0.5], [3e4, 0, -1e4]])
def test_their_number_does_not_depend_on_size_and_place(size, place):
    rng = np.random.default_rng(3)
    V, F = rng.uniform(-1, 1, (60, 3)), np.arange(60).reshape(-1, 3)
    pairs = intersecting_pairs(V, F)
    assert len(pairs) > 10
    np.testing.assert_array_equal(intersecting_pairs(size * (V + place), F), pairs)


def test_two_balls_and_one():
    V, F = icosphere(2)
    assert not len(intersecting_pairs(V, F))
    two, faces = np.concatenate([V, 0.9 * V + [1.2, 0.1, 0]]), np.concatenate([F, F + len(V)])
    pairs = intersecting_pairs(two, faces)
    assert len(pairs) > 10 and (pairs[:, 0] < len(F)).all() and (pairs[:, 1] >= len(F)).all()
    mine = np.zeros(len(faces), bool)
    mine[pairs[0, 0]] = True
    some = intersecting_pairs(two, faces, mine)
    np.testing.assert_array_equal(some, pairs[(pairs == pairs[0, 0]).any(axis=1)])
    large = np.concatenate([two, [[0, 0, 0.01], [90, 0, 0.01], [0, 90, 0.02]]])
    many = intersecting_pairs(large, np.concatenate([faces, [[len(two), len(two) + 1, len(two) + 2]]]))
    assert (many == len(faces)).any()


@pytest.mark.parametrize("seed", range(12))
def test_pairs_are_the_same_however_vertices_and_triangles_are_numbered(seed):
    """Of soups, where edges have one triangle or many, and triangles meet at single vertices, on either side."""
    rng = np.random.default_rng(seed)
    V = rng.uniform(size=(9, 3)) * ([1, 1, 0.2] if seed % 2 else [1, 1, 1])
    F = np.array([rng.choice(9, 3, replace=False) for _ in range(14)])
    F = F[np.unique(np.sort(F, axis=1), axis=0, return_index=True)[1]]
    found = {frozenset(pair) for pair in intersecting_pairs(V, F).tolist()}
    assert found
    for _ in range(6):
        order, rows = rng.permutation(9), rng.permutation(len(F))
        again = intersecting_pairs(V[order], np.argsort(order)[F[rows]])
        assert {frozenset(rows[pair].tolist()) for pair in again} == found


@pytest.mark.parametrize("seed", range(6))
def test_faces_in_one_plane_pass_however_it_lies(seed):
    """Rounding puts their corners on either side of it."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    V = np.column_stack([rng.uniform(-1, 1, (90, 2)), np.zeros(90)]) @ turn.T + rng.normal(size=3)
    assert not len(intersecting_pairs(V, np.arange(90).reshape(-1, 3)))


@pytest.mark.parametrize("rounds", [1, 2])
def test_what_is_told_of_a_whole_fan_is_so_pair_by_pair(rounds, monkeypatch):
    """Around a vertex that faces lie about once, where some of them fold over, or twice, where some have to cross."""
    told = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        k = 5 * rounds
        angle = 2 * np.pi * rounds * (np.arange(k) + rng.uniform(-0.4, 0.4, k) * rng.integers(1, 4)) / k
        ring = rng.uniform(0.7, 1.3, (k, 1)) * np.column_stack([np.cos(angle), np.sin(angle), rng.uniform(-1, 1, k)])
        V, F = np.concatenate([np.zeros((1, 3)), ring]), np.array([[0, 1 + i, 1 + (i + 1) % k] for i in range(k)])
        found = intersecting_pairs(V, F)
        with monkeypatch.context() as each:
            each.setattr(FaceCrossings, "_side_by_side", lambda self, corner, asked: np.zeros(len(self._plain), bool))
            np.testing.assert_array_equal(found, intersecting_pairs(V, F))
        told.append(len(found) > 0)
    assert all(told) if rounds == 2 else 5 < sum(told) < 60
