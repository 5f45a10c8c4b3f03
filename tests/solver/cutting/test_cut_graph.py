"""Cuts along edges: what they leave, and that none can be shortened."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from short_cuts import component_of

from omt_uv.solver.cutting import cut_graph
from omt_uv.solver.cutting.cut_graph import cut_boundary, cut_classes, greedy_arcs, path_to, shorten, stretches
from omt_uv.solver.mesh.topology import boundary_loops, halfedges


def euler(triangles):
    """Euler characteristic and number of boundary loops."""
    edges = np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1), axis=0
    )
    return len(np.unique(triangles)) - len(edges) + len(triangles), len(boundary_loops(triangles))


@pytest.mark.parametrize("mesh", [meshes.torus, meshes.annulus])
def test_greedy_arcs_leave_a_disk(mesh):
    component = component_of(*mesh())
    roots = np.array([] if len(component.boundary) else [0], int)
    cut = greedy_arcs(component, roots)
    assert euler(cut_classes(component, cut)) == (1, 1)
    shorter = shorten(component, cut.copy(), roots)
    assert euler(cut_classes(component, shorter)) == (1, 1)
    assert component.cost[shorter].sum() <= component.cost[cut].sum()


def test_greedy_arcs_join_the_roots_of_a_sphere():
    component = component_of(*meshes.icosphere(2))
    roots = np.array([0, 40, 100])
    cut = greedy_arcs(component, roots)
    assert euler(cut_classes(component, cut)) == (1, 1) and np.isin(roots, component.ends[cut]).all()


def test_a_cut_opens_two_halfedges_for_every_edge():
    component = component_of(*meshes.annulus())
    cut = greedy_arcs(component, np.array([], int))
    assert len(cut_boundary(component, cut)) == len(component.boundary) + 2 * cut.sum()
    np.testing.assert_array_equal(np.sort(cut_boundary(component, np.zeros_like(cut))), np.sort(component.boundary))


@pytest.mark.parametrize("mesh", [meshes.torus, meshes.annulus, lambda: meshes.icosphere(2)])
def test_corners_are_one_vertex_where_a_walk_around_it_crosses_no_cut(mesh):
    component = component_of(*mesh())
    for share in (0.0, 0.1, 0.5, 1.0):
        cut = np.random.default_rng(0).random(len(component.pair)) < share
        flat = component.triangles.ravel()
        label = np.arange(len(flat))
        for _ in range(len(flat)):
            before = label.copy()
            for f, s in component.pair[~cut]:
                for a, b in ((f, s), (f, _next(s)), (_next(f), s), (_next(f), _next(s))):
                    if flat[a] == flat[b]:
                        label[[a, b]] = label[[a, b]].min()
            if (label == before).all():
                break
        _, expected = np.unique(label, return_inverse=True)
        np.testing.assert_array_equal(cut_classes(component, cut).ravel(), expected)


def _next(halfedge):
    return halfedge + 1 - 3 * (halfedge % 3 == 2)


def test_nothing_cut_leaves_the_vertices_as_they_are():
    component = component_of(*meshes.torus())
    classes = cut_classes(component, np.zeros(len(component.pair), bool))
    assert classes.max() + 1 == component.vertex_count
    assert (
        len(np.unique(np.column_stack([classes.ravel(), component.triangles.ravel()]), axis=0))
        == component.vertex_count
    )


def test_stretches_part_a_cut():
    component = component_of(*meshes.torus())
    cut = greedy_arcs(component, np.array([0]))
    parts = stretches(component, cut, np.array([0]))
    np.testing.assert_array_equal(np.sort(np.concatenate(parts)), np.flatnonzero(cut))
    costs = [component.cost[p].sum() for p in parts]
    assert costs == sorted(costs, reverse=True)


def test_a_path_in_a_grid_is_as_long_as_its_steps():
    component = component_of(*meshes.grid(6, 6, 6.0, 6.0))
    corner, far = (int(np.argmin(np.abs(component.positions - p).sum(1))) for p in ([0, 0, 0], [6, 0, 0]))
    path = path_to(component, np.array([corner]), far)
    # The outline is no inner edge: one row inside it there are 4 sides, and a diagonal to it at each end, or a side.
    assert np.isin([corner, far], component.ends[path]).all()
    degree = np.bincount(component.ends[path].ravel())
    assert (degree == 1).sum() == 2 and degree.max() == 2
    assert 6 <= component.length[path].sum() <= 4 + 2 * np.sqrt(2) + 1e-12


def bridge_of_the_cut_mesh(component, cut, tips):
    """The cost of the shortest path between two boundaries, of which a tip may be one, on the mesh cut open."""
    classes = cut_classes(component, cut)
    loops = boundary_loops(classes)
    lone = np.unique(classes[np.isin(component.triangles, tips)])
    loops += [np.array([v]) for v in lone if not any(v in loop for loop in loops)]
    if len(loops) != 2:
        return None
    inner = np.flatnonzero(~cut)
    tail, head = (ends[component.pair[inner, 0]] for ends in halfedges(classes))
    n = int(classes.max()) + 1
    graph = csr_matrix((component.cost[inner], (tail, head)), shape=(n, n))
    return dijkstra(graph, directed=False, indices=loops[0], min_only=True)[loops[1]].min()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("mesh", [meshes.torus, meshes.annulus, lambda: meshes.icosphere(3)])
def test_bridges_are_the_shortest_paths_of_the_cut_mesh(mesh, seed):
    component = component_of(*mesh())
    tips = np.random.default_rng(seed).choice(component.vertex_count, 2, replace=False)
    if len(component.boundary) and seed % 2:
        tips = tips[:0]
    cut = greedy_arcs(component, tips)
    checked = 0
    for stretch in stretches(component, cut, tips):
        rest = cut.copy()
        rest[stretch] = False
        expected = bridge_of_the_cut_mesh(component, rest, tips)
        path = cut_graph._shortest_bridge(component, rest, tips, 100.0)
        assert (path is None) == (expected is None)
        if path is not None:
            checked += 1
            assert component.cost[path].sum() == pytest.approx(expected) and len(np.unique(path)) == len(path)
            assert cut_graph._shortest_bridge(component, rest, tips, 0.9 * expected) is None
    assert checked


def test_there_is_no_bridge_across_what_is_barred_all_around():
    """However much it may cost; a cut stays where nothing shorter replaces it."""
    component = component_of(*meshes.annulus(rings=4))
    radius = np.linalg.norm(component.positions, axis=1)
    middle = np.abs(radius - np.median(np.unique(radius.round(9)))) < 1e-6
    barred = middle[component.ends].any(axis=1)
    assert middle.any() and not middle[component.on_boundary()].any()
    cut = greedy_arcs(component, np.zeros(0, int))
    component = replace(component, cost=np.where(barred, np.inf, component.cost))
    none = np.zeros(0, np.int64)
    assert cut_graph._shortest_bridge(component, np.zeros_like(cut), none, np.inf) is None
    assert np.array_equal(shorten(component, cut.copy(), none), cut)
