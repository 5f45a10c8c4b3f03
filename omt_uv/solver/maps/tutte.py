"""Embed a disk in the plane by mean value weights, its boundary convex (Tutte 1963, Floater 2003)."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from ..linalg.nested_dissection import LARGE, Dissection
from ..linalg.sparse import solve_general
from ..mesh.geometry import angles_from_lengths, halfedge_lengths
from ..mesh.topology import halfedges

# Sides that are shorter than this share of the mean get so much of a convex boundary: faces between vertices that
# nearly coincide would fold by rounding.
LEAST_STEP = 1e-4


def mean_value_weights(length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Floater's mean value weights of every halfedge, seen from its tail and from its head, (m,3) each.

    length (m,3) are the sides of the triangles. Tangents are bounded, so that needles keep positive,
    finite weights.
    """
    angle = angles_from_lengths(length)
    tangent = np.clip(np.tan(np.minimum(angle, 0.999 * np.pi) / 2), 1e-6, 1e3)
    # Halfedge k runs from vertex k to k + 1; the angle at vertex k lies opposite to halfedge k + 1.
    at_tail, at_head = tangent[:, [1, 2, 0]], tangent[:, [2, 0, 1]]
    safe = np.maximum(length, 1e-12 * length.max())
    return at_tail / safe, at_head / safe


def tutte(
    positions: np.ndarray, triangles: np.ndarray, loop: np.ndarray, boundary: np.ndarray, equal: bool = False
) -> np.ndarray:
    """Mean value embedding (n,2) of a disk mesh (n,3), (m,3) with its loop (b,) at points boundary (b,2); equal: with
    the weights of equilateral triangles in place of the mesh's own."""
    n = len(positions)
    length = np.ones((len(triangles), 3)) if equal else halfedge_lengths(positions, triangles).reshape(-1, 3)
    at_tail, at_head = mean_value_weights(length)
    tail, head = halfedges(triangles)
    rows, columns = np.concatenate([tail, head]), np.concatenate([head, tail])
    weight = csr_matrix((np.concatenate([at_tail.ravel(), at_head.ravel()]), (rows, columns)), shape=(n, n))
    inside = np.ones(n, dtype=bool)
    inside[loop] = False
    uv = np.zeros((n, 2))
    uv[loop] = boundary
    if inside.any():
        rows = weight[inside]
        total = np.asarray(rows.sum(axis=1)).ravel()
        rows = csr_matrix((rows.data / np.repeat(total, np.diff(rows.indptr)), rows.indices, rows.indptr), rows.shape)
        matrix = csr_matrix((np.ones(inside.sum()), (np.arange(inside.sum()),) * 2)) - rows[:, inside]
        order = "colamd" if n < LARGE else _inner_order(positions, triangles, inside)
        uv[inside] = solve_general(matrix.tocsc(), rows[:, loop] @ boundary, order)
    return uv


def _inner_order(positions: np.ndarray, triangles: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Elimination order of the vertices `inside` (n,) bool, numbered among themselves."""
    order = Dissection(positions).order(*halfedges(triangles))
    return (np.cumsum(inside) - 1)[order[inside[order]]]


def arc_length_parameters(positions: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Share of the boundary's length before each vertex of the loop, (b,) in [0, 1); no two are at the same place."""
    step = np.linalg.norm(positions[np.roll(loop, -1)] - positions[loop], axis=1)
    step = np.maximum(step, LEAST_STEP * step.mean())
    return np.concatenate([[0.0], np.cumsum(step)[:-1]]) / step.sum()
