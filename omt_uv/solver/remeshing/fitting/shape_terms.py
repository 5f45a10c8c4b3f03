"""Keep triangles in shape while a mesh is fitted: forces to equilateral triangles, and even displacements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...mesh.geometry import cross3, face_normals, least_angles, of_corners
from ...mesh.topology import halfedges

# Angle, radians, below which forces set in,
SMALL = np.radians(44.0)
# and at which they have their full strength; at most they have twice as much.
SMALLER = np.radians(36.0)
# Full strength, next to the distances.
STRENGTH = 0.5


def smallness(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How small the least angle of every triangle is, (m,) in [0,2]: 0 from SMALL on, 1 at SMALLER."""
    return np.clip((SMALL - least_angles(points, triangles)) / (SMALL - SMALLER), 0, 2)


@dataclass(frozen=True)
class ShapeForces:
    """A matrix of scalars, its diagonal (n,), and what every halfedge adds between its ends, both ways, (3m,); and a
    force (n,3)."""

    diagonal: np.ndarray
    between: np.ndarray
    force: np.ndarray


def equilateral(points: np.ndarray, triangles: np.ndarray, bad: np.ndarray) -> ShapeForces:
    """Forces of triangles (m,3), in proportion to `bad` (m,), to the equilateral ones nearest to them.

    The squared differences of their corners from their targets, both about their centroids. With R the rotation by a
    third about the normal, the target of the first corner is (o_0 + R^-1 o_1 + R o_2) / 3 for the corners' offsets o
    from the centroid, and the others are R and R^-1 of it.
    """
    n, mine = len(points), np.flatnonzero(bad > 0)
    t, weight = triangles[mine], STRENGTH * bad[mine]
    p = points.take(t, axis=0)
    off = p - (of_corners(np.add, p) / 3)[:, None]
    normal = face_normals(points, t)

    def turned(v, sign):
        return -v / 2 + sign * np.sqrt(3) / 2 * cross3(normal, v)

    first = (off[:, 0] + turned(off[:, 1], -1) + turned(off[:, 2], 1)) / 3
    target = np.stack([first, turned(first, 1), turned(first, -1)], axis=1)
    pull = weight[:, None, None] * (target - off)
    force = np.stack([np.bincount(t.ravel(), pull[..., k].ravel(), n) for k in range(3)], axis=1)
    # The squares of three offsets from their mean are a third of those of their differences.
    between = np.zeros((len(triangles), 3))
    between[mine] = -weight[:, None] / 3
    return ShapeForces(np.bincount(t.ravel(), np.repeat(2 * weight / 3, 3), n), between.ravel(), force)


class Fairness:
    """Squared difference of every displacement of a mesh (m,3), (3m,) with n vertices from the mean of its neighbours'.

    diagonal (n,): of the matrix
    """

    def __init__(self, triangles: np.ndarray, twin: np.ndarray, n: int):
        tail, head = halfedges(triangles)
        boundary = twin < 0
        rows, columns = np.concatenate([tail, head[boundary]]), np.concatenate([head, tail[boundary]])
        weight = 1 / np.maximum(np.bincount(rows, minlength=n), 1)
        self._mean = sp.csr_matrix((weight[rows], (rows, columns)), shape=(n, n))
        self._back = self._mean.T.tocsr()
        self.diagonal = 1 + np.bincount(columns, weight[rows] ** 2, n)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Half the gradient (n,3) at displacements (n,3)."""
        off = x - self._mean @ x
        return off - self._back @ off
