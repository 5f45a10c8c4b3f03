"""Areas of quads, cut along the diagonal from their first corners, as a subdivided mesh is drawn."""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import face_areas

# Triangles of a quad.
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def half_areas(corners: np.ndarray) -> np.ndarray:
    """Areas (2q,) of the two triangles of each of the quads (q,4,3).

    Examples
    --------
    >>> half_areas(np.array([[(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 1.0, 0.0)]]))
    array([1., 1.])
    """
    points = corners[:, HALVES].reshape(-1, 3)
    return face_areas(points, np.arange(len(points)).reshape(-1, 3))


def quad_areas(corners: np.ndarray) -> np.ndarray:
    """Areas (q,) of quads (q,4,3).

    Examples
    --------
    >>> quad_areas(np.array([[(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 1.0, 0.0)]]))
    array([2.])
    """
    return half_areas(corners).reshape(-1, 2).sum(axis=1)
