"""Predict how much a flat map of a surface has to shear that is cut along any vertices, by Green's functions.

With the logarithm u of its length scale held at 0 on boundary and seam, which a free boundary of least area distortion
does (Springborn, Schroeder, Pinkall 2008, section 4), a flat conformal metric solves Laplacian(u) = curvature
(Ben-Chen, Gotsman, Bunin 2008, equation 5). To make areas exact, a map then has to move points within the plane, and
what moves are conformal costs no shear: the part of u that is harmonic goes for nothing. What is left, in the mean
square, is the energy of a clamped plate under the curvature as its load, K . stress / 2 with bilaplacian(stress) = K:
the equation of Foeppl and von Karman without bending (Landau, Lifshitz, Theory of Elasticity, section 14).
A cut is no more than further vertices without stress, so that trials cost a small dense system each (Woodbury), and no
map. Along a cut the plate is held but not clamped, which is the same where both sides are alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solve_triangular

from ..linalg.sparse import Factor
from ..mesh.geometry import LEAST_STIFFNESS, halfedge_lengths, laplacian_from_lengths
from .coarse_surface import CoarseSurface

# A closed surface is grounded through this share of its area, so that its Laplacian has an inverse.
GROUND = 1e-6
# The plate of a closed surface is held a little everywhere: its Green's function has digits left for the first pin.
PLATE_GROUND = 1e-2
# Areas below this share of the mean would make a plate stiff without end.
LEAST_AREA = 1e-3
# Added to the diagonal of Green's functions, over itself and over its largest, against rounding.
ROUNDING = 1e-8
LEAST_ROUNDING = 1e-13


@dataclass(frozen=True)
class ScaleModel:
    """A surface under its curvature, held at its boundary.

    Attributes
    ----------
    green (n,n) : Green's function of the Laplacian
    scale (n,) : the log scale u, 0 on the boundary
    plate (n,n) : Green's function of the bilaplacian
    stress (n,) : under the load, 0 on the boundary
    load (n,) : the curvature, 0 on the boundary
    """

    green: np.ndarray
    scale: np.ndarray
    plate: np.ndarray
    stress: np.ndarray
    load: np.ndarray

    @staticmethod
    def of(surface: CoarseSurface, log_density: np.ndarray | None = None) -> ScaleModel:
        """The model of a coarse surface; log_density (n,): half the logarithm of the area asked for, over its own."""
        n = len(surface.positions)
        length = halfedge_lengths(surface.positions, surface.triangles).reshape(-1, 3)
        laplacian = laplacian_from_lengths(length, surface.triangles, n, LEAST_STIFFNESS)
        curvature, area = surface.curvature, surface.area
        if log_density is not None:
            curvature = curvature + laplacian @ log_density
            area = area * np.exp(2 * log_density)
            area = area / area.sum()
        load = np.where(surface.boundary, 0.0, curvature)
        free = np.flatnonzero(~surface.boundary)
        columns = laplacian[:, free]
        ground, held = 0.0, 0.0
        if len(free) == n:
            ground, held = GROUND, PLATE_GROUND
        inner = columns[free] + ground * sp.diags(surface.area[free])
        columns = columns + held * sp.diags(surface.area).tocsc()[:, free]
        bend = columns.T @ sp.diags(1 / np.maximum(area, LEAST_AREA * area.mean())) @ columns
        green, plate = _inverse(inner, free, n), _inverse(bend, free, n)
        return ScaleModel(green, green @ load, plate, plate @ load, load)

    @property
    def spread(self) -> float:
        """Mean square of what maps shear by, up to a factor: the energy of the plate."""
        return float(self.load @ self.stress)

    def spread_cut(self, vertices: np.ndarray) -> float:
        """The spread that is left where the stress is 0 at the vertices (k,) of a cut, too."""
        if len(vertices) == 0:
            return self.spread
        stress = self.stress[vertices]
        return self.spread - float(stress @ np.linalg.solve(_between(self.plate, vertices), stress))

    def cut(self, vertices: np.ndarray) -> ScaleModel:
        """The model of the surface cut at the vertices (k,)."""
        if len(vertices) == 0:
            return self
        green, scale = _cut(self.green, self.scale, vertices)
        plate, stress = _cut(self.plate, self.stress, vertices)
        return ScaleModel(green, scale, plate, stress, self.load)

    def gain(self, vertices: np.ndarray) -> np.ndarray:
        """Fall of the spread (k,) by a cut at each of the vertices (k,) alone."""
        own = np.maximum(self.plate[vertices, vertices], 1e-300)
        return self.stress[vertices] ** 2 / own


def _inverse(matrix, free: np.ndarray, n: int) -> np.ndarray:
    """The inverse (n,n) of a symmetric matrix on the vertices `free` (k,), 0 elsewhere."""
    inverse = Factor(sp.csc_matrix(matrix)).solve(np.eye(len(free)))
    whole = np.zeros((n, n))
    whole[np.ix_(free, free)] = (inverse + inverse.T) / 2
    return whole


def _cut(green: np.ndarray, value: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Green's function (n,n) and the value (n,) under a load where both are 0 at the vertices (k,), too."""
    root = np.linalg.cholesky(_between(green, vertices))
    share = solve_triangular(root, green[vertices], lower=True)
    value = value - share.T @ solve_triangular(root, value[vertices], lower=True)
    return green - share.T @ share, value


def _between(green: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Green's function (k,k) between the vertices (k,) of a cut."""
    block = green[np.ix_(vertices, vertices)]
    own = block.diagonal()
    if len(vertices) == 1:
        # The first pin of a closed surface takes all of its load: what gave way there would be a spread that stays.
        return block
    return block + np.diag(ROUNDING * own + LEAST_ROUNDING * own.max())
