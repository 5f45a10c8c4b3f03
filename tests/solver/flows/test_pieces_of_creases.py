"""How what newly meets is taken apart: rings around it that go along affinely, and means of neighbours in turn."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
import scipy.sparse as sp

from omt_uv.solver.flows import creases, smoothing
from omt_uv.solver.mesh.geometry import affine_images


@pytest.mark.parametrize("rings", [1, 2, 3])
@pytest.mark.parametrize("held", [False, True])
def test_rings_around_what_meets_go_along_with_it_less_and_less(rings, held):
    V, F = meshes.grid(11, 11)
    rng = np.random.default_rng(rings)
    n = len(V)
    before, after, position = V, V + 0.05 * rng.normal(size=V.shape), V + 0.07 * rng.normal(size=V.shape)
    free = np.ones(n, bool)
    free[::3] = not held
    graph = creases.neighbours(F, n) + sp.identity(n, format="csr")
    middle = int(np.linalg.norm(V - V.mean(axis=0), axis=1).argmin())
    (row,) = np.flatnonzero((middle == F).any(axis=1))[:1]
    seeds = np.concatenate([F[row], F[row]])[None]
    found = creases._blended(before, after, position, graph, seeds, free, rings)
    beside = {v: set() for v in range(n)}
    for t in F.tolist():
        for v in t:
            beside[v] |= set(t)
    far, ring, level = dict.fromkeys(F[row].tolist(), 0), set(F[row].tolist()), 0
    while ring:
        level += 1
        ring = {u for v in ring for u in beside[v]} - set(far)
        far |= dict.fromkeys(ring, level)
    used = np.array(sorted(v for v in far if far[v] <= 2 * rings))
    fade = np.array([1.0 if far[v] <= rings else 1 - (far[v] - rings) / (rings + 1) for v in used])
    target = affine_images(before[used], after[used], np.zeros(len(used), int), fade)
    expected = position.copy()
    for v, f, place in zip(used, fade, target, strict=True):
        share = f * free[v]
        expected[v] = (1 - share) * after[v] + share * place
    np.testing.assert_allclose(found, expected, atol=1e-12)
    # What moves affinely stays as it is, all but for what keeps maps of few points apart from singular ones.
    turn = np.array([[1.1, 0.2, 0], [-0.1, 0.9, 0.3], [0, 0.1, 1]])
    same = V @ turn.T + 4
    np.testing.assert_allclose(creases._blended(V, same, same, graph, seeds, free, rings), same, atol=3e-4)


def test_places_far_from_one_another_go_along_each_by_itself():
    V, F = meshes.grid(14, 2)
    n = len(V)
    after = V + np.where(V[:, :1] < V[:, 0].mean(), [[0.0, 0, 1]], [[0.0, 0, -1]])
    graph = creases.neighbours(F, n) + sp.identity(n, format="csr")
    ends = [int(V[:, 0].argmin()), int(V[:, 0].argmax())]
    rows = [np.flatnonzero((v == F).any(axis=1))[0] for v in ends]
    seeds = np.array([np.concatenate([F[r], F[r]]) for r in rows])
    found = creases._blended(V, after, after, graph, seeds, np.ones(n, bool), 1)
    np.testing.assert_allclose(found, after, atol=3e-4)


@pytest.mark.parametrize(
    ("counts", "rounds", "best"),
    [([0], 0, 0), ([2, 0], 1, 1), ([3, 2, 4, 1, 0], 4, 4), ([2, 3, 3], None, 0), ([3, 2, 2, 2], None, 1)],
)
def test_what_meets_is_smoothed_until_nothing_does_and_the_best_is_kept(counts, rounds, best, monkeypatch):
    V, F = meshes.grid(4, 4)
    free = np.arange(len(V)) % 2 == 0
    pairs, asked, places = iter(counts), [], []

    class Crossings:
        def __init__(self, *_):
            pass

        def pairs(self, position, near=None):
            places.append(position.copy())
            count = next(pairs, counts[-1])
            return np.column_stack([np.arange(count), np.arange(count) + 5])

    def around(triangles, met, n, rings):
        asked.append((np.flatnonzero(met).tolist(), rings))
        return np.arange(n) < 9

    monkeypatch.setattr(smoothing, "NewCrossings", Crossings)
    monkeypatch.setattr(smoothing, "vertices_around", around)
    monkeypatch.setattr(smoothing, "touched", lambda after, position, triangles: np.zeros(len(triangles), bool))
    after = V + 0.1 * np.random.default_rng(0).normal(size=V.shape)
    found, left = smoothing.smoothed_apart(V, after, SimpleNamespace(triangles=F), free)
    rounds = 60 if rounds is None else rounds
    assert len(asked) == rounds and len(left) == min(counts[: rounds + 1])
    assert [a[1] for a in asked] == [1 + k // 8 for k in range(rounds)]
    for (met, _), count in zip(asked, [*counts, *[counts[-1]] * 99], strict=False):
        assert met == sorted({*range(count), *range(5, 5 + count)})
    position = after.copy()
    beside = {v: set() for v in range(len(V))}
    for t in F.tolist():
        for v in t:
            beside[v] |= set(t) - {v}
    for k in range(best):
        new = position.copy()
        for v in range(9):
            if free[v]:
                new[v] = np.mean([position[u] for u in beside[v]], axis=0)
        position = new
        np.testing.assert_allclose(places[k + 1], position, atol=1e-12)
    np.testing.assert_allclose(found, position, atol=1e-12)
