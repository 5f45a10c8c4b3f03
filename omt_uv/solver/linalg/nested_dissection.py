"""Order the elimination of meshes' vertices for little fill, by nested dissection of their places (George 1973).

Every part is halved across its longest side; the vertices of the upper half that have neighbours in the lower one
separate the two, and are eliminated after both. The halves stay when edges flip, only the separators are found anew. On
large meshes that is faster than a minimum degree order, and so are its factors, as their columns come in large blocks.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from ..mesh.topology import halfedges
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
    # The points of a part, in the order they came in, -1 where there is one more in another.
    rows = np.arange(len(points), dtype=np.int32)[None]
    coordinates = np.ascontiguousarray(points.T)
    for _ in range(depth if len(points) else 0):
        rows = _halved(coordinates, rows)
    part, there = np.empty(len(points), np.int64), rows >= 0
    part[rows[there]] = np.nonzero(there)[0]
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


def _halved(coordinates: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The points of the lower and the upper half of each part, (2p,s), by coordinates (d,n) and those of parts (p,r).

    Parts are sorted each by itself, which takes two thirds of the time of all at once.
    """
    there = rows >= 0
    size = there.sum(axis=1)
    # Longest sides do not change where a point is there twice.
    box = coordinates[:, np.where(there, rows, np.maximum(rows[:, :1], 0))]
    along = box[(box.max(axis=2) - box.min(axis=2)).argmax(axis=0), np.arange(len(rows))]
    del box
    along[~there] = np.inf
    order = np.argsort(along, axis=1, kind="stable")
    lower = np.zeros(rows.shape, bool)
    np.put_along_axis(lower, order, np.arange(rows.shape[1]) < (size // 2)[:, None], axis=1)
    sizes = np.column_stack([size // 2, size - size // 2])
    found = np.full((len(rows), 2, int(sizes.max(initial=0))), -1, np.int32)
    kept = np.arange(found.shape[2]) < sizes[:, :, None]
    for half, some in enumerate((lower, ~lower & there)):
        found[:, half][kept[:, half]] = rows[some]
    return found.reshape(2 * len(rows), -1)
