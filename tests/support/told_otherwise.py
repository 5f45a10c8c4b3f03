"""A mesh told in other ways: where it lies, how large it is, how it is turned, and how it is numbered."""

from __future__ import annotations

from typing import NamedTuple

import meshes
import numpy as np
from scipy.spatial.transform import Rotation


class Told(NamedTuple):
    """A mesh (n,3), (m,4) told in one way, and what there is to undo: its size, the faces (m,) it began with in its
    order, and by how much their corners have been rolled."""

    vertices: np.ndarray
    faces: np.ndarray
    size: float = 1.0
    order: np.ndarray | slice = slice(None)
    rolled: int = 0


def moved(V, F):
    """The mesh elsewhere."""
    return Told(V + [3.0, -7.0, 11.0], F)


def enlarged(V, F):
    """The mesh a thousand times as large."""
    return Told(1000.0 * V, F, 1000.0)


def made_small(V, F):
    """The mesh smaller by a power of two."""
    return Told(V / 4096, F, 1 / 4096)


def turned(V, F):
    """The mesh turned about an axis of no meaning."""
    return Told(Rotation.from_rotvec([0.3, -1.1, 0.6]).apply(V), F)


def other_faces_first(V, F):
    """The faces in another order."""
    order = np.random.default_rng(1).permutation(len(F))
    return Told(V, F[order], order=order)


def other_vertices_first(V, F):
    """The vertices in another order."""
    new = np.random.default_rng(2).permutation(len(V))
    other = np.empty_like(V)
    other[new] = V
    return Told(other, new[F])


def other_corners_first(V, F):
    """The faces from another of their corners on."""
    return Told(V, np.roll(F, 1, axis=1), rolled=1)


WAYS = (moved, enlarged, made_small, turned, other_faces_first, other_vertices_first, other_corners_first)


def ramp(V, F, low, high):
    """Numbers (m,) of faces that rise along the mesh, whatever it is told by."""
    along = np.linalg.norm(V[F].mean(axis=1) - V[F].mean(axis=(0, 1)), axis=1)
    return low + (high - low) * (along - along.min()) / np.ptp(along)


def patch(count=7):
    """A curved patch of quads (m,4) without any symmetry."""
    x, y = np.meshgrid(np.linspace(0, 1.3, count + 1), np.linspace(0, 1, count + 1))
    V = np.column_stack([x.ravel(), y.ravel(), (0.5 * np.sin(2.2 * x + 0.4) * np.cos(1.7 * y) + 0.1 * x * x).ravel()])
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    return V, np.column_stack([corner, corner + 1, corner + count + 2, corner + count + 1])


def body():
    """A closed body of triangles (m,3) without any symmetry."""
    V, F = meshes.icosphere(2)
    x, y, z = V.T
    return V * (1 + 0.2 * np.sin(2 * x + 0.5) + 0.15 * np.cos(3 * y + z) + 0.1 * z)[:, None] * [1.3, 1.0, 0.8], F
