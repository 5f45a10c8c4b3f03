"""Average functions along a surface with Gaussian weights, by the heat equation in one Krylov space for all scales."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..linalg.sparse import Factor
from ..mesh.geometry import halfedge_lengths, laplacian_from_lengths, vertex_areas

# Dimension of the Krylov space, enough for 1e-4 over a range of times of 1 : 36.
DIMENSION = 24
# Below this a residual is rounding and the space is complete.
COMPLETE = 1e-12


class HeatMeans:
    """Gaussian means on a surface (n,3), (m,3), for standard deviations about `sigma`, a length."""

    def __init__(self, positions: np.ndarray, triangles: np.ndarray, sigma: float):
        n = len(positions)
        self.area = vertex_areas(positions, triangles)
        # Vertices of no area are in no triangle, or all but: they are left alone.
        mass = np.maximum(self.area, 1e-12 * self.area.max())
        length = halfedge_lengths(positions, triangles).reshape(-1, 3)
        # Negative stiffness would let heat flow from cold to hot across obtuse triangles.
        laplacian = laplacian_from_lengths(length, triangles, n, least=0)
        self._root = np.sqrt(mass)
        self._step = sigma**2 / 2
        self._factor = Factor(sp.diags(mass) + self._step * laplacian)

    def means(self, integrated: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
        """Gaussian means (k,n) of a density whose integrals over the vertices' areas are given (n,).

        exp(-t M^-1 L) with t = sigma^2 / 2 in the Krylov space of (M + t0 L)^-1 M (van den Eshof, Hochbruck 2006,
        "Preconditioning Lanczos approximations to the matrix exponential").
        """
        start = integrated / self._root
        norm = np.linalg.norm(start)
        if norm == 0:
            return np.zeros((len(sigmas), len(start)))
        basis = [start / norm]
        projected = np.zeros((DIMENSION, DIMENSION))
        for k in range(DIMENSION):
            v = self._root * self._factor.solve(self._root * basis[k])
            rows = np.array(basis)
            h = rows @ v
            v = v - h @ rows
            again = rows @ v
            v = v - again @ rows
            projected[: k + 1, k] = h + again
            size = np.linalg.norm(v)
            if k + 1 == DIMENSION or size < COMPLETE:
                break
            basis.append(v / size)
        m = len(basis)
        # Symmetric but for rounding: the upper triangle has all of it.
        value, vector = np.linalg.eigh(projected[:m, :m], UPLO="U")
        decay = (1 / np.clip(value, 1e-15, 1) - 1) / self._step
        heat = np.exp(-0.5 * np.outer(np.asarray(sigmas) ** 2, decay)) * vector[0]
        return norm * (heat @ vector.T) @ np.array(basis) / self._root
