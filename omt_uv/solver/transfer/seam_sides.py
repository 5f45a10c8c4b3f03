"""On which side of the seams the corners of new faces are, and where: walks over the old mesh that cross no seam.

A face next to a seam takes a place that is on its side for certain, walks to its home from there, and from its home to
its corners. Where it reaches across a seam all the same, the values of its home's side are extended.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.cut_mesh import ON_EDGE, CutMesh, apart, descend, seam_points
from ..mesh.topology import halfedges

# Nearer than this share of the extent is the same point.
SAME_POINT = 1e-7
# Vertices nearer to a seam than this share of an edge may be beyond it.
UNSURE = 0.4
WITNESS_ROUNDS = 20
# The longest way over the surface that is looked for, in straight lines.
LONGEST_WAY = 6.0
# Beyond this, a triangle is too slim to say what lies next to it.
MOST_EXTENDED = 8.0


def witnesses(
    mesh: CutMesh, new_triangles: np.ndarray, free: np.ndarray, lifted: np.ndarray, spacing: float
) -> np.ndarray:
    """For every new vertex (k,) one that is on the same side of the seams, and so far from them that this is sure.

    New edges that follow a crooked seam cut its corners, and vertices next to them may lie beyond the old seam.
    Vertices that are on no seam, `free` (k,), and joined by an edge are on the same side where seams are kept.
    """
    points, _ = seam_points(mesh, spacing / 8)
    sure = free & (cKDTree(points).query(lifted)[0] > UNSURE * spacing) if len(points) else free
    witness = np.where(sure, np.arange(len(free)), -1)
    tail, head = halfedges(new_triangles)
    open_ = free[tail] & free[head]
    a, b = np.concatenate([tail[open_], head[open_]]), np.concatenate([head[open_], tail[open_]])
    for _ in range(WITNESS_ROUNDS):
        asking = (witness[a] < 0) & (witness[b] >= 0)
        if not asking.any():
            break
        witness[a[asking]] = witness[b[asking]]
    return np.where(witness < 0, np.arange(len(free)), witness)


def homes(
    mesh: CutMesh,
    new_triangles: np.ndarray,
    free: np.ndarray,
    start: np.ndarray,
    centres: np.ndarray,
    nearest: np.ndarray,
) -> np.ndarray:
    """Home triangle (t,) of new faces (t,3) whose centroids are at `centres` (t,3), `nearest` (t,) to them.

    Next to a crooked seam the nearest triangle may be on the other side. So descents start from triangles `start`
    (k,) that are on the side of each `free` (k,) vertex, and the end of that which comes nearest to the centre is home.
    """
    distance = np.full(new_triangles.shape, np.inf)
    end = np.repeat(nearest[:, None], 3, axis=1)
    row, column = np.nonzero(free[new_triangles])
    end[row, column], distance[row, column] = descend(mesh, centres[row], start[new_triangles[row, column]])
    return end[np.arange(len(end)), distance.argmin(axis=1)]


def corners_of(
    mesh: CutMesh,
    new_triangles: np.ndarray,
    home: np.ndarray,
    free: np.ndarray,
    lifted: np.ndarray,
    faces: np.ndarray,
    barycentric: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Triangle (t,3), coordinates (t,3,3) and side (t,3) of the corners of new faces, and how many were extended.

    The side is -1 where a vertex has one only.
    """
    flat = new_triangles.ravel()
    end, reached, own = _sought(mesh, np.repeat(home, 3), lifted[flat], faces[flat], free[flat])
    weights = _coordinates(mesh, lifted[flat], end)
    weights[reached] = np.clip(weights[reached], 0, 1)
    weights /= weights.sum(axis=1, keepdims=True)
    end[own], weights[own] = faces[flat[own]], barycentric[flat[own]]
    # At an old vertex a side is a fan of triangles, on an old edge one triangle.
    corner = weights.argmax(axis=1)
    at_vertex = weights.max(axis=1) > 1 - 2 * ON_EDGE
    side = np.where(at_vertex, len(mesh.triangles) + mesh.sides[end, corner], end)
    side = np.where(own & free[flat], -1, side)
    side = np.where(reached, side, -2 - end)
    extended = int((~reached).reshape(-1, 3).any(axis=1).sum())
    shape = new_triangles.shape
    return end.reshape(shape), weights.reshape(*shape, 3), side.reshape(shape), extended


def _sought(
    mesh: CutMesh, start: np.ndarray, points: np.ndarray, faces: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles (k,) as near to points (k,3) as a way from `start` (k,) leads, and whether it leads there.

    faces (k,): triangles that the points lie on, the only ones for `free` (k,) points. Returned last: whether these
    are on the same side as `start`, so that what is known of the points holds.
    """
    end, distance = descend(mesh, points, start)
    reached = distance <= SAME_POINT * np.ptp(mesh.positions, axis=0).max()
    own = reached & free
    stuck = np.flatnonzero(~reached)
    corners = mesh.positions[mesh.triangles[start[stuck]]]
    size = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    limit = LONGEST_WAY * np.linalg.norm(points[stuck] - corners.mean(axis=1), axis=1) + size
    own[stuck] = ~apart(mesh, start[stuck], faces[stuck], limit, size)
    return end, reached | own, own


def _coordinates(mesh: CutMesh, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (k,3) of points projected to the planes of triangles (k,), below 0 outside of them."""
    a, b, c = (mesh.positions[mesh.triangles[faces, k]] for k in range(3))
    u, v, w = b - a, c - a, points - a
    uu, uv, vv, wu, wv = (np.einsum("kj,kj->k", *pair) for pair in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    determinant = uu * vv - uv * uv
    safe = determinant > 1e-14 * uu * vv
    scale = np.where(safe, determinant, 1)
    s, t = (vv * wu - uv * wv) / scale, (uu * wv - uv * wu) / scale
    weights = np.stack([1 - s - t, s, t], axis=1)
    slim = ~safe | (np.abs(weights).max(axis=1) > MOST_EXTENDED)
    weights = np.where(slim[:, None], np.clip(np.where(safe[:, None], weights, 1 / 3), 0, 1), weights)
    return weights / weights.sum(axis=1, keepdims=True)


def unite(
    new_triangles: np.ndarray,
    alone: np.ndarray,
    corner_triangle: np.ndarray,
    corner_weights: np.ndarray,
    side: np.ndarray,
) -> None:
    """Give all corners of vertices `alone` (k,) the side that most of them have; arrays (t,3), (t,3,3), (t,3) in place.

    Next to boundaries that touch, single faces may have found the other one.
    """
    corner = np.flatnonzero(alone[new_triangles.ravel()])
    # All that could not reach the vertex agree in that: it lies, as on a thin part, on the sheet behind.
    vertex, own = new_triangles.ravel()[corner], np.maximum(side.ravel()[corner], -2)
    order = np.lexsort([own, vertex])
    first = np.flatnonzero(np.r_[True, (np.diff(vertex[order]) != 0) | (np.diff(own[order]) != 0)][: len(order)])
    votes = np.diff(np.r_[first, len(order)])
    best = np.lexsort([-votes, vertex[order[first]]])
    voters = vertex[order[first]][best]
    elected = order[first[best[np.r_[True, np.diff(voters) != 0][: len(best)]]]]
    leader = np.zeros(len(alone), np.int64)
    leader[vertex[elected]] = corner[elected]
    chosen = leader[vertex]
    corner_triangle.ravel()[corner] = corner_triangle.ravel()[chosen]
    corner_weights.reshape(-1, 3)[corner] = corner_weights.reshape(-1, 3)[chosen]
    side.ravel()[corner] = side.ravel()[chosen]
