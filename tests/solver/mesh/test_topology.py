"""Halfedges, twins, boundary loops and components, by what they are."""

import meshes
import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from omt_uv.solver.mesh import topology
from omt_uv.solver.mesh.topology import (
    FEW_PAIRS,
    are_among,
    boundary_edges,
    boundary_loops,
    distinct,
    expand,
    first_places,
    graph_components,
    halfedges,
    inner_vertices,
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


# Integers that are counted, and those that are compared: large ones, negative ones, and none.
NUMBERS = {
    "small": np.random.default_rng(0).integers(0, 40, 100),
    "rows": np.random.default_rng(1).integers(0, 200, (50, 3)),
    "narrow": np.random.default_rng(2).integers(0, 40, 100).astype(np.int32),
    "as large as counted": np.array([12, 0, 12]),
    "larger": np.array([13, 0, 13]),
    "large": np.random.default_rng(3).integers(0, 1 << 40, 100),
    "negative": np.random.default_rng(4).integers(-20, 20, 100),
    "none": np.zeros(0, np.int64),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_distinct_numbers_and_their_first_places_are_those_of_sorting(name):
    numbers = NUMBERS[name]
    values, first, place = np.unique(numbers.ravel(), return_index=True, return_inverse=True)
    for found in (distinct(numbers), first_places(numbers)):
        assert (found[0] == values).all() and found[0].dtype == numbers.dtype
    assert (distinct(numbers)[1] == place).all() and (first_places(numbers)[1] == first).all()


@pytest.mark.parametrize("few", [[], [3], [7, 3, 7, 0], [100], [-1]])
def test_keys_among_few_are_those_of_numpy(few):
    keys, few = np.random.default_rng(0).integers(0, 10, 200), np.array(few, np.int64)
    assert (are_among(keys, few) == np.isin(keys, few)).all()
    assert len(are_among(keys[:0], few)) == 0


@pytest.mark.parametrize("bound", [300, 1 << 62])
def test_keys_among_many_are_those_of_numpy_though_most_of_these_are_not_sorted(bound):
    rng = np.random.default_rng(0)
    many = rng.integers(-bound, bound, 3 * FEW_PAIRS)
    keys = np.concatenate([many[::50], rng.integers(-bound, bound, 100)])
    assert (are_among(keys, many) == np.isin(keys, many)).all()
    assert not are_among(np.full(3, bound), many).any()


@pytest.mark.parametrize("holes", [0, 5])
def test_inner_vertices_are_those_between_twins(holes):
    V, F = meshes.head(12)
    F = np.delete(F, np.random.default_rng(0).permutation(len(F))[:holes], axis=0)
    tail, head = halfedges(F)
    expected = np.ones(len(V), bool)
    expected[tail[twins(F) < 0]] = expected[head[twins(F) < 0]] = False
    np.testing.assert_array_equal(inner_vertices(F, len(V)), expected)


@pytest.mark.parametrize("name", [*OPEN, *CLOSED])
def test_edges_of_loops_are_those_of_all_boundaries(name):
    """Of large meshes nothing within is sorted for them."""
    V, F = (OPEN | CLOSED)[name]
    F = np.concatenate([F, F[::2] + len(V)]) if name == "grid" else F
    np.testing.assert_array_equal(topology._edges_of_loops(F, int(F.max()) + 1), boundary_edges(F))


def test_components_of_many_nodes_do_not_mind_edges_that_are_there_twice_or_lead_nowhere():
    a, b = np.random.default_rng(0).integers(0, 5000, (2, 4000))
    once = graph_components(a, b, 5000)
    again = graph_components(np.concatenate([a, b, a, a]), np.concatenate([b, a, b, a]), 5000)
    assert once[0] == again[0] == once[1].max() + 1 and (once[1] == again[1]).all()
    # Numbered as they first occur.
    assert (np.sort(np.unique(once[1], return_index=True)[1]) == np.unique(once[1], return_index=True)[1]).all()


@pytest.mark.parametrize("name", [*OPEN, *CLOSED])
def test_vertices_on_the_boundary_are_those_of_sides_without_a_twin(name):
    V, F = (OPEN | CLOSED)[name]
    found = np.zeros(len(V), bool)
    found[boundary_edges(F)] = True
    assert (on_boundary(F, len(V)) == found).all()
