"""Values of a mesh carried to a new mesh that lies on it: per vertex, per corner and per face.

Vertex values are interpolated where each new vertex lies. Corner values are taken from one side of every seam: each
new face has a home, a triangle under its centroid, and its corners are looked up from there without crossing a seam.
Where a face reaches across a seam all the same, the values of its home's side are extended, so that no face mixes
the values of two islands. Face values are those of the home.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .closest import ClosestPoint, face_normals
from .sides import ON_EDGE, CutMesh, apart, cut_open, descend, on_seam
from .topology import halfedges, pair_keys, pair_up, twins

# Nearer than this share of the extent is the same point.
SAME_POINT = 1e-7
# Vertices nearer to a seam than this share of an edge may be beyond it.
UNSURE = 0.4
WITNESS_ROUNDS = 20
# The longest way over the surface that is looked for, in straight lines.
LONGEST_WAY = 6.0
# Beyond this, a triangle is too slim to say what lies next to it.
MOST_EXTENDED = 8.0


@dataclass(frozen=True)
class Footprint:
    """Where the vertices, corners and faces of a new mesh lie on the old one.

    triangles (t,3) of the new mesh; vertex_triangle (k,) and vertex_weights (k,3): old triangle and barycentric
    coordinates of every new vertex; corner_triangle (t,3), corner_weights (t,3,3) the same for every new corner, on
    the side of the seams where its face is, coordinates below 0 outside of the triangle; home (t,) old triangle of
    every new face; seams (s,2): new edges across which corners come from different sides, seam_origin (s,): halfedge
    of the old mesh that each follows; extended: how many faces reach across a seam.
    """

    triangles: np.ndarray
    vertex_triangle: np.ndarray
    vertex_weights: np.ndarray
    corner_triangle: np.ndarray
    corner_weights: np.ndarray
    home: np.ndarray
    seams: np.ndarray
    seam_origin: np.ndarray
    extended: int


def footprint(
    positions: np.ndarray,
    triangles: np.ndarray,
    seams: np.ndarray,
    new_positions: np.ndarray,
    new_triangles: np.ndarray,
    faces: np.ndarray,
    barycentric: np.ndarray,
) -> Footprint:
    """Find where a new mesh (k,3), (t,3) lies on the old one (n,3), (m,3).

    seams (s,2): pairs of old vertices, edges that corner and face values may jump across; faces (k,), barycentric
    (k,3): old triangle and coordinates of the new vertices
    """
    spacing = _spacing(new_positions, new_triangles)
    found = ClosestPoint(positions, triangles, spacing)(
        new_positions[new_triangles].mean(axis=1), face_normals(new_positions, new_triangles)
    )
    home, corner_triangle = found.faces.copy(), faces[new_triangles]
    corner_weights, side = barycentric[new_triangles], np.full(new_triangles.shape, -1, np.int64)
    lifted = _lift(positions, triangles, faces, barycentric)
    mesh = cut_open(positions, triangles, np.concatenate([np.reshape(seams, (-1, 2)), rim_edges(triangles)]))
    near = _near_seams(mesh, lifted[new_triangles], spacing)
    extended = 0
    if len(near):
        free = ~on_seam(mesh, faces, barycentric)
        witness = _witnesses(mesh, new_triangles, free, lifted, spacing)
        home[near] = _homes(mesh, new_triangles[near], free, faces[witness], found.points[near], home[near])
        corners = _corners(mesh, new_triangles[near], home[near], free, lifted, faces, barycentric)
        corner_triangle[near], corner_weights[near], side[near], extended = corners
        alone = _away_from(mesh, seams, lifted, spacing)
        _unite(new_triangles, alone, corner_triangle, corner_weights, side)
        faces, barycentric = _settled(new_triangles, side, corner_triangle, corner_weights, faces, barycentric)
    breaks, origin = _breaks(mesh, new_triangles, side, lifted)
    return Footprint(new_triangles, faces, barycentric, corner_triangle, corner_weights, home, breaks, origin, extended)


def rim_edges(triangles: np.ndarray) -> np.ndarray:
    """Boundary edges (r,2). They part values like seams: two boundaries may touch all along, as in a mesh cut open."""
    tail, head = halfedges(triangles)
    rim = twins(triangles) < 0
    return np.stack([tail[rim], head[rim]], axis=1)


def _away_from(mesh: CutMesh, seams: np.ndarray, points: np.ndarray, distance: float) -> np.ndarray:
    """Points (k,3) so far from all seams, boundaries apart, that all faces around them are on one side; (k,) bool."""
    if not len(seams):
        return np.ones(len(points), dtype=bool)
    near, _ = _seam_points(cut_open(mesh.positions, mesh.triangles, seams), distance / 2)
    return cKDTree(near).query(points)[0] > 1.5 * distance if len(near) else np.ones(len(points), dtype=bool)


def _unite(
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


def _settled(
    new_triangles: np.ndarray,
    side: np.ndarray,
    corner_triangle: np.ndarray,
    corner_weights: np.ndarray,
    faces: np.ndarray,
    barycentric: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Triangle (k,) and coordinates (k,3) of the new vertices, those on seams where one of their corners is."""
    known = np.flatnonzero(side.ravel() >= 0)
    vertex = new_triangles.ravel()[known]
    faces, barycentric = faces.copy(), barycentric.copy()
    faces[vertex], barycentric[vertex] = corner_triangle.ravel()[known], corner_weights.reshape(-1, 3)[known]
    return faces, barycentric


def _spacing(positions: np.ndarray, triangles: np.ndarray) -> float:
    p = positions[triangles]
    return float(np.median(np.linalg.norm(p - p[:, [1, 2, 0]], axis=2)))


def _lift(positions: np.ndarray, triangles: np.ndarray, faces: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    return np.einsum("kc,kcj->kj", barycentric, positions[triangles[faces]])


def _seam_points(mesh: CutMesh, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (s,3) along the seams, no farther apart than `spacing`, and the halfedge (s,) of each."""
    tail, head = halfedges(mesh.triangles)
    h = np.flatnonzero(mesh.seam)
    a, b = mesh.positions[tail[h]], mesh.positions[head[h]]
    count = np.clip(np.ceil(np.linalg.norm(b - a, axis=1) / spacing), 1, 1000).astype(np.int64)
    which = np.repeat(np.arange(len(h)), count)
    t = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[which]
    return a[which] + t[:, None] * (b - a)[which], h[which]


def _near_seams(mesh: CutMesh, corners: np.ndarray, spacing: float) -> np.ndarray:
    """New faces, given by their corners (t,3,3), that a seam may pass."""
    points, _ = _seam_points(mesh, spacing / 2)
    if len(points) == 0:
        return np.zeros(0, np.int64)
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    return np.flatnonzero(cKDTree(points).query(centre)[0] <= 1.5 * radius + spacing / 2)


def _witnesses(
    mesh: CutMesh, new_triangles: np.ndarray, free: np.ndarray, lifted: np.ndarray, spacing: float
) -> np.ndarray:
    """For every new vertex (k,) one that is on the same side of the seams, and so far from them that this is sure.

    New edges that follow a crooked seam cut its corners, and vertices next to them may lie beyond the old seam.
    Vertices that are on no seam, `free` (k,), and joined by an edge are on the same side where seams are kept.
    """
    points, _ = _seam_points(mesh, spacing / 8)
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


def _homes(
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


def _corners(
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


def _breaks(
    mesh: CutMesh, new_triangles: np.ndarray, side: np.ndarray, lifted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """New edges (s,2) whose two faces see different sides at an end, and the old seam halfedge (s,) next to each."""
    if not mesh.seam.any():
        return np.zeros((0, 2), np.int64), np.zeros(0, np.int64)
    tail, head = halfedges(new_triangles)
    first, second = pair_up(pair_keys(tail, head))
    at_tail, at_head = side.ravel(), side[:, [1, 2, 0]].ravel()
    apart = (at_tail[first] != at_head[second]) | (at_head[first] != at_tail[second])
    edges = np.stack([tail[first[apart]], head[first[apart]]], axis=1)
    points, origin = _seam_points(mesh, _spacing(lifted, new_triangles) / 8)
    return edges, origin[cKDTree(points).query(lifted[edges].mean(axis=1))[1]] if len(edges) else origin[:0]


def to_vertices(at: Footprint, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, ...) of old vertices interpolated at the new ones, (k, ...); triangles (m,3) are the old ones."""
    return np.einsum("kc,kc...->k...", at.vertex_weights, np.asarray(values, float)[triangles[at.vertex_triangle]])


def nearest_to_vertices(at: Footprint, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, ...) of any type, each of the old vertex with the greatest weight."""
    corner = at.vertex_weights.argmax(axis=1)
    return values[triangles[at.vertex_triangle, corner]]


def to_corners(at: Footprint, corners: np.ndarray, values: np.ndarray, extend: bool = False) -> np.ndarray:
    """Values (c, ...) of old corners interpolated at the new ones, (3t, ...); corners (m,3) of the old triangles.

    extend : continue the values where a face reaches across a seam, as UVs need; otherwise they stay within those
        of a triangle, as colours have to
    """
    old = np.asarray(values, float)[corners[at.corner_triangle]]
    weights = at.corner_weights
    if not extend:
        weights = np.maximum(weights, 0)
        weights = weights / weights.sum(axis=2, keepdims=True)
    new = np.einsum("tkc,tkc...->tk...", weights, old)
    return new.reshape(-1, *new.shape[2:])


def nearest_to_corners(at: Footprint, corners: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (c, ...) of any type, each of the old corner with the greatest weight on its side."""
    corner = at.corner_weights.argmax(axis=2)
    return values[corners[at.corner_triangle, corner].ravel()]


def to_faces(at: Footprint, triangle_face: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (f, ...) of old polygons at the new faces, (t, ...); triangle_face (m,) polygon of the old triangles."""
    return values[triangle_face[at.home]]
