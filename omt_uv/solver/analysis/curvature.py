"""Integrate curvature over the area of every vertex (Meyer, Desbrun, Schroeder, Barr 2003), and tell sharp edges.

Integrated values add up: the Gaussian ones of a closed surface to 2 pi times its Euler characteristic. They
need no orientation (Gaussian, sharpness) or a consistent one (mean), and may be taken of any triangles.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import (
    angles_from_lengths,
    cotangent_laplacian,
    cross3,
    face_normals,
    halfedge_lengths,
    lengths,
    vertex_normals,
)
from ..mesh.topology import halfedges, on_boundary, pair_keys, pair_up


def gaussian_curvature(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Angle defect (n,) in radians: 2 pi minus the angles around a vertex, 0 on the boundary (Gauss, Bonnet).

    positions (n,3), triangles (m,3)
    """
    angle = angles_from_lengths(halfedge_lengths(positions, triangles).reshape(-1, 3))
    # The angle opposite to halfedge k lies at vertex k + 2.
    around = np.bincount(triangles[:, [2, 0, 1]].ravel(), angle.ravel(), len(positions))
    return np.where(on_boundary(triangles, len(positions)), 0.0, 2 * np.pi - around)


def mean_curvature(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mean curvature times area (n,), a length, positive on a sphere seen from outside, 0 on the boundary.

    Half of the cotangent Laplacian of the positions along the normal (Meyer, Desbrun, Schroeder, Barr 2003, eq. 8).
    """
    n = len(positions)
    turn = cotangent_laplacian(positions, triangles) @ (positions - positions[triangles].mean(axis=(0, 1)))
    along = 0.5 * (turn * vertex_normals(positions, triangles)).sum(axis=1)
    return np.where(on_boundary(triangles, n), 0.0, along)


def sharpness(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The largest angle (n,) in [0, pi] between the normals of two faces that share an edge at a vertex.

    positions (n,3), triangles (m,3)
    """
    first, second = pair_up(pair_keys(*halfedges(triangles)))
    normal = face_normals(positions, triangles)
    a, b = normal[first // 3], normal[second // 3]
    angle = np.arctan2(lengths(cross3(a, b)), (a * b).sum(axis=1))
    sharpest = np.zeros(len(positions))
    for ends in halfedges(triangles):
        np.maximum.at(sharpest, ends[first], angle)
    return sharpest
