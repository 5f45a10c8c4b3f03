"""Pieces of cuts, against every path there is, dense equations and loops over edges."""

from __future__ import annotations

from itertools import pairwise, permutations
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from omt_uv.solver.cutting import cut_graph, cuts, gluing_facts
from omt_uv.solver.seams import cut_tree, fine_paths, parting, predicted_scale, symmetric_base


def random_graph(n, seed):
    rng = np.random.default_rng(seed)
    upper = np.triu(rng.random((n, n)) < 0.5, 1) * rng.uniform(0.5, 2, (n, n))
    return upper + upper.T


def cheapest_way(cost, start, allowed, end):
    """The least cost of a way from a start to an end through what is allowed, by trying all of them."""
    best, n = np.inf, len(cost)
    inner = [v for v in range(n) if start[v] or allowed[v] or end[v]]
    for k in range(1, len(inner) + 1):
        for way in permutations(inner, k):
            if start[way[0]] and end[way[-1]]:
                steps = [cost[a, b] for a, b in pairwise(way)]
                if all(steps):
                    best = min(best, sum(steps))
    return best


@pytest.mark.parametrize("seed", range(6))
def test_the_cheapest_arc_is_that_of_all_ways(seed):
    n, rng = 6, np.random.default_rng(seed)
    cost = random_graph(n, seed)
    ways = []
    for count in (1, 2, 1):
        kind = rng.integers(0, 4, n)
        ways.append(SimpleNamespace(start=kind == 0, allowed=kind == 1, end=kind == 2, count=count))
    expected = min(way.count * cheapest_way(cost, way.start, way.allowed, way.end) for way in ways)
    found = symmetric_base._cheapest(csr_matrix(cost), ways)
    if not np.isfinite(expected):
        assert found is None
        return
    length = sum(cost[a, b] for a, b in pairwise(found))
    fits = [w for w in ways if (w.start[found[0]] and w.end[found[-1]]) or (w.start[found[-1]] and w.end[found[0]])]
    assert any(w.count * length == pytest.approx(expected) for w in fits)


def test_paths_of_a_cut_go_from_node_to_node_and_what_closes_is_two():
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [2, 5], [6, 7], [7, 8], [8, 6]])
    for begin, way in ((0, [4, 3, 2, 1, 0]), (4, [0, 1, 2, 3, 4])):
        assert symmetric_base._longest(ends[:4], begin, 9).tolist() == way
    way = symmetric_base._longest(ends[5:], 6, 9).tolist()
    assert way[-1] == 6 and way[0] in (7, 8)


@pytest.mark.parametrize("seed", range(4))
def test_stretches_end_at_tips_branchings_the_boundary_and_where_a_path_leaves_the_plane(seed):
    rng = np.random.default_rng(seed)
    n = 14
    tree = np.array([[int(rng.integers(0, v)), v] for v in range(1, n)])
    graph = SimpleNamespace(
        ends=tree, boundary=rng.random(n) < 0.1, in_plane=rng.random(n) < 0.4, cost=rng.random(len(tree))
    )
    steps = np.flatnonzero(rng.random(len(tree)) < 0.8)
    found, degree = cut_tree._by_stretch(graph, steps)
    assert degree.tolist() == np.bincount(tree[steps].ravel(), minlength=n).tolist()
    node = {v for v in range(n) if degree[v] != 2 or graph.boundary[v]}
    for a, b in tree[steps]:
        if graph.in_plane[a] != graph.in_plane[b]:
            node.add(int(a if graph.in_plane[a] else b))
    left, expected = set(steps.tolist()), []
    while left:
        part, todo = set(), [left.pop()]
        while todo:
            s = todo.pop()
            part.add(s)
            for other in list(left):
                if set(tree[s].tolist()) & set(tree[other].tolist()) - node:
                    left.discard(other)
                    todo.append(other)
        expected.append(part)
    assert sorted(sorted(s.tolist()) for s in found) == sorted(sorted(p) for p in expected)
    costs = [graph.cost[s].sum() for s in found]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("flaw", [None, 3])
def test_energies_of_prefixes_are_those_of_the_leading_equations(flaw):
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6))
    matrix, load = root @ root.T + np.eye(6), rng.normal(size=6)
    if flaw is not None:
        matrix[flaw, flaw] = -5.0
    found = predicted_scale.prefix_energies(matrix.copy(), load)
    for j in range(6):
        if flaw is not None and j >= flaw:
            assert np.isinf(found[j])
        else:
            part = matrix[: j + 1, : j + 1]
            assert found[j] == pytest.approx(load[: j + 1] @ np.linalg.solve(part, load[: j + 1]))


@pytest.mark.parametrize(("beside", "most"), [(3, True), (2, False)])
@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_cut_lies_on_its_image_where_most_of_it_is_beside_it(beside, most, share, monkeypatch):
    """A row of five vertices with steps of length 2, some of whose images lie nearly too far from it."""
    V = np.zeros((10, 3))
    V[:5, 0] = 2 * np.arange(5)
    V[5:] = V[:5]
    V[5:, 1] = 99.0
    V[5 : 5 + beside, 1] = share * 2.0 * 2
    monkeypatch.setattr(parting, "_images_in", lambda chart, nearest: np.concatenate([np.arange(5, 10), np.arange(5)]))
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    chart, images = SimpleNamespace(vertices=V), SimpleNamespace(nearest=None)
    assert parting.lies_on_its_image(chart, ends, images) == (most and share < 1)


@pytest.mark.parametrize("side", [0, 1])
def test_spokes_are_the_cheapest_edges_from_one_boundary_to_each_vertex_inside(side):
    rng = np.random.default_rng(side)
    edges = np.array([[0, 5], [1, 5], [6, 1], [2, 6], [0, 6], [7, 2], [3, 7], [0, 1]])
    cost = rng.random(len(edges))
    cost[5] = np.inf
    boundary = {0: 0, 1: 0, 2: 1, 3: 1}
    sides = np.array([[boundary.get(v, -1) for v in e] for e in edges.tolist()])
    component = SimpleNamespace(ends=edges, cost=cost)
    two = SimpleNamespace(side=sides, edges=np.arange(len(edges)))
    edge, vertex = cut_graph._spokes(component, two, side)
    expected = {}
    for k, (a, b) in enumerate(edges.tolist()):
        for one, other in ((a, b), (b, a)):
            if boundary.get(one) == side and other not in boundary:
                expected[other] = min(k, expected.get(other, k), key=lambda e: cost[e])
    expected = {v: k for v, k in expected.items() if np.isfinite(cost[k])}
    assert dict(zip(vertex.tolist(), edge.tolist(), strict=True)) == expected


@pytest.mark.parametrize(("lengths", "taken"), [([3, 9], 0), ([0, 2], 1), ([0, 0], None)])
def test_paths_are_led_on_the_first_graph_that_has_one_and_then_from_farther_away(lengths, taken):
    asked = []

    def graph(k):
        def path(used, end, along, spacing, allowed, reach=None):
            far = reach is not None
            asked.append((k, reach) if far else (k,))
            return np.arange(7) if far and taken is None else np.arange(lengths[k])

        return SimpleNamespace(path=path)

    found = fine_paths._led([graph(0), graph(1)], None, 4, np.arange(3), 0.5, None, False)
    assert asked[:1] == [(0,)]
    if taken is not None:
        assert len(found) == lengths[taken] and len(asked) == taken + 1
    else:
        assert len(asked) > 2 and all(len(a) > 1 for a in asked[2:])


@pytest.mark.parametrize("wants", [True, False])
def test_seams_are_searched_where_a_component_is_curved_and_asked_for(wants, monkeypatch):
    asked = []

    class Search:
        def wants(self, faces, marked):
            asked.append((faces.tolist(), marked))
            return wants

    own = SimpleNamespace(
        search=Search(), gluing=SimpleNamespace(owner=np.array([5, 6, 7, 8])), positions=None, surface=None
    )
    curvature = np.array([0.0, 1.001, 0.999]) * 0.2
    curvature[0] = 99.0
    monkeypatch.setattr(cuts, "total_curvature", lambda *_: curvature)
    monkeypatch.setattr(gluing_facts, "marked_triangles", lambda *_: np.array([False, True, False, False]))
    class_ = next(c for c in vars(cuts).values() if isinstance(c, type) and hasattr(c, "_to_search"))
    component_at, members = np.array([0, 1, 1, 2]), [np.array([0]), np.array([1, 2]), np.array([3])]
    found = class_._to_search(own, component_at, None, members)
    assert found.tolist() == [wants, wants, False] and asked == [([5], False), ([6, 7], True)]
    own.search = None
    assert class_._to_search(own, component_at, None, members).tolist() == [False] * 3


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_what_is_held_already_answers_with_nothing_but_rounding(scale):
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6))
    green = scale * (root @ root.T + np.eye(6))
    held = predicted_scale.Held.of(green, rng.normal(size=6))
    free = held.between(np.array([2]))
    assert free[0, 0] == pytest.approx(green[2, 2])
    again = held.at(np.array([2, 4])).between(np.array([2, 4]))
    least = 1e-13 * np.diag(green)[[2, 4]]
    assert (np.diag(again) >= least).all() and (np.diag(again) < 1e-6 * np.diag(green)[[2, 4]]).all()
    one = held.at(np.array([2])).between(np.array([2]))
    assert one[0, 0] >= least[0] and one[0, 0] < 1e-6 * green[2, 2]
    # Several together are loosened a little, each by itself and by the greatest.
    both = held.between(np.array([1, 3]))
    own = np.diag(green)[[1, 3]]
    more = 1e-8 * own + 1e-13 * own.max()
    np.testing.assert_allclose(both - green[np.ix_([1, 3], [1, 3])], np.diag(more), atol=1e-9 * own.max())
