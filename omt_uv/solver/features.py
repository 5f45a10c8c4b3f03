"""Edges of a triangle mesh that stand out: sharp ones, borders of regions, jumps of values between the two sides."""

from __future__ import annotations

import numpy as np

from .closest import face_normals
from .topology import halfedges, pair_keys, pair_up

NO_EDGES = np.zeros((0, 2), np.int64)


def sharp_edges(positions: np.ndarray, triangles: np.ndarray, angle: float) -> np.ndarray:
    """Edges (k,2) of a mesh (n,3), (m,3) where the normals of the two faces differ by more than `angle` radians."""
    first, second, edges = _pairs(triangles)
    normal = face_normals(positions, triangles)
    a, b = normal[first // 3], normal[second // 3]
    turn = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ej,ej->e", a, b))
    return edges[turn > angle]


def region_borders(triangles: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Edges (k,2) of triangles (m,3) between faces of different `region` (m,)."""
    first, second, edges = _pairs(triangles)
    return edges[region[first // 3] != region[second // 3]]


def value_jumps(triangles: np.ndarray, corners: np.ndarray, values: np.ndarray, tolerance: float) -> np.ndarray:
    """Edges (k,2) of triangles (m,3) with corners (m,3) across which corner values (c,d) differ by > `tolerance`."""
    first, second, edges = _pairs(triangles)
    tail, head = halfedges(triangles)
    at_tail, at_head = halfedges(corners)
    same = tail[first] == tail[second]
    begin = np.where(same, at_tail[second], at_head[second])
    end = np.where(same, at_head[second], at_tail[second])
    apart = np.abs(values[at_tail[first]] - values[begin]).max(axis=1, initial=0) > tolerance
    apart |= np.abs(values[at_head[first]] - values[end]).max(axis=1, initial=0) > tolerance
    return edges[apart]


def _pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The two halfedges (e,), (e,) of every edge between two faces, and its vertices (e,2)."""
    tail, head = halfedges(triangles)
    first, second = pair_up(pair_keys(tail, head))
    return first, second, np.stack([tail[first], head[first]], axis=1)


def all_edges(*sets: np.ndarray) -> np.ndarray:
    """The union (k,2) of sets of edges, every edge once, the smaller vertex first."""
    return np.unique(np.sort(np.concatenate([NO_EDGES, *(np.reshape(s, (-1, 2)) for s in sets)]), axis=1), axis=0)
