"""Pieces of flows: kernels, what handles reach and set, what comes apart; against loops, and what they decide."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
import scipy.sparse as sp

from omt_uv.solver.flows import creases, flow_map
from omt_uv.solver.flows import shape as shapes
from omt_uv.solver.flows.kernel import FlowField


def test_exponents_are_of_squared_distances():
    rng = np.random.default_rng(0)
    centres, x = rng.normal(size=(4, 3)), rng.normal(size=(7, 3))
    field = FlowField(centres, rng.normal(size=(4, 3)), 1.7)
    lifted = np.column_stack([x, (x**2).sum(axis=1), np.ones(7)])
    expected = [[-1.7 * ((p - c) ** 2).sum() for c in centres] for p in x]
    np.testing.assert_allclose(lifted @ field._exponent, expected, atol=1e-12)


def test_what_a_sharper_kernel_adds_is_a_share_of_the_coefficients():
    rng = np.random.default_rng(0)
    field = FlowField(rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), 1.7, near=0.3)
    narrow = field._narrow
    np.testing.assert_allclose(narrow.coefficients, 0.3 * field.coefficients)
    assert narrow.sharpness == pytest.approx(25.0 * 1.7)


def handle(vertices, stays, end):
    return SimpleNamespace(
        vertices=None if vertices is None else np.array(vertices), stays=stays, end=np.array(end, float)
    )


def test_handles_set_their_vertices_and_those_that_stay_come_last():
    points, positions = np.zeros((6, 3)), np.full((6, 3), 7.0)
    moving = handle([1, -1, 2], False, [[1, 1, 1], [5, 5, 5], [2, 2, 2]])
    staying = handle([2, 3], True, [[9, 9, 9], [9, 9, 9]])
    for handles in ((moving, staying), (staying, moving)):
        at = positions.copy()
        flow_map._set_handles(at, points, (*handles, handle(None, False, np.zeros((0, 3)))))
        assert at[:, 0].tolist() == [7, 1, 0, 0, 7, 7]
    assert flow_map._free(6, (moving, staying, handle(None, False, []))).tolist() == [
        True,
        False,
        False,
        False,
        True,
        True,
    ]


@pytest.mark.parametrize("small", [1e-3, 0.1])
def test_points_are_reached_where_a_handle_moves_them_by_more_than_is_small(small):
    path = np.array([[[0.0, 0, 0]], [[1.0, 0, 0]]])
    way = SimpleNamespace(domain=None, path=path, sharpness=4.0)
    reach = np.sqrt(-np.log(small) / 4) + 0.5
    points = np.array([[-reach + 0.01, 0, 0], [-reach - 0.01, 0, 0], [1 + reach - 0.01, 0, 0], [0.5, 9, 0]])
    assert flow_map._reached(points, way, small).tolist() == [0, 2]
    way.domain = "anything"
    assert flow_map._reached(points, way, small).tolist() == [0, 1, 2, 3]


def test_mending_goes_as_far_as_an_edge_or_a_share_of_the_whole():
    V, F = meshes.grid(4, 4)
    lengths = [np.linalg.norm(V[f[k]] - V[f[k - 1]]) for f in F for k in range(3)]
    assert creases.farthest_mended(V, F) == pytest.approx(np.mean(lengths))
    V, F = meshes.grid(80, 80)
    assert creases.farthest_mended(V, F) == pytest.approx(0.02 * np.sqrt(2), rel=0.01)


def test_clusters_move_by_affine_maps_that_fade_over_rings():
    V, F = meshes.grid(9, 1, width=9.0)
    n = len(V)
    before = V
    after = V + [[0, 0, 1.0]] * n
    after[4] += [0, 0, 3.0]
    after[4 + 10] += [0, 0, 3.0]
    graph = sp.lil_matrix((n, n))
    for f in F:
        for a in f:
            for b in f:
                graph[a, b] = 1
    seeds = np.array([[4, 5, 14, 15, 4, 5]])
    free = np.ones(n, bool)
    free[0] = False
    found = creases._blended(before, after, after.copy(), graph.tocsr(), seeds, free, 1)
    column = np.arange(n) % 10
    core = (column >= 3) & (column <= 6)
    # Beside the core and its ring nothing changes, and in it what was torn is affine.
    far = (column < 2) | (column > 7)
    np.testing.assert_allclose(found[far], after[far])
    plane = np.column_stack([before[core][:, :2], np.ones(core.sum())])
    fit = np.linalg.lstsq(plane, found[core][:, 2], rcond=None)
    np.testing.assert_allclose(plane @ fit[0], found[core][:, 2], atol=1e-9)
    ring = (column == 2) | (column == 7)
    wide = np.column_stack([before[ring][:, :2], np.ones(ring.sum())]) @ fit[0]
    np.testing.assert_allclose(found[ring][:, 2], (after[ring][:, 2] + wide) / 2, atol=1e-6)
    stays = creases._blended(before, after, after.copy(), graph.tocsr(), seeds, np.zeros(n, bool), 1)
    np.testing.assert_allclose(stays, after)


class Crossings:
    """Pairs that newly intersect, by how many rounds there have been."""

    def __init__(self, rounds, triangles):
        self.rounds, self.asked = list(rounds), []
        self.faces = SimpleNamespace(triangles=triangles)

    def pairs(self, position, concerned=None):
        self.asked.append(None if concerned is None else np.flatnonzero(concerned).tolist())
        return np.array(self.rounds.pop(0), np.int64).reshape(-1, 2)

    def apart(self, pairs):
        return pairs[pairs[:, 0] != 0] if len(pairs) else pairs


@pytest.mark.parametrize(
    "rounds, steps, left",
    [
        ([[]], 0, 0),
        ([[[1, 2]], []], 1, 0),
        ([[[1, 2]], [[1, 2]]], 1, 1),
        ([[[1, 2]], [[3, 4]], []], 2, 0),
        ([[[1, 2], [0, 3]], [[0, 3]]], 1, 0),
        ([[[1, 2]], [[1, 2], [3, 4]], [[1, 2], [3, 4]]], 2, 1),
    ],
)
def test_what_meets_is_taken_apart_round_by_round_and_the_best_is_kept(rounds, steps, left, monkeypatch):
    before = np.zeros((9, 3))
    after, triangles = before + 1.0, np.arange(9).reshape(3, 3).repeat(3, axis=0)
    made = []

    def separated(one, two, faces, pairs, free):
        made.append(0.6 + len(made) + 0 * after)
        return made[-1]

    monkeypatch.setattr(creases, "separated", separated)
    monkeypatch.setattr(creases, "touched", lambda a, b, triangles: np.zeros(len(triangles), bool))
    monkeypatch.setattr(creases, "_too_many", lambda pairs, triangles: False)
    crossings = Crossings(rounds, triangles)
    best, pairs = creases.taken_apart((before, after), crossings, np.ones(9, bool))
    assert len(made) == steps and len(pairs) == left
    assert best is (after if not made or len(pairs) >= len(rounds[0]) else best)
    stopped = Crossings([[[1, 2]]], triangles)
    best, pairs = creases.taken_apart((before, after), stopped, np.ones(9, bool), farthest=1e-9)
    assert best is after and len(pairs) == 1


def shape_of(V, F):
    return shapes.FlowShape(V, F, np.ones(len(V), bool))


def test_changes_of_volume_are_relative_and_of_closed_parts_alone():
    V, F = meshes.icosphere(1)
    G = np.concatenate([F, F + len(V), F[:5] + 2 * len(V)])
    W = np.concatenate([V, 2 * V[:, [1, 0, 2]] + 9, V + 20])
    after = W.copy()
    after[: len(V)] *= 1.1
    after[len(V) : 2 * len(V)] = 9 + (W[len(V) : 2 * len(V)] - 9) * 0.9
    found = shape_of(W, G).changes(after)
    np.testing.assert_allclose(sorted(np.abs(found)), [1 - 0.9**3, 1.1**3 - 1])
    # Inside out, too, a body that grows has grown by its size.
    inside = shape_of(V, F[:, ::-1]).changes(1.1 * V)
    np.testing.assert_allclose(inside, [-(1.1**3 - 1)])
    assert len(shape_of(V, F[:0]).changes(V)) == 0
    flat = shape_of(V * [1, 1, 0], F)
    assert len(flat.changes(V)) == 0


@pytest.mark.parametrize("mend", [True, False])
@pytest.mark.parametrize("mended", [True, False])
def test_only_what_was_taken_apart_and_its_faces_are_looked_at_again(mended, mend, monkeypatch):
    """Volumes are given back once more by the vertices around what moved, and pairs that were left are told."""
    V, F = meshes.grid(3, 3)
    free = np.ones(16, bool)
    free[1] = False
    given = shapes.FlowShape(V, F, free)
    calls = []

    def restore(before, after, parts, movable):
        calls.append(np.flatnonzero(movable).tolist())
        return (after + 1 if len(calls) == 1 else after + 100), None

    def apart(move, crossings, free, farthest, concerned):
        calls.append((farthest, concerned))
        at = move[1].copy()
        if mended:
            at[[0, 6]] += 5
        return (at if mended else move[1]), np.array([[17, 16]])

    def pairs(self, at, concerned):
        calls.append(np.flatnonzero(concerned).tolist())
        return "pairs"

    monkeypatch.setattr(shapes, "restore_volumes", restore)
    monkeypatch.setattr(shapes, "taken_apart", apart)
    monkeypatch.setattr(shapes, "touched", lambda before, after, triangles: "touched")
    monkeypatch.setattr(shapes, "farthest_mended", lambda points, triangles: "farthest")
    monkeypatch.setattr(shapes.FlowShape, "_apart", pairs)
    found = given.sound(2 * V, mend)
    every = [k for k in range(16) if k != 1]
    assert calls[0] == every
    if not mend:
        assert np.array_equal(found.positions, 2 * V + 1) and len(found.pairs) == 0 and not found.mended.any()
        return
    assert calls[1] == ("farthest", "touched")
    if not mended:
        assert (
            np.array_equal(found.positions, 2 * V + 1) and not found.mended.any() and found.pairs.tolist() == [[17, 16]]
        )
        return
    near = {int(v) for t in F if {0, 6} & set(t.tolist()) for v in t}
    assert calls[2] == sorted(near - {1}) and np.flatnonzero(found.mended).tolist() == [0, 6]
    assert calls[3] == sorted({k for k, t in enumerate(F.tolist()) if near & set(t)} | {16, 17})
    assert found.pairs == "pairs" and found.positions[5] == pytest.approx(2 * V[5] + 101)


@pytest.mark.parametrize("meeting", [False, True])
@pytest.mark.parametrize("left", [0, 2, 3, 4])
def test_regions_are_brought_back_where_fewer_pairs_are_left_and_stay_where_as_many_are(left, meeting, monkeypatch):
    """What was found stays, and is told, where nothing is gained; what meets nothing is not brought at all."""
    V, F = meshes.icosphere(1)
    pairs = np.arange(6).reshape(-1, 2)
    rows = np.unique(F[pairs]) if meeting else np.setdiff1d(np.arange(len(V)), F[pairs])
    region, asked = SimpleNamespace(rows=rows[:5]), []

    def closer(given, apart, restored):
        asked.append(given)
        np.testing.assert_array_equal(np.stack([apart, restored]), np.stack([V, 2 * V])[:, given.rows])
        return 0 * apart + 7

    monkeypatch.setattr(shapes, "closer", closer)
    others, concerned = np.arange(2 * left).reshape(-1, 2), np.ones(len(F), bool)
    given = SimpleNamespace(triangles=F, _apart=lambda at, some: others)
    move, found = (V, 2 * V), (3 * V, pairs)
    mended, told = shapes.FlowShape._brought(given, move, [region], found, concerned)
    assert asked == [region] * meeting
    if left < len(pairs):
        expected = 3 * V
        expected[rows[:5] if meeting else []] = 7
        np.testing.assert_array_equal(mended, expected)
        assert told is others
    else:
        assert mended is found[0] and told is pairs
