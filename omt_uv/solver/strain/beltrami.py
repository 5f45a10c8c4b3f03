"""The Beltrami coefficient of a piecewise linear map: how much it shears every triangle, and in which direction.

In the plane of a triangle the map is w = alpha z + beta conj(z), and mu = beta / alpha (Su 2015, section 5.2, with d/dz
and d/dconj(z) as section 2.3 has them). |mu| = (s1/s2 - 1) / (s1/s2 + 1) of the singular values, 0 where angles are
kept, below 1 where the map does not fold; the direction of the greatest stretch is that of the root of mu.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import plane_axes


@dataclass(frozen=True)
class Beltrami:
    """Of every triangle: mu (m,) complex in the frame of its first edge, its size (m,), infinite where the map has no
    area, beyond 1 where it folds; direction (m,3): unit vectors of the greatest stretch; area (m,) of the surface."""

    mu: np.ndarray
    size: np.ndarray
    direction: np.ndarray
    area: np.ndarray

    @property
    def mean(self) -> float:
        """Mean of |mu|, at most 1, over the area."""
        return float(self.area @ np.minimum(self.size, 1) / max(float(self.area.sum()), 1e-300))

    def histogram(self, bins: int = 20) -> np.ndarray:
        """Share of the area (bins,) with |mu| in each of so many equal parts of [0, 1]."""
        counts, _ = np.histogram(np.clip(self.size, 0, 1), bins, (0.0, 1.0), weights=self.area)
        return counts / max(float(self.area.sum()), 1e-300)


def beltrami(positions: np.ndarray, triangles: np.ndarray, image: np.ndarray) -> Beltrami:
    """The Beltrami coefficient of the map of a surface (n,3), (m,3) to image (n,3), or (n,2) in the plane.

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv.solver.strain.beltrami import beltrami
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> found = beltrami(square, np.array([[0, 1, 2], [0, 2, 3]]), square * [3, 1, 1])
    >>> found.size.round(6).tolist(), np.abs(found.direction[0]).round(6).tolist()
    ([0.5, 0.5], [1.0, 0.0, 0.0])
    """
    return corner_beltrami(positions[triangles], image[triangles])


def corner_beltrami(corners: np.ndarray, image: np.ndarray) -> Beltrami:
    """As `beltrami`, of triangles given by their corners (m,3,3) and those of the image (m,3,3) or (m,3,2)."""
    first, second = plane_axes(corners)
    side, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    z1, z2 = _in(side, first, second), _in(other, first, second)
    if image.shape[2] == 2:
        w = image @ np.array([1, 1j])
        w1, w2 = w[:, 1] - w[:, 0], w[:, 2] - w[:, 0]
    else:
        axes = plane_axes(image)
        w1, w2 = _in(image[:, 1] - image[:, 0], *axes), _in(image[:, 2] - image[:, 0], *axes)
    # alpha z + beta conj(z) = w at both sides; the determinant is that of z, up to a factor.
    alpha = w1 * z2.conj() - w2 * z1.conj()
    beta = z1 * w2 - z2 * w1
    there = np.abs(alpha) > 0
    mu = np.where(there, beta / np.where(there, alpha, 1), np.where(np.abs(beta) > 0, np.inf, 0))
    root = np.exp(0.5j * np.angle(mu))
    direction = root.real[:, None] * first + root.imag[:, None] * second
    area = 0.5 * np.abs((z1.conj() * z2).imag)
    return Beltrami(mu, np.abs(mu), direction, area)


def _in(vectors: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Vectors (m,3) as complex numbers (m,) in the axes (m,3)."""
    return np.einsum("md,md->m", vectors, first) + 1j * np.einsum("md,md->m", vectors, second)
