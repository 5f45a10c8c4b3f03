"""Nested dissection: orders are permutations, parts are halves, and separators come after what they separate."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.linalg.nested_dissection import Dissection, kd_parts, mesh_order, vertex_graph
from omt_uv.solver.linalg.sparse import Factor
from omt_uv.solver.mesh.geometry import cotangent_laplacian
from omt_uv.solver.mesh.topology import halfedges


@pytest.mark.parametrize("count", [1, 2, 16, 17, 1000])
def test_parts_have_the_same_size(count):
    points = np.random.default_rng(0).random((count, 2)) * [3, 1]
    for depth in range(4):
        size = np.bincount(kd_parts(points, depth), minlength=1 << depth)
        assert size.sum() == count and np.ptp(size) <= 1


def test_parts_are_halved_across_their_longest_side():
    points = np.random.default_rng(0).random((1000, 2)) * [3, 1]
    part = kd_parts(points, 1)
    assert points[part == 0, 0].max() <= points[part == 1, 0].min()


@pytest.mark.parametrize("make", [Dissection, None])
def test_orders_are_permutations(make):
    V, F = meshes.random_disk()
    order = mesh_order(V, F) if make is None else make(V).order(*halfedges(F))
    np.testing.assert_array_equal(np.sort(order), np.arange(len(V)))


def test_no_edge_joins_halves_before_their_separator():
    V, F = meshes.grid(40, 40)
    place = np.empty(len(V), np.int64)
    order = Dissection(V).order(*halfedges(F))
    place[order] = np.arange(len(V))
    part = kd_parts(V, 1)
    tail, head = halfedges(F)
    cut = part[tail] != part[head]
    upper = np.unique(np.where(part[tail] > part[head], tail, head)[cut])
    # The separator of the whole mesh is the last of all.
    np.testing.assert_array_equal(np.sort(place[upper]), np.arange(len(V) - len(upper), len(V)))


def test_an_order_does_not_change_a_solution():
    V, F = meshes.bumpy(30, 30)
    A = cotangent_laplacian(V, F) + vertex_graph(F, len(V)).tocsr() @ vertex_graph(F, len(V)).tocsr() * 1e-2
    b = np.random.default_rng(0).normal(size=len(V))
    np.testing.assert_allclose(Factor(A, Dissection(V).order(*halfedges(F))).solve(b), Factor(A).solve(b), rtol=1e-8)


def test_the_graph_of_a_mesh_knows_neighbours():
    V, F = meshes.grid(3, 3)
    graph = vertex_graph(F, len(V)).toarray()
    assert (graph == graph.T).all() and (np.diag(graph) > 0).all()
    tail, head = halfedges(F)
    assert (graph[tail, head] > 0).all()
    assert (graph > 0).sum() == len(V) + len(np.unique(np.sort([tail, head], axis=0), axis=1).T) * 2
