"""Carry values of a mesh to a new mesh that lies on it, per vertex, per corner and per face, by linear interpolation.

Vertex values are interpolated where each new vertex lies, corner values on the side of the seams where the new face is,
and face values are those under the new face; `correspondence` says where that is.
"""

from __future__ import annotations

import numpy as np

from .correspondence import Correspondence


def to_vertices(at: Correspondence, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, ...) of old vertices interpolated at the new ones, (k, ...); triangles (m,3) are the old ones."""
    return np.einsum("kc,kc...->k...", at.vertex_weights, np.asarray(values, float)[triangles[at.vertex_triangle]])


def nearest_to_vertices(at: Correspondence, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, ...) of any type, each of the old vertex with the greatest weight."""
    corner = at.vertex_weights.argmax(axis=1)
    return values[triangles[at.vertex_triangle, corner]]


def to_corners(at: Correspondence, corners: np.ndarray, values: np.ndarray, extend: bool = False) -> np.ndarray:
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


def nearest_to_corners(at: Correspondence, corners: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (c, ...) of any type, each of the old corner with the greatest weight on its side."""
    corner = at.corner_weights.argmax(axis=2)
    return values[corners[at.corner_triangle, corner].ravel()]


def to_faces(at: Correspondence, triangle_face: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (f, ...) of old polygons at the new faces, (t, ...); triangle_face (m,) polygon of the old triangles."""
    return values[triangle_face[at.face_triangle]]
