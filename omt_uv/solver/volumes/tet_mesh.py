"""Measure tetrahedra: volumes, boundary, gradients of linear functions, volumes around vertices."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..mesh.geometry import cross3

# The face opposite to every vertex of a tetrahedron, looking outwards where its volume is positive.
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def tet_volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Signed volumes (m,) of tetrahedra (m,4) of points (n,3)."""
    p = points[tets]
    a, b, c = (p[:, k] - p[:, 0] for k in (1, 2, 3))
    return np.einsum("mi,mi->m", cross3(a, b), c) / 6


def turned_right(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Tetrahedra (m,4) of points (n,3) with the corners in the order in which their volumes are positive."""
    return tets[:, [1, 0, 2, 3]] if tet_volumes(points, tets).sum() < 0 else tets


def boundary_triangles(tets: np.ndarray) -> np.ndarray:
    """Triangles (k,3) that one of tetrahedra (m,4) has alone."""
    every = tets[:, FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    return every[first[count == 1]]


def boundary_vertices(tets: np.ndarray) -> np.ndarray:
    """Vertices (b,) of the triangles that one of tetrahedra (m,4) has alone."""
    return np.unique(boundary_triangles(tets))


def vertex_volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """A quarter of the volume (n,) of the tetrahedra (m,4) around every one of points (n,3)."""
    return around_vertices(tet_volumes(points, tets), tets, len(points))


def around_vertices(volume: np.ndarray, tets: np.ndarray, n: int) -> np.ndarray:
    """A quarter of volumes (m,) of the tetrahedra (m,4) around every one of n vertices, (n,)."""
    return np.bincount(tets.ravel(), np.repeat(volume / 4, 4), n)


def gradients(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Gradients (m,4,3) of the functions that are 1 at one vertex of a tetrahedron (m,4) and 0 at the others."""
    p = points[tets]
    inverse = np.linalg.inv(p[:, 1:] - p[:, :1])
    b = np.swapaxes(inverse, 1, 2)
    return np.concatenate([-b.sum(axis=1, keepdims=True), b], axis=1)


def volume_gradients(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Derivative (m,4,3) of the volume of every tetrahedron (m,4) by its vertices."""
    p = points[tets][:, FACES]
    # A third of the area vector of the opposite face, inwards.
    return -cross3(p[:, :, 1] - p[:, :, 0], p[:, :, 2] - p[:, :, 0]) / 6


def share_error(points: np.ndarray, tets: np.ndarray, target: np.ndarray) -> float:
    """Sum of abs(share of the volume - share of the target (m,)) over tetrahedra (m,4) of points (n,3)."""
    volume = tet_volumes(points, tets)
    return float(np.abs(volume / volume.sum() - target / target.sum()).sum())


def vertex_share_error(points: np.ndarray, tets: np.ndarray, target: np.ndarray) -> float:
    """The same of what lies around vertices: a quarter of the tetrahedra (m,4) at each of points (n,3)."""
    mine = vertex_volumes(points, tets)
    asked = around_vertices(target, tets, len(points))
    return float(np.abs(mine / mine.sum() - asked / asked.sum()).sum())


def graph_laplacian(tets: np.ndarray, weights: np.ndarray, n: int) -> sp.csr_matrix:
    """The matrix (n,n) of sum w (phi_i - phi_j), with weights (m,6) of the edges of tetrahedra (m,4) in `EDGES`."""
    i, j = (tets[:, EDGES[:, k]].ravel() for k in (0, 1))
    w = weights.ravel()
    off = sp.coo_matrix((np.r_[w, w], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()
    return sp.diags(np.asarray(off.sum(axis=1)).ravel()) - off


EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def stiffness(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Weights (m,6) of the edges of tetrahedra (m,4): l cot(theta) / 6 of the opposite edges (Hu, Zou, Hua 2014)."""
    b = gradients(points, tets)
    volume = tet_volumes(points, tets)
    return -np.einsum("mei,mei->me", b[:, EDGES[:, 0]], b[:, EDGES[:, 1]]) * volume[:, None]
