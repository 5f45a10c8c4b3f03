"""Keep the mirror symmetry of a closed surface in its map to the sphere.

Every mirror of the surface is one of the sphere, in a plane through its middle. The energy of a symmetric map is
symmetric, so its Newton step is, but for rounding and for quads cut one way; averaging with the images takes that away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..mesh.mirror import mirrored_quads
from ..mesh.spherical_geometry import normalized

# Distance, on the unit sphere, between a start and the symmetric one next to it above which it is none of a symmetric
# surface.
FAR = 0.5


@dataclass(frozen=True)
class SphereSymmetry:
    """What takes a map to itself: images (k,n) of every vertex and reflections (k,3,3) of the sphere.

    All of them but the identity: one, or two across one another and both.
    """

    images: np.ndarray
    reflections: np.ndarray

    def averaged(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (n,3) at the vertices, in the mean with their images."""
        total = vectors.copy()
        for image, turn in zip(self.images, self.reflections, strict=True):
            # Reflections are their own inverses.
            total += vectors[image] @ turn
        return total / (1 + len(self.images))

    def averaged_hessian(self, matrix: sp.csc_matrix, axes: np.ndarray) -> sp.csc_matrix:
        """A Hessian (2n,2n) along tangents (n,2,3) of a symmetric map, in the mean with its images."""
        n, total = len(axes), matrix.copy()
        for image, turn in zip(self.images, self.reflections, strict=True):
            blocks = np.matmul(axes @ turn.T, axes[image].swapaxes(1, 2))
            carried = sp.bsr_matrix((blocks, image, np.arange(n + 1)), shape=(2 * n, 2 * n)).tocsc()
            total = total + carried.T @ matrix @ carried
        return (total / (1 + len(self.images))).tocsc()


def symmetric_map(images: np.ndarray, positions: np.ndarray) -> tuple[SphereSymmetry, np.ndarray] | None:
    """The symmetry that a map (n,3) comes nearest to, and the symmetric map next to it; None where that is far.

    images (k,n): of the vertices in one mirror, or in two across one another
    """
    first = _plane(positions, images[0])
    reflections, moves = [_reflection(first)], [images[0]]
    if len(images) == 2:
        second = _plane(positions, images[1], across=first)
        both = images[0][images[1]]
        reflections += [_reflection(second), _reflection(first) @ _reflection(second)]
        moves += [images[1], both]
    found = SphereSymmetry(np.array(moves), np.array(reflections))
    averaged = normalized(found.averaged(positions))
    if not np.linalg.norm(averaged - positions, axis=1).max() <= FAR:
        return None
    return found, averaged


def _plane(positions: np.ndarray, image: np.ndarray, across: np.ndarray | None = None) -> np.ndarray:
    """Unit normal (3,) of the plane whose reflection takes positions (n,3) nearest to those of their images."""
    products = positions.T @ positions[image]
    # The sum of p . (1 - 2 n n^T) q is greatest where n^T (p q^T) n is least.
    matrix = (products + products.T) / 2
    if across is not None:
        matrix = matrix + np.abs(matrix).sum() * np.outer(across, across)
    normal = np.linalg.eigh(matrix)[1][:, 0]
    if across is not None:
        normal = normal - (normal @ across) * across
    return normal / np.linalg.norm(normal)


def _reflection(normal: np.ndarray) -> np.ndarray:
    return np.eye(3) - 2 * np.outer(normal, normal)


def with_mirrored_quads(vertices: np.ndarray, triangles: np.ndarray, polygons: np.ndarray | None) -> np.ndarray | None:
    """Polygons (m,) in which two triangles whose mirror images are cut along the other diagonal are one, a quad.

    The polygons given, or None for them, where there are no such triangles of their own.
    """
    own = np.arange(len(triangles)) if polygons is None else np.unique(polygons, return_inverse=True)[1].ravel()
    rows = np.flatnonzero(np.bincount(own)[own] == 1)
    pairs = rows[mirrored_quads(vertices, triangles[rows])] if len(rows) else rows.reshape(0, 2)
    if not len(pairs):
        return polygons
    own[pairs[:, 1]] = own[pairs[:, 0]]
    return own
