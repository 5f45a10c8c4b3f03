"""Measure triangles on the unit sphere: orientation and area (van Oosterom, Strackee 1983); and spread points there."""

from __future__ import annotations

import numpy as np

from .geometry import cross3, lengths


def normalized(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) in the direction of vectors (n,3); zero stays zero."""
    size = lengths(vectors)[..., None]
    return vectors / np.where(size > 0, size, 1)


def fibonacci_sphere(count: int) -> np.ndarray:
    """Unit vectors (count,3) spread evenly over the sphere, from the north pole to the south (Gonzalez 2010)."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + np.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])


def triple_products(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Determinant (m,) of points (m,3) each, positive when counter-clockwise seen from outside.

    Differences first: of close points they are exact, so that the sign of a tiny triangle is right.
    """
    return np.einsum("md,md->m", a, cross3(b - a, c - a))


def triangle_areas(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Signed area (m,) of the spherical triangles of unit vectors (m,3) each (van Oosterom, Strackee 1983)."""
    below = 1 + np.einsum("md,md->m", a, b) + np.einsum("md,md->m", b, c) + np.einsum("md,md->m", c, a)
    return 2 * np.arctan2(triple_products(a, b, c), below)


def signed_volumes(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Triple product (m,) of the corners of every triangle of unit vectors (n,3); negative where it is folded."""
    p = positions[triangles]
    return triple_products(p[:, 0], p[:, 1], p[:, 2])


def spherical_areas(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Signed area (m,) of every spherical triangle of unit vectors (n,3); positive ones tile 4 pi."""
    p = positions[triangles]
    return triangle_areas(p[:, 0], p[:, 1], p[:, 2])
