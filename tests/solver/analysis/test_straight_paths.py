"""Straightened paths: the same ends, no dearer, fewer turns, apart from one another, and around the same holes."""

import meshes
import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from omt_uv.solver.analysis.straight_paths import edge_network, straighten, turning_angles
from omt_uv.solver.mesh.topology import halfedges, pair_keys

ZIGZAG = np.radians(60)


def edges_of(F):
    keys = np.unique(pair_keys(*halfedges(F)))
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)


def network_of(V, F, cost=None):
    E = edges_of(F)
    return edge_network(V, F, E, np.ones(len(E)) if cost is None else cost)


def length_of(V, path):
    return np.linalg.norm(np.diff(V[path], axis=0), axis=1).sum()


def shortest_paths(V, F, ends):
    E = edges_of(F)
    graph = csr_matrix((np.linalg.norm(V[E[:, 0]] - V[E[:, 1]], axis=1), tuple(E.T)), shape=(len(V),) * 2)
    paths = []
    for start, end in ends:
        before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)[1]
        path = [end]
        while path[-1] != start:
            path.append(before[path[-1]])
        paths.append(np.array(path[::-1]))
    return paths


def staircase(columns):
    """Steps across a square of quads, of so many columns and rows: right, up, right, up."""
    k = np.arange(2 * columns + 1)
    return ((k // 2) * (columns + 1) + (k + 1) // 2).astype(np.int64)


def grid_without_diagonals(columns):
    V, F = meshes.grid(columns, columns)
    E = edges_of(F)
    along = np.abs(V[E[:, 0]] - V[E[:, 1]])[:, :2]
    return V, F, np.where(along.min(axis=1) > 1e-9, np.inf, 1.0)


def test_a_staircase_over_quads_becomes_two_edge_loops():
    V, F, cost = grid_without_diagonals(4)
    (path,) = straighten(network_of(V, F, cost), [staircase(4)])
    assert (path[0], path[-1]) == (0, len(V) - 1)
    assert length_of(V, path) == pytest.approx(2)
    assert (turning_angles(V, path) > 0.1).sum() == 1


def test_diagonals_that_cost_without_bound_are_no_edges():
    V, F, cost = grid_without_diagonals(5)
    (path,) = straighten(network_of(V, F, cost), [staircase(5)])
    assert (np.abs(np.diff(V[path, :2], axis=0)).min(axis=1) < 1e-9).all()


def test_shortest_paths_turn_less_and_are_hardly_longer():
    V, F = meshes.random_disk(3000, height=0.1)
    draw = np.random.default_rng(0)
    ends = draw.choice(len(V), (20, 2), replace=False)
    paths = shortest_paths(V, F, ends)
    network = network_of(V, F)
    better = [straighten(network, [p])[0] for p in paths]
    assert all((p[[0, -1]] == q[[0, -1]]).all() for p, q in zip(paths, better, strict=True))
    before, after = (np.concatenate([turning_angles(V, p) for p in some]) for some in (paths, better))
    assert (after > ZIGZAG).mean() < 0.7 * (before > ZIGZAG).mean()
    assert sum(length_of(V, p) for p in better) < 1.015 * sum(length_of(V, p) for p in paths)


def test_paths_follow_what_is_cheap():
    """A lane of cheap edges beside the straight way."""
    V, F, cost = grid_without_diagonals(12)
    row = np.round(12 * V[:, 1]).astype(int)
    lane = (row[edges_of(F)] == 8).all(axis=1)
    straight = 6 * 13 + np.arange(13)
    (same,) = straighten(network_of(V, F, cost), [straight])
    np.testing.assert_array_equal(same, straight)
    (path,) = straighten(network_of(V, F, np.where(lane, 0.2, cost)), [straight])
    assert (row[path] == 8).sum() > 8 and (path[[0, -1]] == straight[[0, -1]]).all()


@pytest.mark.parametrize("by", ["path", "blocked"])
def test_a_lane_that_another_path_or_a_block_is_on_is_left_to_it(by):
    """However cheap it is: alone, the path would take it."""
    V, F, cost = grid_without_diagonals(12)
    row = np.round(12 * V[:, 1]).astype(int)
    network = network_of(V, F, np.where((row[edges_of(F)] == 8).all(axis=1), 0.2, cost))
    straight, lane = (k * 13 + np.arange(13) for k in (6, 8))
    blocked = np.zeros(len(V), bool)
    blocked[lane] = by == "blocked"
    paths = [straight] if by == "blocked" else [straight, lane]
    found = straighten(network, paths, blocked)
    assert not set(found[0]) & set(lane) and (found[0][[0, -1]] == straight[[0, -1]]).all()
    assert (row[straighten(network, [straight])[0]] == 8).any()


def test_paths_stay_apart_and_off_what_is_blocked():
    V, F, cost = grid_without_diagonals(8)
    first = staircase(8)
    second = np.concatenate([[0], 9 * np.arange(1, 9), 72 + np.arange(1, 8)])
    blocked = np.zeros(len(V), bool)
    blocked[[4, 5]] = True
    network = network_of(V, F, cost)
    one, other = straighten(network, [first, second], blocked)
    assert set(one) & set(other) == {0} and not blocked[one].any() and not blocked[other].any()
    one, other = straighten(network, [one, other], blocked)
    assert set(one) & set(other) == {0}


@pytest.mark.parametrize("minor", [12, 6])
def test_a_loop_around_a_tube_goes_around_it_still(minor):
    """Straightened it is a circle; no harm is done to a tube so thin that what surrounds the loop is no disk."""
    V, F = meshes.torus(36, minor)
    around = np.arctan2(V[:, 2], np.hypot(V[:, 0], V[:, 1]) - np.hypot(V[:, 0], V[:, 1]).mean())
    k = np.arange(minor)
    wandering = np.round(3 * np.sin(4 * np.pi * k / minor)).astype(int) % 36
    corners = (wandering * minor + k).tolist()
    pieces = shortest_paths(V, F, zip(corners, corners[1:] + corners[:1], strict=True))
    loop = np.concatenate([*(p[:-1] for p in pieces), pieces[0][:1]])
    (better,) = straighten(network_of(V, F), [loop])
    turn = np.angle(np.exp(1j * np.diff(around[better]))).sum()
    assert abs(turn) == pytest.approx(2 * np.pi)
    assert better[0] == better[-1] == loop[0] and len(set(better)) == len(better) - 1
    assert length_of(V, better) <= length_of(V, loop) * 1.001


def test_a_loop_leaves_a_circle_to_the_path_that_is_on_it():
    V, F = meshes.torus(36, 24)
    k = np.arange(24)
    corners = (np.round(3 * np.sin(np.pi * k / 24)).astype(int) * 24 + k).tolist()
    pieces = shortest_paths(V, F, zip(corners, corners[1:] + corners[:1], strict=True))
    loop = np.concatenate([*(p[:-1] for p in pieces), pieces[0][:1]])
    circle = k[4:-4]
    assert not set(loop) & set(circle)
    network = network_of(V, F)
    assert set(straighten(network, [loop])[0]) & set(circle)
    better, same = straighten(network, [loop, circle])
    assert not set(better) & set(same) and better[0] == better[-1] == loop[0]


def test_short_paths_stay():
    V, F = meshes.grid(3, 3)
    network = network_of(V, F)
    for path in ([0, 1], [0, 1, 5, 0]):
        np.testing.assert_array_equal(straighten(network, [np.array(path)])[0], path)


@pytest.mark.parametrize("sides", [(6, 10), (10, 6)])
def test_a_lane_that_a_path_has_moved_to_is_no_longer_free(sides):
    """Alone, either path goes there; of two, the first one does, and the second goes where it can."""
    V, F, cost = grid_without_diagonals(12)
    row = np.round(12 * V[:, 1]).astype(int)
    network = network_of(V, F, np.where((row[edges_of(F)] == 8).all(axis=1), 0.05, cost))
    paths = [k * 13 + np.arange(13) for k in sides]
    assert all((row[straighten(network, [path])[0]] == 8).any() for path in paths)
    one, other = straighten(network, paths)
    assert (row[one] == 8).any() and not set(one) & set(other)
