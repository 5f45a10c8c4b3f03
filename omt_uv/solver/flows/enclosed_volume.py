"""Measure the volume that closed triangles enclose, and bring it back to what it was.

A flow keeps the volume of what is inside a smooth surface. Flat triangles between vertices that flow lose a little of
it, with the square of their size; a move along the normals, much smaller than a triangle, gives that back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import cross3
from ..mesh.topology import graph_components, halfedges, pair_keys

# Steps on the offset at most, and how many go along the same normals.
ROUNDS = 16
SAME_NORMALS = 4
# A relative change of volume that needs no further step.
EXACT = 1e-13
# What is missing is less than this share of what was missing before a step, or steps do not help any more.
LESS = 0.5


def corner_volumes(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Six times the signed volume (m,) between every triangle (m,3) of vertices (n,3) and the origin: over
    closed triangles that look outwards they sum to six times what these enclose."""
    corner = vertices[triangles]
    return np.einsum("mi,mi->m", corner[:, 0], cross3(corner[:, 1], corner[:, 2]))


@dataclass(frozen=True)
class EnclosedParts:
    """Connected parts of triangles (m,3): the part (n,) of each vertex, and which parts (c,) bool are closed.

    Vertices of no triangle are parts of no volume; that of open parts depends on the origin and means nothing.
    """

    triangles: np.ndarray
    part: np.ndarray
    closed: np.ndarray

    @staticmethod
    def of(triangles: np.ndarray, n: int) -> EnclosedParts:
        """The parts of triangles (m,3) among n vertices."""
        _, part = graph_components(*halfedges(triangles), n)
        return EnclosedParts(triangles, part, closed_parts(triangles, part))

    def volumes(self, vertices: np.ndarray) -> np.ndarray:
        """Signed volume (c,) that every part encloses at vertices (n,3)."""
        volume = corner_volumes(vertices - vertices.mean(axis=0), self.triangles) / 6
        return np.bincount(self.part[self.triangles[:, 0]], volume, len(self.closed))


def component_volumes(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed volume (c,) enclosed by every connected part of triangles (m,3) of vertices (n,3), and the part (n,) of
    each vertex; see `EnclosedParts`."""
    parts = EnclosedParts.of(triangles, len(vertices))
    return parts.volumes(vertices), parts.part


def closed_parts(triangles: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Which parts (c,) bool have two faces at every edge that look the same way round; part (n,) of each vertex."""
    tail, head = halfedges(triangles)
    _, inverse, count = np.unique(pair_keys(tail, head), return_inverse=True, return_counts=True)
    turns = np.bincount(inverse.ravel(), np.where(tail < head, 1.0, -1.0), len(count))
    wrong = (count != 2) | (turns != 0)
    closed = np.zeros(int(part.max(initial=-1)) + 1, bool)
    closed[part[triangles[:, 0]]] = True
    closed[part[tail[wrong[inverse.ravel()]]]] = False
    return closed


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Gradient (n,3) of the enclosed volume: a third of the area around each vertex, outwards."""
    p = vertices[triangles]
    normal = cross3(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 6
    flat = triangles.ravel()
    each = np.repeat(normal, 3, axis=0)
    return np.stack([np.bincount(flat, each[:, k], len(vertices)) for k in range(3)], axis=1)


def restore_volumes(
    before: np.ndarray, after: np.ndarray, parts: EnclosedParts, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) near `after` (n,3) whose closed parts enclose what those of `before` (n,3) did, and the relative
    change of every closed part that is left. Only vertices `free` (n,) bool move, all of a part by one length."""
    target = parts.volumes(before)
    closed = parts.closed & (np.abs(target) > 0)
    position = after.copy()
    missing = np.full(len(target), np.inf)
    for left in range(ROUNDS, -1, -1):
        before_that, missing = missing, np.where(closed, target - parts.volumes(position), 0.0)
        wrong = np.abs(missing) > EXACT * np.abs(target)
        # Rounding leaves what no step makes less.
        if not left or not (wrong & (np.abs(missing) < LESS * np.abs(before_that))).any():
            break
        if (ROUNDS - left) % SAME_NORMALS == 0:
            normal = vertex_normals(position, parts.triangles)
            length = np.linalg.norm(normal, axis=1)
            unit = normal * (free / np.where(length > 0, length, 1))[:, None]
            slope = np.bincount(parts.part, np.einsum("nd,nd->n", normal, unit), len(target))
        offset = np.where(slope > 0, missing / np.where(slope > 0, slope, 1), 0.0)
        position += offset[parts.part][:, None] * unit
    return position, -missing[closed] / np.abs(target[closed])
