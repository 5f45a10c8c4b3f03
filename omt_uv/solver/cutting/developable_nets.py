"""Nets: cuts through all corners of a body with flat or developable sides, which then unrolls without distortion.

A cube, a cylinder, a bracket: what curvature there is sits on vertices of hard edges, and a cut through all of these,
along the hard edges where it can, leaves none. On smooth bodies no cut does that, see `extremities.py`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..mesh.geometry import angle_defects, angles_from_lengths, face_areas, halfedge_lengths
from .component import Piece, fold_angles
from .cut_graph import greedy_arcs

# An edge at which the normal turns by more is hard. Prisms with 4, 5, 6 and 8 sides are clear of it.
HARD = np.radians(52)
# A vertex with less curvature is flat. Vertices off the hard edges may count as corners if they have SPIKE, as the tip
# of a cone has, and are SPIKES at most; what curvature is left, summed without sign, must not exceed LEFT.
FLAT, SPIKE, SPIKES, LEFT = 1e-3, 0.75, 4, 0.3
# A net is worth its seams up to this many times the side of a square with the area of the surface.
LONGEST = 5.0
# Edges within flat or developable sides count so many times, which leaves these in one piece.
ACROSS = 1.5


def net(piece: Piece) -> tuple[np.ndarray, np.ndarray] | None:
    """Edges (e,) bool whose cut unrolls the piece, and the corners (k,) they pass through.

    None if there are none, or if seams would pass through vertices to be kept free of them.
    """
    length = halfedge_lengths(piece.positions, piece.triangles).reshape(-1, 3)
    on_boundary = piece.on_boundary()
    curvature = np.abs(
        angle_defects(piece.triangles, angles_from_lengths(length), np.flatnonzero(on_boundary), piece.count)
    )
    curvature[on_boundary] = 0
    folded = np.abs(fold_angles(piece.positions, piece.triangles, piece.pair)) > HARD
    hard = np.zeros(piece.count, dtype=bool)
    hard[piece.ends[folded]] = True
    spike = ~hard & (curvature > SPIKE)
    corner = (hard & (curvature > FLAT)) | spike
    tips = np.flatnonzero(corner)
    curved = spike.sum() > SPIKES or curvature[~corner].sum() > LEFT
    # A closed surface needs a cut of two edges at least.
    if curved or len(tips) < 3 or (piece.avoid[tips] > 0).any():
        return None
    chosen = greedy_arcs(replace(piece, cost=np.where(folded, piece.cost, ACROSS * piece.cost)), tips)
    return chosen, tips


def is_long(piece: Piece, cut: np.ndarray) -> bool:
    """Whether a cut (e,) bool is more than what a net should take."""
    area = face_areas(piece.positions, piece.triangles).sum()
    return bool(piece.length[cut].sum() > LONGEST * np.sqrt(area))
