"""Where a cut should reach: the points that a flat map of the opened surface would distort most.

With the logarithm u of its length scale held at 0 on the boundary, a flat conformal metric solves
Laplacian(u) = curvature to first order (Ben-Chen, Gotsman, Bunin 2008, equation 5). Ears, limbs and noses, which hold
much curvature far from the boundary, are where |u| peaks; a cut to the peak takes it away.
"""

from __future__ import annotations

import numpy as np

from ..linalg.sparse import solve_spd
from ..mesh.geometry import (
    angle_defects,
    angles_from_lengths,
    cotangents_from_lengths,
    halfedge_lengths,
    laplacian_from_weights,
    vertex_areas,
)
from ..mesh.topology import halfedges
from .component import Piece
from .cut_graph import open_classes, open_rim


def log_scale(piece: Piece, cut: np.ndarray) -> np.ndarray:
    """Predicted |log scale| (n,) of a flat map of the piece opened along the cut (e,) bool; largest where copies meet.

    On a closed surface without a cut its mean is 0, and it is largest at the sharpest extremity.
    """
    opened = open_classes(piece, cut)
    n = int(opened.max()) + 1
    tail, head = halfedges(opened)
    rim = open_rim(piece, cut)
    fixed = np.zeros(n, dtype=bool)
    fixed[tail[rim]] = fixed[head[rim]] = True
    length = halfedge_lengths(piece.positions, piece.triangles).reshape(-1, 3)
    curvature = angle_defects(opened, angles_from_lengths(length), np.flatnonzero(fixed), n)
    weight = np.maximum(0.5 * cotangents_from_lengths(length), 1e-3).ravel()
    matrix = laplacian_from_weights(tail, head, weight, n)
    if not fixed.any():
        curvature = curvature - curvature.mean()
        fixed[int(np.argmin(curvature))] = True
    u = np.zeros(n)
    u[~fixed] = solve_spd(matrix[~fixed][:, ~fixed].tocsc(), curvature[~fixed])
    at_vertex = np.zeros(piece.count)
    np.maximum.at(at_vertex, piece.triangles.ravel(), np.abs(u)[opened.ravel()])
    return at_vertex


def spread(piece: Piece, scale: np.ndarray) -> float:
    """Mean square over the surface of a log scale (n,)."""
    area = vertex_areas(piece.positions, piece.triangles)
    return float(area @ scale**2 / area.sum())
