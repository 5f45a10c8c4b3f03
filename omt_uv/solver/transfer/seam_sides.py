"""Find the side of the seams on which corners of new faces are, by walks over the old mesh that cross no seam.

A face next to a seam starts from a vertex that is on its side for certain, walks to the triangle under its centroid
from there, and on to its corners. Where it reaches across a seam all the same, the values of its side are extended.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.cut_mesh import ON_EDGE, CutMesh, are_across_seams, descend, seam_points
from ..mesh.topology import halfedges

# Nearer than this share of the extent is the same point.
SAME_POINT = 1e-7
# Share of the median edge: vertices nearer to a seam may be beyond it.
UNSURE = 0.4
# Rounds in which vertices learn their side from a neighbour.
REFERENCE_ROUNDS = 20
# The longest way over the surface that is looked for, in straight lines.
LONGEST_WAY = 6.0
# Barycentric coordinate beyond which a triangle is too slim to say what lies next to it.
MOST_EXTENDED = 8.0
# Squared sine of an angle below which a triangle has no plane.
DEGENERATE = 1e-14


def reference_vertices(
    mesh: CutMesh, new_triangles: np.ndarray, free: np.ndarray, lifted: np.ndarray, spacing: float
) -> np.ndarray:
    """For every new vertex (k,) one that is on the same side of the seams, and so far from them that this is sure.

    New edges that follow a crooked seam cut its corners, and vertices next to them may lie beyond the old seam.
    Vertices that are on no seam, `free` (k,), and joined by an edge are on the same side where seams are kept. lifted
    (k,3): the new vertices on the old surface; spacing: median length of the new edges. A vertex that finds none is
    its own.
    """
    points, _ = seam_points(mesh, spacing / 8)
    sure = free & (cKDTree(points).query(lifted)[0] > UNSURE * spacing) if len(points) else free
    reference = np.where(sure, np.arange(len(free)), -1)
    tail, head = halfedges(new_triangles)
    open_ = free[tail] & free[head]
    a, b = np.concatenate([tail[open_], head[open_]]), np.concatenate([head[open_], tail[open_]])
    for _ in range(REFERENCE_ROUNDS):
        asking = (reference[a] < 0) & (reference[b] >= 0)
        if not asking.any():
            break
        reference[a[asking]] = reference[b[asking]]
    return np.where(reference < 0, np.arange(len(free)), reference)


def locate_faces(
    mesh: CutMesh,
    new_triangles: np.ndarray,
    free: np.ndarray,
    start: np.ndarray,
    centres: np.ndarray,
    nearest: np.ndarray,
) -> np.ndarray:
    """Old triangle (t,) under each of the new faces (t,3) with centroids `centres` (t,3), on its side of the seams.

    Next to a crooked seam the `nearest` (t,) triangle may be on the other side. So descents start from triangles
    `start` (k,) that are on the side of each `free` (k,) vertex, and the end that comes nearest to the centre is taken.
    """
    distance = np.full(new_triangles.shape, np.inf)
    end = np.repeat(nearest[:, None], 3, axis=1)
    row, column = np.nonzero(free[new_triangles])
    end[row, column], distance[row, column] = descend(mesh, centres[row], start[new_triangles[row, column]])
    return end[np.arange(len(end)), distance.argmin(axis=1)]


def locate_corners(
    mesh: CutMesh,
    new_triangles: np.ndarray,
    face_triangle: np.ndarray,
    free: np.ndarray,
    lifted: np.ndarray,
    faces: np.ndarray,
    barycentric: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Triangle (t,3), coordinates (t,3,3) and side (t,3) of the corners of new faces, and how many were extended.

    face_triangle (t,): old triangle under each face; free (k,), lifted (k,3), faces (k,), barycentric (k,3): of the new
    vertices, whether on no seam, and where. A side is a number that corners of one vertex share just when no seam
    parts them: -1 where a vertex has one side only, below that where the face reaches across a seam.
    """
    flat = new_triangles.ravel()
    end, reached, own = _sought(mesh, np.repeat(face_triangle, 3), lifted[flat], faces[flat], free[flat])
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
    # What touches the point may be another component, as where walls stand on a plate unjoined.
    beside = (mesh.sides[end][:, :, None] == mesh.sides[faces][:, None, :]).any(axis=(1, 2))
    own = reached & free & beside
    stuck = np.flatnonzero(~reached)
    corners = mesh.positions[mesh.triangles[start[stuck]]]
    size = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    limit = LONGEST_WAY * np.linalg.norm(points[stuck] - corners.mean(axis=1), axis=1) + size
    own[stuck] = ~are_across_seams(mesh, start[stuck], faces[stuck], limit, size)
    return end, reached | own, own


def _coordinates(mesh: CutMesh, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (k,3) of points projected to the planes of triangles (k,), below 0 outside of them."""
    a, b, c = (mesh.positions[mesh.triangles[faces, k]] for k in range(3))
    u, v, w = b - a, c - a, points - a
    uu, uv, vv, wu, wv = (np.einsum("kj,kj->k", *pair) for pair in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    determinant = uu * vv - uv * uv
    safe = determinant > DEGENERATE * uu * vv
    scale = np.where(safe, determinant, 1)
    s, t = (vv * wu - uv * wv) / scale, (uu * wv - uv * wu) / scale
    weights = np.stack([1 - s - t, s, t], axis=1)
    slim = ~safe | (np.abs(weights).max(axis=1) > MOST_EXTENDED)
    weights = np.where(slim[:, None], np.clip(np.where(safe[:, None], weights, 1 / 3), 0, 1), weights)
    return weights / weights.sum(axis=1, keepdims=True)


def agree_on_sides(
    new_triangles: np.ndarray,
    one_sided: np.ndarray,
    corner_triangle: np.ndarray,
    corner_weights: np.ndarray,
    side: np.ndarray,
) -> None:
    """Give all corners of vertices `one_sided` (k,) the side of most of them, by vote.

    Next to boundaries that touch, single faces may have found the other one. corner_triangle (t,3), corner_weights
    (t,3,3) and side (t,3) are changed in place.
    """
    corner = np.flatnonzero(one_sided[new_triangles.ravel()])
    # All that could not reach the vertex agree in that: it lies, as on a thin wall, on the surface behind.
    vertex, own = new_triangles.ravel()[corner], np.maximum(side.ravel()[corner], -2)
    order = np.lexsort([own, vertex])
    first = np.flatnonzero(np.r_[True, (np.diff(vertex[order]) != 0) | (np.diff(own[order]) != 0)][: len(order)])
    votes = np.diff(np.r_[first, len(order)])
    best = np.lexsort([-votes, vertex[order[first]]])
    voters = vertex[order[first]][best]
    elected = order[first[best[np.r_[True, np.diff(voters) != 0][: len(best)]]]]
    leader = np.zeros(len(one_sided), np.int64)
    leader[vertex[elected]] = corner[elected]
    chosen = leader[vertex]
    corner_triangle.ravel()[corner] = corner_triangle.ravel()[chosen]
    corner_weights.reshape(-1, 3)[corner] = corner_weights.reshape(-1, 3)[chosen]
    side.ravel()[corner] = side.ravel()[chosen]
