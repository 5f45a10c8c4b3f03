"""The energy of a map of tetrahedra, shear plus error of volume, its gradient and a positive definite Hessian.

With F the Jacobian of a tetrahedron, scaled so that its determinant d is 1 where the volume is right,

    E = sum_t V_t [ |F|^2 / (3 chi^(2/3)) - 1  +  w ((d^2 + 1) / (2 chi) - 1) ],   chi = (d + sqrt(d^2 + eps^2)) / 2

(Garanzha et al. 2021): with eps = 0 a barrier against inversion, above it finite for inverted tetrahedra, too.
Functions of |F|^2 and d have Hessians whose eigenvectors are known in the frame of singular values (Smith, de Goes,
Kim 2019): six that mix two axes, and three in the block of the singular values. Negative ones count by their size
(Chen et al. 2024): set to zero, they let inverted tetrahedra run off along what the model takes for flat.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..mesh.geometry import cross3
from .tet_mesh import tet_volumes

# Least eigenvalue, relative to that of the shear at rest.
LEAST = 1e-4
# See `rest_shape`.
THINNEST = 0.25
# Edges of a regular tetrahedron, as columns.
REGULAR = np.array([[1.0, 0.5, 0.5], [0.0, 3**0.5 / 2, 3**0.5 / 6], [0.0, 0.0, (2 / 3) ** 0.5]])


@dataclass(frozen=True)
class TetEnergy:
    """Tetrahedra (m,4) with gradients (m,4,3) of their scaled rest shape and weights (m,) that sum to 1.

    volume_weight: w above; eps: of chi
    """

    tets: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray
    volume_weight: float
    eps: float = 0.0

    def jacobians(self, points: np.ndarray) -> np.ndarray:
        """F (m,3,3) of every tetrahedron at points (n,3)."""
        return np.swapaxes(points[self.tets], 1, 2) @ self.gradient

    def value(self, points: np.ndarray) -> float:
        """The energy at points (n,3); infinite where a tetrahedron is inverted and eps is 0."""
        F = self.jacobians(points)
        d = determinants(F)
        if self.eps == 0 and not d.min() > 0:
            return np.inf
        chi = self._chi(d)
        shear = np.square(F).sum(axis=(1, 2)) / (3 * np.cbrt(chi) ** 2)
        return float(self.weight @ (shear - 1 + self.volume_weight * ((d**2 + 1) / (2 * chi) - 1)))

    def _chi(self, d: np.ndarray) -> np.ndarray:
        root = np.hypot(d, self.eps)
        # Without cancellation for negative d.
        below = self.eps**2 / (2 * np.where(d > 0, 1.0, root - d))
        return np.where(d > 0, (d + root) / 2, np.maximum(below, 1e-30))

    def derivatives(self, points: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (n,3) in space, and blocks (m,4,3,4,3) of the Hessian, its eigenvalues taken by
        their size, in the frames
        (n,3,3) of the vertices, whose columns are axes."""
        F = self.jacobians(points)
        U, s, V = signed_svd(F)
        d = s.prod(axis=1)
        minors = np.stack([s[:, 1] * s[:, 2], s[:, 2] * s[:, 0], s[:, 0] * s[:, 1]], axis=1)
        by_square, by_both, by_d, by_dd = self._partial(np.square(s).sum(axis=1), d)
        stress = 2 * by_square[:, None] * s + by_d[:, None] * minors
        first = np.einsum("m,mik,mk,mjk->mij", self.weight, U, stress, V, optimize=True)
        flat = self.tets.ravel()
        forces = np.einsum("mij,maj->mai", first, self.gradient).reshape(-1, 3)
        slope = np.stack([np.bincount(flat, forces[:, k], len(points)) for k in range(3)], axis=1)
        inner = self._inner(s, minors, (by_square, by_both, by_d, by_dd))
        turn = np.swapaxes(frames[self.tets], 2, 3) @ U[:, None]
        along = self.gradient @ V
        # What every unknown does to U^T F V.
        B = np.einsum("mali,mak->mikal", turn, along).reshape(-1, 9, 12)
        return slope, (np.swapaxes(B, 1, 2) @ (inner @ B)).reshape(-1, 4, 3, 4, 3)

    def _partial(self, square: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, ...]:
        """Derivatives (m,) by |F|^2, by both, by d, and twice by d."""
        chi, root, w = self._chi(d), np.hypot(d, self.eps), self.volume_weight
        one = chi / root if self.eps else np.ones_like(d)
        two = self.eps**2 / (2 * root**3) if self.eps else np.zeros_like(d)
        third = chi ** (-2 / 3)
        by_square = third / 3
        by_both = -(2 / 9) * third / chi * one
        by_d = square * by_both + w * (d / chi - (d**2 + 1) * one / (2 * chi**2))
        by_dd = square * ((10 / 27) * third / chi**2 * one**2 - (2 / 9) * third / chi * two)
        by_dd += w * (1 / chi - 2 * d * one / chi**2 + (d**2 + 1) * (one**2 / chi**3 - two / (2 * chi**2)))
        return by_square, by_both, by_d, by_dd

    def _inner(self, s: np.ndarray, minors: np.ndarray, partial: tuple) -> np.ndarray:
        """The Hessian (m,9,9), its eigenvalues by their size, by the entries of U^T F V, row by row."""
        by_square, by_both, by_d, by_dd = (p[:, None, None] for p in partial)
        least = LEAST * 2 / 3
        mixed = 2 * s[:, :, None] * minors[:, None, :]
        A = by_both * (mixed + mixed.swapaxes(1, 2)) + by_dd * minors[:, :, None] * minors[:, None, :]
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            A[:, i, j] += partial[2] * s[:, k]
            A[:, j, i] += partial[2] * s[:, k]
        A += 2 * by_square * np.eye(3)
        values, vectors = np.linalg.eigh(A)
        A = (vectors * np.maximum(np.abs(values), least)[:, None]) @ np.swapaxes(vectors, 1, 2)
        result = np.zeros((len(s), 3, 3, 3, 3))
        axis = np.arange(3)
        result[:, axis[:, None], axis[:, None], axis, axis] = A
        for i, k in ((0, 1), (1, 2), (2, 0)):
            base, bend = 2 * partial[0], partial[2] * s[:, 3 - i - k]
            twist, flip = np.maximum(np.abs(base + bend), least), np.maximum(np.abs(base - bend), least)
            result[:, i, k, i, k] = result[:, k, i, k, i] = (flip + twist) / 2
            result[:, i, k, k, i] = result[:, k, i, i, k] = (flip - twist) / 2
        return result.reshape(-1, 9, 9) * self.weight[:, None, None]


def tet_energy(shape: RestShape, size: float, volume_weight: float, eps: float = 0.0) -> TetEnergy:
    """The energy of maps of tetrahedra of a shape into a body of volume `size`."""
    return TetEnergy(shape.tets, shape.gradient / np.cbrt(size), shape.weight, volume_weight, eps)


@dataclass(frozen=True)
class RestShape:
    """Tetrahedra (m,4), gradients (m,4,3) where the whole volume is 1, and volumes (m,) that sum to 1."""

    tets: np.ndarray
    gradient: np.ndarray
    weight: np.ndarray


def rest_shape(points: np.ndarray, tets: np.ndarray, smallest: float) -> RestShape:
    """The shape of tetrahedra (m,4) with vertices at points (n,3); slivers are taken for a little thicker.

    Of its map from the regular tetrahedron, the singular values are at least THINNEST times the greatest, and its
    volume at least `smallest` times the mean: what no map should be judged by is not asked for.
    """
    volume = tet_volumes(points, tets)
    volume = volume / volume.sum()
    p = points[tets]
    edges = np.swapaxes(p[:, 1:] - p[:, :1], 1, 2) @ np.linalg.inv(REGULAR)
    U, s, Vt = np.linalg.svd(edges)
    s = np.maximum(s, THINNEST * s[:, :1])
    asked = np.maximum(volume, smallest * volume.mean())
    regular = np.linalg.det(REGULAR) / 6
    s *= np.cbrt(asked / (regular * s.prod(axis=1)))[:, None]
    turn = np.sign(np.linalg.det(U @ Vt))
    U[:, :, 2] *= turn[:, None]
    rest = np.einsum("mik,mk,mkj->mij", U, s, Vt) @ REGULAR
    inverse = np.linalg.inv(rest)
    gradient = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    return RestShape(tets, gradient, asked / asked.sum())


def determinants(F: np.ndarray) -> np.ndarray:
    """Of matrices (m,3,3), (m,)."""
    return np.einsum("mi,mi->m", cross3(F[:, 0], F[:, 1]), F[:, 2])


def signed_svd(F: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """F (m,3,3) = U diag(s) V^T with rotations U, V (m,3,3); the last of s (m,3) has the sign of det F."""
    U, s, Vt = np.linalg.svd(F)
    left, right = np.sign(np.linalg.det(U)), np.sign(np.linalg.det(Vt))
    U[:, :, 2] *= left[:, None]
    Vt[:, 2] *= right[:, None]
    s[:, 2] *= left * right
    return U, s, Vt.swapaxes(1, 2)


class TetAssembly:
    """Where blocks of tetrahedra (m,4) go in the matrix of free unknowns; `unknown` (n,3) numbers these, -1: none."""

    def __init__(self, tets: np.ndarray, unknown: np.ndarray):
        self.unknown = unknown
        self.size = int(unknown.max()) + 1
        rows = unknown[tets]
        m = len(tets)
        r = np.broadcast_to(rows[:, :, :, None, None], (m, 4, 3, 4, 3)).reshape(-1)
        c = np.broadcast_to(rows[:, None, None, :, :], (m, 4, 3, 4, 3)).reshape(-1)
        self._used = np.flatnonzero((r >= 0) & (c >= 0))
        key = r[self._used].astype(np.int64) * self.size + c[self._used]
        keys, self._place = np.unique(key, return_inverse=True)
        self._place = self._place.ravel()
        self._indices = (keys % self.size).astype(np.int32)
        self._indptr = np.searchsorted(keys, np.arange(self.size + 1, dtype=np.int64) * self.size)

    def matrix(self, blocks: np.ndarray) -> sp.csr_matrix:
        """The sparse matrix of blocks (m,4,3,4,3)."""
        data = np.bincount(self._place, blocks.reshape(-1)[self._used], len(self._indices))
        return sp.csr_matrix((data, self._indices, self._indptr), shape=(self.size, self.size))

    def vector(self, slope: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Components of vectors (n,3) along the free axes of frames (n,3,3)."""
        along = np.einsum("nij,ni->nj", frames, slope)
        result = np.zeros(self.size)
        free = self.unknown >= 0
        result[self.unknown[free]] = along[free]
        return result

    def spread(self, x: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Vectors (n,3) in space of unknowns."""
        along = np.where(self.unknown >= 0, x[self.unknown], 0.0)
        return np.einsum("nij,nj->ni", frames, along)
