"""Find cuts that are known to be short, to hold ours against.

All lengths are those of edges.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, vstack
from scipy.sparse.csgraph import dijkstra

from omt_uv.solver.cutting.component import make_component
from omt_uv.solver.cutting.cut_graph import greedy_arcs
from omt_uv.solver.mesh.gluing import corner_classes
from omt_uv.solver.mesh.repair import repaired_gluing
from omt_uv.solver.mesh.surface import chosen_triangles, triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops

# The exact tree takes time that grows threefold with every end.
MOST_ENDS = 12
# Added to every branch of the search: to scipy an edge of length 0 is no edge.
TINY = 1e-12


def shortest_tree(V, F, tips):
    """Length of the shortest tree of edges that joins vertices `tips` (k,) and all boundaries of V (n,3), F (m,3)."""
    n = len(V)
    sides = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1), axis=0)
    length = np.linalg.norm(V[sides[:, 0]] - V[sides[:, 1]], axis=1)
    graph = csr_matrix((np.tile(length, 2), (sides.T.ravel(), sides[:, ::-1].T.ravel())), shape=(n, n))
    ends = [np.array([t]) for t in tips] + boundary_loops(F)
    # A boundary is one end: walking along it costs nothing.
    name = np.arange(n)
    for loop in boundary_loops(F):
        name[loop] = loop[0]
    graph = graph.tocoo()
    a, b = name[graph.row], name[graph.col]
    low_first = np.lexsort((graph.data, b, a))
    a, b, data = a[low_first], b[low_first], graph.data[low_first]
    keep = np.r_[True, (a[1:] != a[:-1]) | (b[1:] != b[:-1])] & (a != b)
    graph = csr_matrix((data[keep], (a[keep], b[keep])), shape=(n, n))
    ends = np.unique([int(name[e[0]]) for e in ends])
    if len(ends) > MOST_ENDS:
        return np.nan
    return _dreyfus_wagner(graph, ends)


def _dreyfus_wagner(graph, ends):
    """Cost of the cheapest tree that joins the vertices `ends`: best[S][v] joins the subset S and the vertex v."""
    n, k = graph.shape[0], len(ends) - 1
    best = {1 << i: dijkstra(graph, indices=int(ends[i])) for i in range(k)}
    for subset in range(1, 1 << k):
        if subset in best:
            continue
        joined = np.full(n, np.inf)
        part = (subset - 1) & subset
        while part > subset - part:
            joined = np.minimum(joined, best[part] + best[subset - part])
            part = (part - 1) & subset
        # One more vertex leads to every other at the cost of the subtree that ends there.
        reached = np.flatnonzero(np.isfinite(joined))
        entry = csr_matrix((joined[reached] + TINY, (np.zeros(len(reached)), reached)), shape=(1, n + 1))
        wide = csr_matrix((graph.data, graph.indices, graph.indptr), shape=(n, n + 1))
        best[subset] = dijkstra(vstack([wide, entry]).tocsr(), indices=n)[:n]
    return float(best[(1 << k) - 1][ends[k]])


def gluing_of(V, F):
    """How the triangles are glued."""
    surface = triangle_surface(V, F)
    return repaired_gluing(surface, *chosen_triangles(surface, None)).gluing


def component_of(V, F):
    """The whole mesh, which is connected, as a component to be cut; edges cost their lengths."""
    gluing = gluing_of(V, F)
    factor = np.ones(len(gluing.first))
    everything = np.arange(len(F)), np.arange(len(factor))
    component = make_component(gluing, V, corner_classes(gluing), *everything, np.zeros(len(V)), factor)
    component.cost[:] = component.length
    return component


def cotree_length(V, F):
    """Length of the tree-cotree cut with geodesic lengths from vertex 0, or from the boundaries."""
    component = component_of(V, F)
    root = np.array([0] if len(component.boundary) == 0 else [], np.int64)
    return float(component.length[greedy_arcs(component, root)].sum())
