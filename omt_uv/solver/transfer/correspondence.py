"""Find where a new mesh lies on an old one: its vertices, its faces, and its corners, each on one side of every seam.

Every new face is given the old triangle under its centroid (`ClosestPoint`), and its corners are looked up from there
by walks that cross no seam (`seam_sides`), so that no face mixes the values of two islands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.closest_point import ClosestPoint
from ..mesh.cut_mesh import CutMesh, cut_open, on_seam, seam_points
from ..mesh.geometry import cross3, face_normals
from ..mesh.topology import boundary_edges, halfedges, pair_keys, pair_up
from .seam_sides import agree_on_sides, locate_corners, locate_faces, reference_vertices


@dataclass(frozen=True)
class Correspondence:
    """Where the vertices, corners and faces of a new mesh lie on the old one.

    triangles (t,3) of the new mesh; vertex_triangle (k,) and vertex_weights (k,3): old triangle and barycentric
    coordinates of every new vertex; corner_triangle (t,3), corner_weights (t,3,3) the same for every new corner, on
    the side of the seams where its face is, coordinates below 0 outside of the triangle; face_triangle (t,): the old
    triangle of every new face; seams (s,2): new edges across which corners come from different sides, seam_origin
    (s,): halfedge of the old mesh that each follows; extended: how many faces reach across a seam.
    """

    triangles: np.ndarray
    vertex_triangle: np.ndarray
    vertex_weights: np.ndarray
    corner_triangle: np.ndarray
    corner_weights: np.ndarray
    face_triangle: np.ndarray
    seams: np.ndarray
    seam_origin: np.ndarray
    extended: int


def correspond(
    positions: np.ndarray,
    triangles: np.ndarray,
    seams: np.ndarray,
    new_positions: np.ndarray,
    new_triangles: np.ndarray,
    faces: np.ndarray,
    barycentric: np.ndarray,
    owner: np.ndarray | None = None,
) -> Correspondence:
    """Find where a new mesh (k,3), (t,3) lies on the old one (n,3), (m,3), by closest points and walks between seams.

    Parameters
    ----------
    seams : (s,2) pairs of old vertices, edges that corner and face values may jump across
    faces, barycentric : (k,), (k,3) old triangle and coordinates of the new vertices
    owner : (t,) polygon of each new triangle, where some have several: all of a polygon is on one side of every seam
    """
    spacing = _median_edge(new_positions, new_triangles)
    closest = ClosestPoint(positions, triangles, spacing)(
        new_positions[new_triangles].mean(axis=1), face_normals(new_positions, new_triangles)
    )
    face_triangle, corner_triangle = closest.faces.copy(), faces[new_triangles]
    corner_weights, side = barycentric[new_triangles], np.full(new_triangles.shape, -1, np.int64)
    lifted = _lift(positions, triangles, faces, barycentric)
    # Boundaries part values like seams: two of them may touch all along, as in a mesh cut open.
    mesh = cut_open(positions, triangles, np.concatenate([np.reshape(seams, (-1, 2)), boundary_edges(triangles)]))
    near = _near_seams(mesh, lifted[new_triangles], spacing)
    extended = 0
    if owner is not None:
        near = np.flatnonzero(np.isin(owner, owner[near]))
    if len(near):
        free = ~on_seam(mesh, faces, barycentric)
        start = faces[reference_vertices(mesh, new_triangles, free, lifted, spacing)]
        face_triangle[near] = locate_faces(
            mesh, new_triangles[near], free, start, closest.points[near], face_triangle[near]
        )
        if owner is not None:
            face_triangle[near] = face_triangle[near][_leading(owner[near], new_positions[new_triangles[near]])]
        corners = locate_corners(mesh, new_triangles[near], face_triangle[near], free, lifted, faces, barycentric)
        corner_triangle[near], corner_weights[near], side[near], extended = corners
        one_sided = _away_from(mesh, seams, lifted, spacing)
        agree_on_sides(new_triangles, one_sided, corner_triangle, corner_weights, side)
        faces, barycentric = _at_corners(new_triangles, side, corner_triangle, corner_weights, faces, barycentric)
    new_seams, origin = _new_seams(mesh, new_triangles, side, lifted)
    return Correspondence(
        triangles=new_triangles,
        vertex_triangle=faces,
        vertex_weights=barycentric,
        corner_triangle=corner_triangle,
        corner_weights=corner_weights,
        face_triangle=face_triangle,
        seams=new_seams,
        seam_origin=origin,
        extended=extended,
    )


def _leading(owner: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """For every triangle (t,3,3) the largest of its polygon's, (t,)."""
    area = np.linalg.norm(cross3(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    order = np.lexsort((-area, owner))
    first = order[np.unique(owner[order], return_index=True)[1]]
    return first[np.unique(owner, return_inverse=True)[1].ravel()]


def _away_from(mesh: CutMesh, seams: np.ndarray, points: np.ndarray, distance: float) -> np.ndarray:
    """Points (k,3) so far from all seams, boundaries apart, that all faces around them are on one side; (k,) bool."""
    if not len(seams):
        return np.ones(len(points), dtype=bool)
    near, _ = seam_points(cut_open(mesh.positions, mesh.triangles, seams), distance / 2)
    return cKDTree(near).query(points)[0] > 1.5 * distance if len(near) else np.ones(len(points), dtype=bool)


def _at_corners(
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


def _median_edge(positions: np.ndarray, triangles: np.ndarray) -> float:
    """Median length of the edges of triangles (t,3)."""
    p = positions[triangles]
    return float(np.median(np.linalg.norm(p - p[:, [1, 2, 0]], axis=2)))


def _lift(positions: np.ndarray, triangles: np.ndarray, faces: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """Points (k,3) at barycentric coordinates (k,3) of triangles faces (k,)."""
    return np.einsum("kc,kcj->kj", barycentric, positions[triangles[faces]])


def _near_seams(mesh: CutMesh, corners: np.ndarray, spacing: float) -> np.ndarray:
    """New faces, given by their corners (t,3,3), that a seam may pass."""
    points, _ = seam_points(mesh, spacing / 2)
    if len(points) == 0:
        return np.zeros(0, np.int64)
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    return np.flatnonzero(cKDTree(points).query(centre)[0] <= 1.5 * radius + spacing / 2)


def _new_seams(
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
    points, origin = seam_points(mesh, _median_edge(lifted, new_triangles) / 8)
    return edges, origin[cKDTree(points).query(lifted[edges].mean(axis=1))[1]] if len(edges) else origin[:0]
