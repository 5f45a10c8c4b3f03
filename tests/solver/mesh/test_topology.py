"""Halfedges, twins, boundary loops and components, by what they are."""

import meshes
import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from omt_uv.solver.mesh.topology import (
    boundary_edges,
    boundary_loops,
    expand,
    graph_components,
    halfedges,
    next_halfedge,
    on_boundary,
    pair_keys,
    pair_up,
    paired,
    previous_halfedge,
    twins,
)

OPEN = {"grid": meshes.grid(), "annulus": meshes.annulus(), "cone": meshes.cone()}
CLOSED = {"cube": meshes.cube(), "torus": meshes.torus()}


@pytest.mark.parametrize("name", [*OPEN, *CLOSED])
def test_twins_are_an_involution_that_swaps_tail_and_head(name):
    V, F = (OPEN | CLOSED)[name]
    tail, head = halfedges(F)
    twin = twins(F)
    inner = np.flatnonzero(twin >= 0)
    assert (twin[twin[inner]] == inner).all()
    assert (tail[twin[inner]] == head[inner]).all() and (head[twin[inner]] == tail[inner]).all()
    assert (twin < 0).any() == (name in OPEN)


def test_next_and_previous_go_round_a_triangle():
    F = meshes.grid()[1]
    h = np.arange(F.size)
    np.testing.assert_array_equal(previous_halfedge(next_halfedge(h)), h)
    np.testing.assert_array_equal(next_halfedge(next_halfedge(next_halfedge(h))), h)
    np.testing.assert_array_equal(halfedges(F)[0][next_halfedge(h)], halfedges(F)[1])


@pytest.mark.parametrize(("name", "count"), [("grid", 1), ("annulus", 2), ("cone", 1)])
def test_boundary_loops_walk_every_boundary_edge_once(name, count):
    V, F = OPEN[name]
    loops = boundary_loops(F)
    assert len(loops) == count and [len(x) for x in loops] == sorted(map(len, loops), reverse=True)
    walked = np.concatenate([np.stack([x, np.roll(x, -1)], axis=1) for x in loops])
    edges = boundary_edges(F)
    np.testing.assert_array_equal(np.unique(walked, axis=0), np.unique(edges, axis=0))
    assert len(walked) == len(edges)
    assert set(np.flatnonzero(on_boundary(F, len(V)))) == set(np.concatenate(loops))


@pytest.mark.parametrize("name", CLOSED)
def test_closed_surfaces_have_no_boundary(name):
    V, F = CLOSED[name]
    assert boundary_loops(F) == [] and not len(boundary_edges(F)) and not on_boundary(F, len(V)).any()


def test_keys_know_pairs_and_not_their_order():
    a, b = np.random.default_rng(0).integers(0, 2**31 - 1, (2, 1000))
    key = pair_keys(a, b)
    np.testing.assert_array_equal(key, pair_keys(b, a))
    np.testing.assert_array_equal(key >> 32, np.minimum(a, b))
    np.testing.assert_array_equal(key & 0xFFFFFFFF, np.maximum(a, b))


def test_only_what_occurs_twice_is_paired():
    first, second = pair_up(np.array([7, 3, 7, 5, 5, 5, 3, 9]))
    assert sorted(zip(first.tolist(), second.tolist(), strict=True)) == [(0, 2), (1, 6)]


def test_rows_of_counts():
    row, place = expand(np.array([2, 0, 3]))
    assert row.tolist() == [0, 0, 2, 2, 2] and place.tolist() == [0, 1, 0, 1, 2]


def test_components_of_a_graph():
    rng = np.random.default_rng(0)
    for n in (1, 2, 30, 300):
        a, b = rng.integers(0, n, (2, n // 2))
        graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n))
        count, label = connected_components(graph, directed=False)
        found = graph_components(a, b, n)
        assert found[0] == count and np.array_equal(found[1], label)
    count, label = graph_components(np.array([0, 1, 4]), np.array([1, 2, 5]), 7)
    assert count == 4 and len(np.unique(label)) == 4
    assert label[0] == label[1] == label[2] and label[4] == label[5] != label[3]


def test_keys_of_pairs_give_these_back():
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, 2**31 - 1, (2, 50))
    assert np.array_equal(paired(pair_keys(a, b)), np.sort(np.stack([a, b], axis=1), axis=1))
