"""Develop flat surfaces into the plane, triangle by triangle, however many and however long they are.

Every triangle is placed beside its parent in a tree of neighbours; the motions along the tree are composed by pointer
doubling. Where a surface has no curvature that is exact to rounding, while the condition of a system of equations
grows with the fourth power of the length of a strip. The tree is as shallow as can be, or crosses the longest edges
there are: where the small patches at the corners of bevels are curved, what they disagree by is theirs alone then.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from ..mesh.geometry import as_points, cross3, dot3, halfedge_lengths, lengths
from ..mesh.topology import graph_components, twins

# Triangles that disagree by no more than this, over the extent, lie flat together.
FLAT = 1e-4
# Edges shorter than this share of the longest are all the same.
SHORT = 1e-9


def developed(positions: np.ndarray, triangles: np.ndarray, across_long: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Places (n,) complex of the vertices of flat components (n,3), (m,3), and how far their triangles disagree, (n,).

    Edges keep their lengths where triangles agree. Each component has a place of its own.
    across_long : the tree crosses the longest edges
    """
    local = _local_frames(positions, triangles)
    turn, shift = _composed(*_motions(local, triangles, across_long))
    corners = (turn[:, None] * local + shift[:, None]).ravel()
    flat, n = triangles.ravel(), len(positions)
    count = np.maximum(np.bincount(flat, minlength=n), 1)
    w = (np.bincount(flat, corners.real, n) + 1j * np.bincount(flat, corners.imag, n)) / count
    gap = np.zeros(n)
    np.maximum.at(gap, flat, np.abs(corners - w[flat]))
    return w, gap


def unrolled(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """Places (n,2) of a disk (n,3), (m,3) that lies flat once it is developed; None where it has curvature."""
    w, gap = developed(positions, triangles)
    extent = float(np.ptp(positions[np.unique(triangles)], axis=0).max())
    return as_points(w) if gap.max() <= FLAT * extent else None


def _local_frames(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Corners (m,3) complex of every triangle in a plane of its own, the first edge along the real axis."""
    length = halfedge_lengths(positions, triangles).reshape(-1, 3)
    base, right, left = length.T
    p = np.take(positions, triangles, axis=0)
    one, other = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    height = lengths(cross3(one, other)) / np.maximum(base, 1e-300)
    along = dot3(one, other) / np.maximum(base, 1e-300)
    return np.stack([np.zeros(len(base), complex), base.astype(complex), along + 1j * height], axis=1)


def _motions(local: np.ndarray, triangles: np.ndarray, across_long: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parents (m,) in a forest of neighbours, a root its own, and the turn and shift (m,) complex into their frames."""
    m = len(triangles)
    twin = twins(triangles)
    inner = np.flatnonzero(twin >= 0)
    _, component = graph_components(inner // 3, twin[inner] // 3, m)
    roots = np.unique(component, return_index=True)[1]
    one, other = inner // 3, twin[inner] // 3
    if across_long:
        length = np.nan_to_num(np.abs(np.roll(local, -1, axis=1) - local).ravel()[inner], nan=0.0, posinf=0.0)
        price = 1 / np.maximum(length / np.maximum(length.max(initial=0.0), 1e-300), SHORT)
        forest = minimum_spanning_tree(coo_matrix((price, (one, other)), shape=(m, m)).tocsr()).tocoo()
        one, other = forest.row, forest.col
    # One more node, beside all roots, makes the forest a tree.
    rows = np.concatenate([one, np.full(len(roots), m), roots])
    columns = np.concatenate([other, roots, np.full(len(roots), m)])
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(m + 1, m + 1)).tocsr()
    parent = breadth_first_order(graph, m, directed=False)[1][:m].astype(np.int64)
    parent[roots] = roots
    child = inner[twin[inner] // 3 == parent[inner // 3]]
    edge = np.full(m, -1)
    edge[child // 3] = child
    turn, shift = np.ones(m, complex), np.zeros(m, complex)
    t = np.flatnonzero(edge >= 0)
    h, g = edge[t], twin[edge[t]]
    tail, head = local.ravel()[h], local.ravel()[h + 1 - 3 * (h % 3 == 2)]
    far, near = local.ravel()[g], local.ravel()[g + 1 - 3 * (g % 3 == 2)]
    turn[t] = (far - near) * (head - tail).conj()
    turn[t] /= np.maximum(np.abs(turn[t]), 1e-300)
    shift[t] = (far + near) / 2 - turn[t] * (head + tail) / 2
    return parent, turn, shift


def _composed(parent: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn and shift (m,) into the frames of the roots, by pointer doubling."""
    while (parent[parent] != parent).any():
        shift = shift[parent] + turn[parent] * shift
        turn = turn[parent] * turn
        turn /= np.maximum(np.abs(turn), 1e-300)
        parent = parent[parent]
    return turn, shift
