"""Predict how a flat map scales a surface that is cut along any vertices, by Green's functions.

With the logarithm u of its length scale held at 0 on boundary and seam, which a free boundary of least area distortion
does (Springborn, Schroeder, Pinkall 2008, section 4), a flat conformal metric solves Laplacian(u) = curvature
(Ben-Chen, Gotsman, Bunin 2008, equation 5). To make areas exact, a map then has to shear: by exp(2 |u|) and less. A cut
is no more than further vertices where u = 0, so that trials cost a small dense system each (Woodbury), and no map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solve_triangular

from ..linalg.sparse import Factor
from ..mesh.geometry import cotangents_from_lengths, halfedge_lengths, laplacian_from_weights
from ..mesh.topology import halfedges
from .coarse_surface import CoarseSurface

# Least stiffness of an edge: those across obtuse corners would repel.
LEAST_STIFFNESS = 1e-3
# A closed surface is grounded through this share of its area, so that its Laplacian has an inverse.
GROUND = 1e-6
# Added to the diagonal of Green's functions, over their largest, against rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class ScaleModel:
    """Green's function (n,n) of a surface with u = 0 on its boundary, u (n,) there, and the area (n,), of sum 1."""

    green: np.ndarray
    scale: np.ndarray
    area: np.ndarray

    @staticmethod
    def of(surface: CoarseSurface, log_density: np.ndarray | None = None) -> ScaleModel:
        """The model of a coarse surface; log_density (n,): half the logarithm of the area asked for, over its own."""
        n = len(surface.positions)
        length = halfedge_lengths(surface.positions, surface.triangles).reshape(-1, 3)
        stiffness = np.maximum(0.5 * cotangents_from_lengths(length), LEAST_STIFFNESS).ravel()
        laplacian = laplacian_from_weights(*halfedges(surface.triangles), stiffness, n)
        curvature, area = surface.curvature, surface.area
        if log_density is not None:
            curvature = curvature + laplacian @ log_density
            area = area * np.exp(2 * log_density)
            area = area / area.sum()
        free = np.flatnonzero(~surface.boundary)
        inner = laplacian[free][:, free]
        if len(free) == n:
            inner = inner + GROUND * sp.diags(surface.area)
        inverse = Factor(inner.tocsc()).solve(np.eye(len(free)))
        green = np.zeros((n, n))
        green[np.ix_(free, free)] = (inverse + inverse.T) / 2
        return ScaleModel(green, green @ np.where(surface.boundary, 0.0, curvature), area)

    def spread(self, scale: np.ndarray) -> float:
        """Mean square over the surface of a log scale (n,)."""
        return float(self.area @ scale**2)

    def scale_cut(self, vertices: np.ndarray) -> np.ndarray:
        """The log scale (n,) where it is 0 at the vertices (k,) of a cut, too."""
        if len(vertices) == 0:
            return self.scale
        return self.scale - self.green[:, vertices] @ np.linalg.solve(self._between(vertices), self.scale[vertices])

    def cut(self, vertices: np.ndarray) -> ScaleModel:
        """The model of the surface cut at the vertices (k,)."""
        if len(vertices) == 0:
            return self
        root = np.linalg.cholesky(self._between(vertices))
        share = solve_triangular(root, self.green[vertices], lower=True)
        scale = self.scale - share.T @ solve_triangular(root, self.scale[vertices], lower=True)
        return ScaleModel(self.green - share.T @ share, scale, self.area)

    def gain(self, vertices: np.ndarray) -> np.ndarray:
        """Fall of the spread (k,) by a cut at each of the vertices (k,) alone."""
        columns = self.green[vertices]
        own = np.maximum(columns[np.arange(len(vertices)), vertices], 1e-300)
        part = self.scale[vertices] / own
        return 2 * part * (columns @ (self.area * self.scale)) - part**2 * (columns**2 @ self.area)

    def _between(self, vertices: np.ndarray) -> np.ndarray:
        block = self.green[np.ix_(vertices, vertices)]
        return block + ROUNDING * block.diagonal().max() * np.eye(len(vertices))
