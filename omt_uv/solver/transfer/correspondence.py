"""Where a new mesh lies on the old one: its vertices, its faces, and its corners, each on one side of every seam.

Each new face has a home, a triangle under its centroid, and its corners are looked up from there without crossing a
seam (`corner_sides.py`), so that no face mixes the values of two islands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.closest_point import ClosestPoint, face_normals
from ..mesh.cut_mesh import CutMesh, cut_open, on_seam, seam_points
from ..mesh.topology import halfedges, pair_keys, pair_up, twins
from .seam_sides import corners_of, homes, unite, witnesses


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
        witness = witnesses(mesh, new_triangles, free, lifted, spacing)
        home[near] = homes(mesh, new_triangles[near], free, faces[witness], found.points[near], home[near])
        corners = corners_of(mesh, new_triangles[near], home[near], free, lifted, faces, barycentric)
        corner_triangle[near], corner_weights[near], side[near], extended = corners
        alone = _away_from(mesh, seams, lifted, spacing)
        unite(new_triangles, alone, corner_triangle, corner_weights, side)
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
    near, _ = seam_points(cut_open(mesh.positions, mesh.triangles, seams), distance / 2)
    return cKDTree(near).query(points)[0] > 1.5 * distance if len(near) else np.ones(len(points), dtype=bool)


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


def _near_seams(mesh: CutMesh, corners: np.ndarray, spacing: float) -> np.ndarray:
    """New faces, given by their corners (t,3,3), that a seam may pass."""
    points, _ = seam_points(mesh, spacing / 2)
    if len(points) == 0:
        return np.zeros(0, np.int64)
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    return np.flatnonzero(cKDTree(points).query(centre)[0] <= 1.5 * radius + spacing / 2)


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
    points, origin = seam_points(mesh, _spacing(lifted, new_triangles) / 8)
    return edges, origin[cKDTree(points).query(lifted[edges].mean(axis=1))[1]] if len(edges) else origin[:0]
