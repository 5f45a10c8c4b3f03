"""What keeps triangles in shape while a mesh is fitted: matrices over the displacements (3n,) of its vertices."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from .closest import face_normals
from .geometry import angles_from_lengths, halfedge_lengths, laplacian_from_weights

# Where angles fall below the first, springs set in, and are twice as strong as STRENGTH at most where they are smaller
# than twice the way to the second.
SMALL, SMALLER = np.radians(44.0), np.radians(36.0)
STRENGTH = 0.5


def smallness(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How small the least angle of every triangle is, (m,) in [0,2]: 0 from SMALL on, 1 at SMALLER."""
    angle = angles_from_lengths(halfedge_lengths(points, triangles).reshape(-1, 3)).min(axis=1)
    return np.clip((SMALL - angle) / (SMALL - SMALLER), 0, 2)


def equilateral(points: np.ndarray, triangles: np.ndarray, bad: np.ndarray) -> tuple[sp.spmatrix, np.ndarray]:
    """Springs of triangles, in proportion to `bad` (m,), to the equilateral ones nearest to them.

    Matrix (3n,3n) and right side (3n,) of the squared differences of their corners from their targets, both about
    their centroids. With R the rotation by a third about the normal, the target of the first corner is
    (o_0 + R^-1 o_1 + R o_2) / 3 for the corners' offsets o from the centroid, and the others are R and R^-1 of it.
    """
    n, mine = len(points), np.flatnonzero(bad > 0)
    t, weight = triangles[mine], STRENGTH * bad[mine]
    off = points[t] - points[t].mean(axis=1, keepdims=True)
    normal = face_normals(points, t)

    def turned(v, sign):
        return -v / 2 + sign * np.sqrt(3) / 2 * np.cross(normal, v)

    first = (off[:, 0] + turned(off[:, 1], -1) + turned(off[:, 2], 1)) / 3
    target = np.stack([first, turned(first, 1), turned(first, -1)], axis=1)
    pull = weight[:, None, None] * (target - off)
    force = np.stack([np.bincount(t.ravel(), pull[..., k].ravel(), n) for k in range(3)], axis=1)
    # The squares of three offsets from their mean are a third of those of their differences.
    graph = laplacian_from_weights(t.ravel(), t[:, [1, 2, 0]].ravel(), np.repeat(weight / 3, 3), n)
    return sp.kron(graph, sp.identity(3), format="csr"), force.ravel()


def fairness(triangles: np.ndarray, n: int) -> sp.spmatrix:
    """Squared difference of every displacement (3n,) from the mean of its neighbours'."""
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    graph = sp.csr_matrix((np.ones(2 * len(tail)), (np.r_[tail, head], np.r_[head, tail])), shape=(n, n))
    graph.data[:] = 1
    degree = np.maximum(np.diff(graph.indptr), 1)
    difference = sp.identity(n) - sp.diags(1 / degree) @ graph
    return sp.kron(difference.T @ difference, sp.identity(3))
