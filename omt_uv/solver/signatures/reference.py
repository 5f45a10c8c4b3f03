"""The exact distance of a density on triangles of the sphere and points of equal masses, to judge assignments by.

Semi-discrete transport on the sphere (Su 2015, equation 3.31): cells of the points where the squared angle plus a site
weight is least, clipped on the triangles; weights by damped Newton. Squared angles from two points differ by a
linear function on a flat triangle, so that cells are those of linear ones, as in `partition`; what these lack in the
middle of a triangle is the same for all points, and taken off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..linalg.sparse import solve_spd
from ..mesh.geometry import halfedge_lengths, laplacian_from_weights
from ..partition.cells import GeodesicCells, geodesic_cells
from ..partition.polar_coordinates import PolarCoordinates
from ..progress import Steps
from ..transport.damped_newton import check_mass, solve_dual

TOLERANCE = 1e-4


@dataclass(frozen=True)
class ExactTransport:
    """square: the mean squared angle of the best transport; bound: its value in the dual problem, which no transport is
    below; residual: largest relative error of a point's mass; iterations: Newton steps"""

    square: float
    bound: float
    residual: float
    iterations: int


def exact_transport(
    sphere: np.ndarray, triangles: np.ndarray, mass: np.ndarray, points: np.ndarray
) -> Steps[ExactTransport]:
    """Transport of masses (m,), even on triangles (m,3) of unit vectors (n,3), to points (k,3) of equal masses.

    All pairs of a triangle and a point are held: for some hundreds of points on some thousands of triangles.

    Raises
    ------
    TransportError : a mass that is negative, or no convergence

    References
    ----------
    Su 2015, equation 3.31; Kitagawa, Merigot, Thibert 2019
    """
    total = float(check_mass(mass).sum())
    dual = _SphereDual(_pairs(sphere, triangles, points), mass / total, len(points))
    weights, asked = np.zeros(len(points)), np.full(len(points), 1 / len(points))
    found = yield from solve_dual(dual, weights, dual.cells(weights), asked, TOLERANCE)
    cells, pairs = found.cells, dual.pairs
    # Linear on a triangle: the value at the centroid of a piece is its mean.
    s, t = cells.polygons.moments()[1].T
    a, b, c = pairs.squared[cells.pair].T
    square = float((cells.part * (s * a + t * b + (1 - s - t) * c)).sum())
    square -= float((mass / total) @ (halfedge_lengths(sphere, triangles).reshape(-1, 3) ** 2).sum(axis=1)) / 12
    shift = float((found.site_weights * (cells.area - asked)).sum())
    return ExactTransport(square, square + shift, found.residual, found.iterations)


def _pairs(sphere: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> PolarCoordinates:
    """Squared angles of every point from the corners of every triangle, ordered by triangle."""
    m, k = len(triangles), len(points)
    chord = np.maximum(2 - 2 * (sphere @ points.T), 0)
    angle = 2 * np.arcsin(np.minimum(np.sqrt(chord) / 2, 1))
    squared = (angle**2)[triangles].transpose(0, 2, 1).reshape(m * k, 3)
    return PolarCoordinates(
        site=np.tile(np.arange(k), m),
        face=np.repeat(np.arange(m), k),
        squared=squared,
        log=np.zeros((0, 3, 2)),
        nearest=squared.min(axis=1),
        farthest=squared.max(axis=1),
        last=np.zeros(m * k, bool),
    )


class _SphereDual:
    """The dual of points and triangles that all see one another, see `damped_newton.Dual`."""

    growth = 4.0
    small_step = 0.0
    good_residual = 0.0

    def __init__(self, pairs: PolarCoordinates, mass: np.ndarray, count: int):
        self.pairs, self.mass, self.count = pairs, mass, count

    def cells(self, site_weights: np.ndarray) -> GeodesicCells:
        """The cells of site weights (k,)."""
        return geodesic_cells(self.pairs, site_weights, self.mass)

    def near(self, site_weights: np.ndarray, cells: GeodesicCells) -> GeodesicCells | None:
        """The cells of site weights (k,); None where one has vanished."""
        trial = self.cells(site_weights)
        return trial if trial.area.min() > 0 else None

    def confirmed(self, site_weights: np.ndarray, cells: GeodesicCells) -> GeodesicCells:
        """The cells themselves: nothing was guessed."""
        return cells

    def direction(self, cells: GeodesicCells, mass: np.ndarray) -> np.ndarray:
        """Newton's direction (k,); the first weight stays, as on the sphere all cells are connected."""
        hessian = laplacian_from_weights(cells.side[:, 0], cells.side[:, 1], cells.conductance, len(mass))
        keep = np.flatnonzero(hessian.diagonal() > 0)[1:]
        direction = np.zeros(len(mass))
        small = csr_matrix(hessian[keep][:, keep])
        direction[keep] = solve_spd(small, (cells.area - mass)[keep])
        return direction

    def first_step(self, cells: GeodesicCells, direction: np.ndarray) -> float:
        """The whole step."""
        return 1.0
