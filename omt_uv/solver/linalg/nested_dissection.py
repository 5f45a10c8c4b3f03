"""Order the elimination of meshes' vertices for little fill, by nested dissection of their places (George 1973).

Every part is halved across its longest side; the vertices of the upper half that have neighbours in the lower one
separate the two, and are eliminated after both. The halves stay when edges flip, only the separators are found anew. On
large meshes that is faster than a minimum degree order, and so are its factors, as their columns come in large blocks.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from ..mesh.topology import expand, halfedges
from .sparse import minimum_degree

# From this many vertices on dissection is the better order of the two; on fewer, minimum degree has less fill.
LARGE = 100_000
# Parts of this many vertices are not halved any more.
LEAF = 16
# Edges that are looked at together.
AT_ONCE = 100_000


class Dissection:
    """Elimination orders of graphs on fixed points (n,d)."""

    def __init__(self, points: np.ndarray):
        n = len(points)
        self.depth = max(0, int(np.ceil(np.log2(max(n, 1) / LEAF))))
        # The k-th bit from above: which half of its part at level k.
        self.part = kd_parts(points, self.depth)

    def order(self, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
        """Elimination order (n,), `order[k]` the k-th unknown, of the graph with the edges tail, head (e,)."""
        level = np.full(len(self.part), self.depth)
        # Some after the others: what is found of all edges takes more memory than the mesh.
        for begin in range(0, len(tail), AT_ONCE):
            here = slice(begin, begin + AT_ONCE)
            a, b = self.part[tail[here]], self.part[head[here]]
            # The first level at which the two ends part; the greater number is the upper half.
            parting = self.depth - np.frexp((a ^ b).astype(float))[1]
            np.minimum.at(level, np.where(a > b, tail[here], head[here]), parting)
        # A separator comes when its part has been eliminated, the smaller ones first.
        below = self.depth - level
        return np.lexsort((below, ((self.part >> below) + 1) << below))


def kd_parts(points: np.ndarray, depth: int) -> np.ndarray:
    """Part (n,) of every point (n,d), of 2^depth parts of the same size, halved across their longest sides."""
    part = np.zeros(len(points), np.int64)
    for k in range(depth):
        part = 2 * part + _upper_half(points, part, 1 << k)
    return part


def mesh_order(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Elimination order (n,) for the vertices of a mesh (n,d), (m,3), the better of the two for its size."""
    if len(points) < LARGE:
        return minimum_degree(vertex_graph(triangles, len(points)))
    return Dissection(points).order(*halfedges(triangles))


def vertex_graph(triangles: np.ndarray, n: int) -> csc_matrix:
    """Which of n vertices share a triangle (m,3), and every one itself: (n,n), entries positive."""
    (tail, head), every = halfedges(triangles), np.arange(n)
    pairs = np.concatenate([tail, head, every]), np.concatenate([head, tail, every])
    return csc_matrix((np.ones(len(pairs[0])), pairs), shape=(n, n))


def _upper_half(points: np.ndarray, part: np.ndarray, count: int) -> np.ndarray:
    """Which points (k,d) lie in the upper half of their part (k,), by number, along the longest side of its box."""
    size = np.bincount(part, minlength=count)
    order = np.argsort(part, kind="stable")
    first = (np.cumsum(size) - size)[size > 0]
    sorted_points = points[order]
    extent = np.zeros((count, points.shape[1]))
    extent[size > 0] = np.maximum.reduceat(sorted_points, first) - np.minimum.reduceat(sorted_points, first)
    along = points[np.arange(len(points)), extent.argmax(axis=1)[part]]
    order = np.lexsort((along, part))
    rank = np.empty(len(points), np.int64)
    rank[order] = expand(size)[1]
    return rank >= (size // 2)[part]
