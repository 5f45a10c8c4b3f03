"""Measure the volume that closed triangles enclose, and bring it back to what it was.

A flow keeps the volume of what is inside a smooth surface. Flat triangles between vertices that flow lose a little of
it, with the square of their size; a move along the normals, much smaller than a triangle, gives that back.
"""

from __future__ import annotations

import numpy as np

from ..mesh.topology import graph_components, halfedges, pair_keys

# Newton steps on the offset; the volume is a polynomial of degree 3 in it.
ROUNDS = 6


def corner_volumes(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Six times the signed volume (m,) between every triangle (m,3) of vertices (n,3) and the origin: over
    closed triangles that look outwards they sum to six times what these enclose."""
    corner = vertices[triangles]
    return np.einsum("mi,mi->m", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))


def component_volumes(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed volume (c,) enclosed by every connected part of triangles (m,3) of vertices (n,3), and the part (n,) of
    each vertex. Loose vertices are parts of no volume; that of open parts depends on the origin and means nothing."""
    count, part = graph_components(*halfedges(triangles), len(vertices))
    volume = corner_volumes(vertices - vertices.mean(axis=0), triangles) / 6
    return np.bincount(part[triangles[:, 0]], volume, count), part


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
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 6
    flat = triangles.ravel()
    each = np.repeat(normal, 3, axis=0)
    return np.stack([np.bincount(flat, each[:, k], len(vertices)) for k in range(3)], axis=1)


def restore_volumes(
    before: np.ndarray, after: np.ndarray, triangles: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) near `after` (n,3) whose closed parts enclose what those of `before` (n,3) did, and the relative
    change of every closed part that is left. Only vertices `free` (n,) bool move, all of a part by one length."""
    target, part = component_volumes(before, triangles)
    closed = closed_parts(triangles, part) & (np.abs(target) > 0)
    position = after.copy()
    for _ in range(ROUNDS):
        volume, _ = component_volumes(position, triangles)
        normal = vertex_normals(position, triangles)
        length = np.linalg.norm(normal, axis=1)
        unit = np.where(length[:, None] > 0, normal / np.where(length > 0, length, 1)[:, None], 0.0) * free[:, None]
        slope = np.bincount(part, np.einsum("nd,nd->n", normal, unit), len(target))
        offset = np.where(closed & (slope > 0), (target - volume) / np.where(slope > 0, slope, 1), 0.0)
        position += offset[part][:, None] * unit
    volume, _ = component_volumes(position, triangles)
    return position, (volume[closed] - target[closed]) / np.abs(target[closed])
