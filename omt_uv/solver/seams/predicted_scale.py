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

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lapack, solve_triangular

from ..errors import PrecisionError
from ..mesh.geometry import LEAST_STIFFNESS, halfedge_lengths, laplacian_from_lengths
from .coarse_surface import CoarseSurface

# The plate of a closed surface is held a little everywhere: its Green's function has digits left for the first pin.
PLATE_GROUND = 1e-2
# Where a plate has slivers, its diagonal grows by this share.
SLIVER_GROUND = 1e-9
# Areas below this share of the mean would make a plate stiff without end.
LEAST_AREA = 1e-3
# Added to the diagonal of Green's functions, over itself and over its largest, against rounding.
ROUNDING = 1e-8
LEAST_ROUNDING = 1e-13
# Of what was there before others were held, what is left is rounding below this share: dozens of the last digit.
LEAST_PIVOT = 1e-14


@dataclass(frozen=True)
class Held:
    """The answer of a surface to a load, held at 0 at some vertices.

    Attributes
    ----------
    value (n,) : under the load
    green (n,n) : Green's function, the answer to a unit load at every vertex, before what is cut was held, too
    rows (k,n) : of a root of what cuts have taken off since: Green's function is now green - rows^T rows
    """

    value: np.ndarray
    green: np.ndarray
    rows: np.ndarray

    @staticmethod
    def of(green: np.ndarray, load: np.ndarray) -> Held:
        """The answer to a load (n,) by Green's function (n,n)."""
        return Held(green @ load, green, np.zeros((0, len(load))))

    def at(self, vertices: np.ndarray, own: np.ndarray | None = None) -> Held:
        """Held at the vertices (k,), too; own : see `between`."""
        root, apart = _root(self.between(vertices, own), self.green[vertices, vertices].max())
        vertices = vertices[apart]
        taken = self.green[vertices] - self.rows[:, vertices].T @ self.rows
        rows = solve_triangular(root, taken, lower=True)
        value = self.value - rows.T @ solve_triangular(root, self.value[vertices], lower=True)
        return Held(value, self.green, np.concatenate([self.rows, rows]))

    def between(self, vertices: np.ndarray, own: np.ndarray | None = None) -> np.ndarray:
        """Green's function (k,k) between vertices (k,) that are to be cut; own (k,) : at each of them, before others
        were cut that are to count as cut at once with these."""
        part = self.rows[:, vertices]
        block = self.green[vertices[:, None], vertices] - part.T @ part
        at = np.diag_indices(len(vertices))
        if own is not None or len(vertices) > 1:
            own = block.diagonal() if own is None else own
            # The first pin of a closed surface takes all of its load: what gave way there would be a spread that stays.
            block[at] += ROUNDING * own + LEAST_ROUNDING * own.max()
        # What others hold already answers with nothing, but by rounding.
        block[at] = np.maximum(block[at], LEAST_ROUNDING * self.green[vertices, vertices])
        return block

    def own(self, vertices: np.ndarray) -> np.ndarray:
        """Green's function (k,) of each of the vertices (k,) at itself."""
        return self.green[vertices, vertices] - (self.rows[:, vertices] ** 2).sum(axis=0)


@dataclass(frozen=True)
class ScaleModel:
    """A surface under its curvature, held at its boundary.

    Attributes
    ----------
    plate : holds the stress, 0 on the boundary, by the bilaplacian
    load (n,) : the curvature, 0 on the boundary
    laplacian (n,n) : of the surface
    area (n,) : asked for at every vertex
    """

    plate: Held
    load: np.ndarray
    laplacian: sp.csr_matrix
    area: np.ndarray

    @staticmethod
    def of(surface: CoarseSurface, log_density: np.ndarray | None = None) -> ScaleModel:
        """The model of a coarse surface.

        log_density (n,): half the logarithm of the area asked for, over its own
        """
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
        held = PLATE_GROUND if len(free) == n else 0.0
        columns = laplacian[:, free] + held * sp.diags(surface.area).tocsc()[:, free]
        area = np.maximum(area, LEAST_AREA * area.mean())
        plate = Held.of(_inverse(columns.T @ sp.diags(1 / area) @ columns, free, n), load)
        return ScaleModel(plate, load, laplacian, area)

    @property
    def scale(self) -> np.ndarray:
        """What is left of the log scale at every vertex (n,), without what goes for nothing."""
        return self.laplacian @ self.plate.value / self.area

    @property
    def spread(self) -> float:
        """Mean square of what maps shear by, up to a factor: the energy of the plate."""
        return float(self.load @ self.plate.value)

    def spread_cut(self, vertices: np.ndarray) -> float:
        """The spread that is left where the stress is 0 at the vertices (k,) of a cut, too."""
        if len(vertices) == 0:
            return self.spread
        stress = self.plate.value[vertices]
        return self.spread - float(stress @ np.linalg.solve(self.plate.between(vertices), stress))

    def falls(self, vertices: np.ndarray) -> np.ndarray:
        """Fall of the spread (k,) by cuts at the first of the vertices (k,), at the first two, and so on: all by one
        factor. What rounding leaves no digits of counts for nothing."""
        fall = prefix_energies(self.plate.between(vertices), self.plate.value[vertices])
        return np.maximum.accumulate(np.where(np.isfinite(fall), fall, 0.0))

    def cut(self, vertices: np.ndarray, own: np.ndarray | None = None) -> ScaleModel:
        """The model of the surface cut at the vertices (k,); own : see `Held.between`."""
        if len(vertices) == 0:
            return self
        return replace(self, plate=self.plate.at(vertices, own))

    def gain(self, vertices: np.ndarray) -> np.ndarray:
        """Fall of the spread (k,) by a cut at each of the vertices (k,) alone."""
        return self.plate.value[vertices] ** 2 / np.maximum(self.plate.own(vertices), 1e-300)


def _root(block: np.ndarray, whole: float) -> tuple[np.ndarray, np.ndarray | slice]:
    """A root (j,j) of Green's function (k,k) between vertices, and which (j,) of these it is of: all, or where rounding
    of the whole, what was there before others were held, does not leave all told apart, those that it does."""
    try:
        root = np.linalg.cholesky(block)
    except np.linalg.LinAlgError:
        root = np.zeros_like(block)
    if np.square(root.diagonal()).min(initial=np.inf) > LEAST_PIVOT * whole:
        return root, slice(None)
    # The freest first: where they are held, nothing is left at the others but rounding.
    root, order, rank, _ = lapack.dpstrf(block, tol=LEAST_ROUNDING * whole, lower=1)
    return np.tril(root[:rank, :rank]), order[:rank] - 1


def prefix_energies(matrix: np.ndarray, load: np.ndarray) -> np.ndarray:
    """load[:j] . matrix[:j, :j]^-1 load[:j] for every j (k,), of a positive symmetric matrix (k,k) and a load (k,), all
    by one Cholesky factor; infinite from where rounding has left it no longer positive."""
    root, flaw = lapack.dpotrf(matrix, lower=1)
    known = flaw - 1 if flaw > 0 else len(load)
    energy = np.full(len(load), np.inf)
    if known:
        answer, _ = lapack.dtrtrs(root[:known, :known], load[:known], lower=1)
        energy[:known] = np.cumsum(np.square(answer))
    return energy


def _inverse(matrix, free: np.ndarray, n: int) -> np.ndarray:
    """The inverse (n,n) of a symmetric positive matrix on the vertices `free` (k,), 0 elsewhere."""
    if not len(free):
        return np.zeros((n, n))
    # Nearly all of the inverse is asked for: dense, by Cholesky, is the quickest there is.
    dense = matrix.toarray(order="F")
    root, flaw = lapack.dpotrf(dense, lower=1)
    if flaw:
        # Slivers differ from their neighbours by more than double precision has: each is held a little by itself.
        dense[np.diag_indices(len(free))] *= 1 + SLIVER_GROUND
        root, flaw = lapack.dpotrf(dense, lower=1)
    # The factor has zeros in its upper half, and the inverse keeps them there.
    half, flaw = lapack.dpotri(root, lower=1, overwrite_c=1) if flaw == 0 else (root, flaw)
    if flaw:
        raise PrecisionError("The matrix of a coarse surface is singular in double precision")
    inverse = half + half.T
    inverse[np.diag_indices(len(free))] /= 2
    if len(free) == n:
        return inverse
    whole = np.zeros((n, n))
    whole[np.ix_(free, free)] = inverse
    return whole
