"""Length of our cuts against what is known to be short.

usage: python benchmarks/cuts.py [MODEL ...] [-o TABLE.tsv]

tree      at genus 0: the shortest tree of edges that joins the same tips and boundaries (exact: Dreyfus, Wagner 1971)
cotree    with handles: the tree-cotree cut with geodesic lengths from one vertex (Erickson, Whittlesey 2005), without
          any tips; our cut is measured without tips too
All lengths are those of edges, divided by the extent of the model.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix, vstack
from scipy.sparse.csgraph import dijkstra

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support"), str(ROOT / "benchmarks")]

import meshes
from cases import Table

from omt_uv.solver.cutting.component import make_piece
from omt_uv.solver.cutting.cut_graph import greedy_arcs
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.mesh.gluing import corner_classes
from omt_uv.solver.mesh.repair import repaired_gluing
from omt_uv.solver.mesh.surface import chosen_triangles, triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops

MODELS = ["max_planck", "bunny_small", "spot", "homer", "cow", "bunny", "david", "armadillo", "stanford_bunny",
          "beetle", "rocker_arm", "three_holes", "fertility"]  # fmt: skip
COLUMNS = {"model": 16, "faces": 7, "handles": 7, "boundaries": 10, "tips": 4, "length": 7, "tree": 7, "cotree": 7,
           "ratio": 6, "seconds": 7}  # fmt: skip
# The exact tree takes time that grows threefold with every end.
MOST_ENDS = 12


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
        entry = csr_matrix((joined[reached] + 1e-12, (np.zeros(len(reached)), reached)), shape=(1, n + 1))
        wide = csr_matrix((graph.data, graph.indices, graph.indptr), shape=(n, n + 1))
        best[subset] = dijkstra(vstack([wide, entry]).tocsr(), indices=n)[:n]
    return float(best[(1 << k) - 1][ends[k]])


def cotree_length(V, F):
    """Length of the tree-cotree cut with geodesic lengths from vertex 0, or from the boundaries."""
    surface = triangle_surface(V, F)
    faces, triangles, owner = chosen_triangles(surface, None)
    gluing = repaired_gluing(surface, faces, triangles, owner).gluing
    ease = np.ones(len(gluing.first))
    everything = np.arange(len(F)), np.arange(len(ease))
    piece = make_piece(gluing, V, corner_classes(gluing), *everything, np.zeros(len(V)), ease)
    piece.cost[:] = piece.length
    root = np.array([0] if len(piece.rim) == 0 else [], np.int64)
    return float(piece.length[greedy_arcs(piece, root)].sum())


def row(name):
    V, F = meshes.load_model(name)
    extent = np.ptp(V, axis=0).max()
    surface = triangle_surface(V, F)
    start = time.perf_counter()
    cuts = cut(surface)
    seconds = time.perf_counter() - start
    (piece,) = cuts.pieces
    cells = {"model": name, "faces": len(F), "handles": piece.handles, "boundaries": piece.boundaries,
             "tips": len(piece.extremities), "length": cuts.length / extent, "seconds": seconds}  # fmt: skip
    if piece.handles:
        cells["cotree"] = cotree_length(V, F) / extent
        cells["ratio"] = cut(surface, extremities=0).length / extent / cells["cotree"]
    else:
        cells["tree"] = shortest_tree(V, F, piece.extremities) / extent
        cells["ratio"] = cells["length"] / cells["tree"]
    return cells


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("models", nargs="*", metavar="MODEL", help="published models; default: all that need a cut")
    options.add_argument("-o", "--output", type=Path, help="write the table as TSV")
    options = options.parse_args()
    table = Table("Length of cuts", COLUMNS)
    for name in options.models or [m for m in MODELS if meshes.model_path(m)]:
        table.add(**row(name))
    if options.output:
        table.write(options.output)


if __name__ == "__main__":
    main()
