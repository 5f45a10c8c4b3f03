"""Triangles on the unit sphere: orientation, area, and figures of maps to it."""

from __future__ import annotations

import numpy as np


def signed_volumes(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Determinant (m,) of the three corners of every triangle, positive when counter-clockwise seen from outside.

    Differences first: of close points they are exact, so that the sign of a tiny triangle is right.
    """
    p = positions[triangles]
    a, b, c = p[:, 0], p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return np.einsum("md,md->m", a, np.cross(b, c))


def spherical_areas(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Signed area (m,) of every spherical triangle (van Oosterom, Strackee 1983); positive ones tile 4 pi."""
    p = positions[triangles]
    a, b, c = p[:, 0], p[:, 1], p[:, 2]
    below = 1 + (a * b).sum(axis=1) + (b * c).sum(axis=1) + (c * a).sum(axis=1)
    return 2 * np.arctan2(signed_volumes(positions, triangles), below)
