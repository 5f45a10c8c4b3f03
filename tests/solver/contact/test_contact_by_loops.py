"""Pieces of what keeps triangles apart, against loops over pairs of boxes, triangles and planes."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.contact import barrier, box_pairs, new_crossings, self_intersections, separation


@pytest.mark.parametrize("seed", range(3))
def test_segments_pierce_triangles_where_their_two_ends_and_sides_say_so(seed):
    rng = np.random.default_rng(seed)
    start, end, triangle = rng.normal(size=(80, 3)), rng.normal(size=(80, 3)), rng.normal(size=(80, 3, 3))
    found = self_intersections._pierces(start, end, triangle)
    for k in range(80):
        a, b, c = triangle[k]
        try:
            u, v, t = np.linalg.solve(np.column_stack([b - a, c - a, start[k] - end[k]]), start[k] - a)
        except np.linalg.LinAlgError:
            continue
        assert found[k] == (u > 0 and v > 0 and u + v < 1 and 0 < t < 1)
    assert 3 < found.sum() < 60
    # What only touches does not pass through.
    flat = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]])
    for one, other in (([0.2, 0.2, 0], [0.2, 0.2, 1]), ([0.5, -1, 0], [0.5, 1, 0]), ([0, 0, -1], [0, 0, 1])):
        assert not self_intersections._pierces(np.array([one], float), np.array([other], float), flat)[0]


@pytest.mark.parametrize("order", range(6))
def test_triangles_with_a_common_vertex_meet_where_a_far_side_pierces(order):
    turn = [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)][order]
    V = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0.2, -1], [1, 0.2, 1], [1, 3, 1], [-1, 0.2, 1]], float)
    cases = [([0, 3, 4], True), ([0, 4, 5], False), ([0, 4, 6], False)]
    for other, meets in cases:
        F = np.array([[0, 1, 2], other])
        F = F[:, turn]
        pairs = np.array([[0, 1], [1, 0]])
        assert self_intersections._touching(V[F], F, pairs).tolist() == [meets, meets]


def test_volumes_are_of_three_vectors():
    rng = np.random.default_rng(0)
    a, b, c = rng.normal(size=(3, 9, 3))
    np.testing.assert_allclose(
        self_intersections._volume(a, b, c), [np.linalg.det([x, y, z]) for x, y, z in zip(a, b, c, strict=True)]
    )


def test_keys_of_vertex_pairs_name_one_of_each():
    F = np.array([[0, 1, 2], [3, 4, 5], [2, 3, 6]])
    found = new_crossings._vertex_pairs(F, np.array([[0, 1], [2, 0]]))
    for row, (a, b) in zip(found, ((0, 1), (2, 0)), strict=True):
        assert row.tolist() == [x * 7 + y for x in F[a].tolist() for y in F[b].tolist()]


def test_runs_of_equal_keys_end_where_the_next_begins():
    assert box_pairs._run_ends(np.array([3, 3, 5, 9, 9, 9])).tolist() == [2, 2, 3, 6, 6, 6]


def random_pairs(seed, count=60):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(6 * count, 3))
    one, other = np.arange(3 * count).reshape(-1, 3), 3 * count + np.arange(3 * count).reshape(-1, 3)
    points[other] += 2 * rng.normal(size=(count, 1, 3))
    return points, one, other


@pytest.mark.parametrize("seed", range(2))
def test_planes_part_triangles_by_the_widest_gap(seed):
    points, one, other = random_pairs(seed)
    normal, gap = separation._planes(points, one, other)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1)
    wide = 0
    for k in range(len(one)):
        a, b = points[one[k]], points[other[k]]
        size = np.ptp(np.concatenate([a, b]), axis=0).max()
        between = (b @ normal[k]).min() - (a @ normal[k]).max()
        sides_a, sides_b = np.roll(a, -1, axis=0) - a, np.roll(b, -1, axis=0) - b
        na, nb = np.cross(sides_a[0], sides_a[1]), np.cross(sides_b[0], sides_b[1])
        axes = [
            na,
            nb,
            *(np.cross(x, y) for x in sides_a for y in sides_b),
            *np.cross(na, sides_a),
            *np.cross(nb, sides_b),
        ]
        best = -np.inf
        for axis in axes:
            for sign in (1, -1):
                n = sign * axis / np.linalg.norm(axis)
                best = max(best, (b @ n).min() - (a @ n).max())
        assert between == pytest.approx(best) and gap[k] == pytest.approx(np.clip(best, 0, 0.02 * size))
        wide += best > 0
    assert wide > 10


def test_planes_of_triangles_with_a_common_vertex_go_through_it():
    V = np.array([[0, 0, 0], [1, 0, 0.1], [0, 1, 0.1], [-1, 0.2, -0.1], [-0.2, -1, 0.1]], float)
    normal, gap = separation._planes(V, np.array([[0, 1, 2]]), np.array([[3, 0, 4]]))
    assert gap[0] == 0
    assert (V[[1, 2]] @ normal[0]).max() < 0 < (V[[3, 4]] @ normal[0]).min()


def test_planes_lie_half_way_or_beside_what_cannot_move():
    height = np.array([[0, 1, 2, 3, 5, 6.0]])
    free, gap = np.ones((1, 6), bool), np.array([0.2])
    assert separation._middles(height, free, gap)[0] == 2.5
    held = free.copy()
    held[0, 2] = False
    assert separation._middles(height, held, gap)[0] == 2.5
    height[0, 3] = 1.0
    assert separation._middles(height, free, gap)[0] == 1.5
    assert separation._middles(height, held, gap)[0] == pytest.approx(2.1)
    held = free.copy()
    held[0, 3] = False
    assert separation._middles(height, held, gap)[0] == pytest.approx(0.9)
    held[0, 2] = False
    assert separation._middles(height, held, gap)[0] == 1.5


@pytest.mark.parametrize("held", [False, True])
def test_what_is_beyond_a_plane_goes_back_or_turns_it(held):
    rng = np.random.default_rng(0)
    place, normal = rng.normal(size=(1, 6, 3)), np.array([[0, 0, 1.0]])
    missing, movable = np.array([[0.3, 0, 0, 0, -0.2, 0]]), np.ones((1, 6), bool)
    if held:
        movable[0, 0] = False
    back, turn = separation._shared(missing, place, normal, movable)
    arm = place[0] - place[0].mean(axis=0)
    arm[:, 2] = 0
    square = (arm**2).sum(axis=1)
    size = square.max()
    part = missing[0] / (movable[0] + 0.5 * square / size)
    np.testing.assert_allclose(back[0], part * movable[0])
    np.testing.assert_allclose(turn[0], (part[:, None] * arm).sum(axis=0) * 0.5 / size / 2)
    assert (back[0, 0] == 0) == held


def test_normals_are_carried_by_affine_maps_and_lengths_along_them_shrink():
    points, one, other = random_pairs(0, 5)
    matrix = np.array([[1.2, 0.3, 0], [0, 0.9, 0.1], [0.2, 0, 0.4]])
    corner, normal = np.concatenate([one, other], axis=1), separation._planes(points, one, other)[0]
    turned, stretch = separation._carried(points, points @ matrix.T + 3, corner, normal)
    for k in range(5):
        expected = np.linalg.inv(matrix).T @ normal[k]
        size = np.linalg.norm(expected)
        np.testing.assert_allclose(turned[k], expected / size, atol=0.02)
        assert stretch[k] == pytest.approx(min(1 / size, 1), abs=0.02)


@pytest.mark.parametrize("meets", [0, 1, 9])
def test_parts_that_would_meet_others_stay_where_they_were(meets):
    V, F = meshes.quad_patch()
    start = np.concatenate([V, V + [5, 0, 0], V + [9, 0, 0]])
    triangles = np.concatenate([F, F + 4, F + 8])
    goal = start + [0, 0, 1.0]
    asked = []

    def meeting(at):
        asked.append(at.copy())
        # The second part meets the first as soon as it moves; with 9, somebody always does.
        hit = np.abs(at[4:8] - start[4:8]).max() > 0.5 if meets == 1 else meets == 9
        return np.array([2]) if hit else np.array([], int)

    pairs = SimpleNamespace(corners=np.zeros((0, 4), int))
    problem = SimpleNamespace(
        goal=goal,
        meeting=meeting,
        near=lambda at: SimpleNamespace(pairs=pairs),
        crossings=SimpleNamespace(faces=SimpleNamespace(triangles=triangles)),
    )
    found = barrier._ahead(problem, start)
    expected = {0: goal, 1: np.concatenate([goal[:4], start[4:8], goal[8:]]), 9: start}[meets]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert len(asked) == {0: 1, 1: 2, 9: 4}[meets]


@pytest.mark.parametrize("still, gone, rounds", [(False, 1.0, 40), (True, 1.0, 1), (False, 0.049, 1)])
def test_what_is_brought_nearer_stops_where_little_moves_or_little_is_gone(still, gone, rounds, monkeypatch):
    V, F = meshes.grid(2, 2)
    calls = []

    def searched(self, at, near):
        calls.append(1)
        return at + (1e-3 if still else 0.01) * np.array([0, 0, 1.0]) * 0.5, near, gone

    monkeypatch.setattr(barrier._Problem, "searched", searched)
    monkeypatch.setattr(barrier._Problem, "near", lambda self, at, *_: None)
    monkeypatch.setattr(barrier, "_ahead", lambda problem, start: start)
    crossings = SimpleNamespace(before=V, faces=SimpleNamespace(triangles=F))
    free = np.arange(len(V)) > 0
    found = barrier.brought(V, V + 7, crossings, free)
    assert len(calls) == rounds
    np.testing.assert_allclose(found[0], V[0] + 7)


@pytest.mark.parametrize("seed", range(2))
def test_pairs_of_boxes_are_those_that_overlap(seed):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 5, (70, 3))
    high = low + rng.exponential(0.4, (70, 3))
    found = {tuple(sorted(p)) for p in box_pairs.box_pairs(low, high).tolist()}
    expected = {
        (i, j) for i, j in combinations(range(70), 2) if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
    }
    assert found == expected and len(expected) > 5
