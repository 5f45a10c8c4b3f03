"""Transport the sphere to sites, by semi-discrete optimal transport (Oliker 2007).

The cost is -log cos of the distance. Site weights give every spherical cell (`spherical_power_diagram`) its mass, by
the same damped Newton method as in the plane (`damped_newton`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import TransportError
from ..linalg.multigrid import LaplacianSolver
from ..mesh.geometry import laplacian_from_weights
from ..progress import Steps
from .damped_newton import MAX_STEPS, TOLERANCE, check_mass, solve_dual
from .spherical_power_diagram import Hull, SphericalCells, by_flips, by_hull, spherical_cells

# Directions are solved for up to this residual, relative to that of the areas.
SOLVED = 1e-4


@dataclass(frozen=True)
class SphereTransport:
    """Cells of prescribed areas on the sphere.

    Attributes
    ----------
    site_weights : (n,)
    cells : spherical power diagram
    residual : largest |area - mass| / mass. It is above the tolerance, but at most `SphereDual.good_residual`, or what
        is tolerated, where rounding ended the search.
    iterations : Newton steps
    diagrams : how many were built
    """

    site_weights: np.ndarray
    cells: SphericalCells
    residual: float
    iterations: int
    diagrams: int


def sphere_transport(
    sites: np.ndarray,
    mass: np.ndarray,
    tolerance: float = TOLERANCE,
    hull: Hull | None = None,
    max_steps: int = MAX_STEPS,
    tolerated: float = 0.0,
) -> Steps[SphereTransport]:
    """Transport the uniform measure of the sphere to unit vectors (n,3) with mass (n,) > 0, scaled to sum to 4 pi.

    `hull`, a triangulation of the sites, is where the search for their convex hull starts; sites closer together than
    about 1e-7 need one. `tolerated` is a residual that will do where rounding ends the search. A solution exists where
    no half of the mass is gathered too narrowly, as after centring (Oliker 2007).

    Raises
    ------
    TransportError : masses that are not positive, sites that coincide, or no convergence
    """
    mass = check_mass(mass)
    mass = mass * (4 * np.pi / mass.sum())
    start = np.zeros(len(sites))
    if hull is not None:
        hull, _ = by_flips(hull, sites, start)
    cells = spherical_cells(sites, start, hull or by_hull(sites, start))
    dual = SphereDual(sites)
    found = yield from solve_dual(dual, start, cells, mass, tolerance, max_steps, tolerated)
    return SphereTransport(
        site_weights=found.site_weights,
        cells=found.cells,
        residual=found.residual,
        iterations=found.iterations,
        diagrams=1 + dual.diagrams,
    )


class SphereDual:
    """The dual for unit vectors (n,3), see `damped_newton.Dual`; it counts the diagrams that it builds."""

    # Where cells start tiny, so do steps.
    growth = 16.0
    small_step = 0.05
    # Among cells that were 1e-19 of the sphere at first, rounding may end the search before the tolerance is reached.
    # Below this residual a step that would have to be small tells of that, and what is reached will do.
    good_residual = 1e-3

    def __init__(self, sites: np.ndarray):
        self.sites, self.diagrams = sites, 0
        # `Multigrid` wants neighbours to be neighbours in memory: numbers along a kd-tree.
        self._order = cKDTree(sites).indices
        self._place, self._laplacians = np.argsort(self._order), LaplacianSolver()

    def near(self, site_weights: np.ndarray, cells: SphericalCells) -> SphericalCells | None:
        """The cells of site weights (n,) near those of other cells; None where a site is hidden."""
        self.diagrams += 1
        hull, hidden = by_flips(cells.hull, self.sites, site_weights)
        if hidden:
            return None
        if hull is None:
            try:
                hull = by_hull(self.sites, site_weights)
            except TransportError:
                return None
        try:
            return spherical_cells(self.sites, site_weights, hull)
        except TransportError:
            return None

    def confirmed(self, site_weights: np.ndarray, cells: SphericalCells) -> SphericalCells:
        """The same cells: flips that come to an end are proof, since a sphere has no boundary."""
        return cells

    def direction(self, cells: SphericalCells, mass: np.ndarray) -> np.ndarray:
        """Newton's direction (n,) of site weights; a common weight changes nothing: the mean is 0."""
        i, j = self._place[cells.edges.T]
        hessian = laplacian_from_weights(i, j, cells.conductance, len(mass))
        left, scale = (mass - cells.area)[self._order], mass[self._order]
        return self._laplacians.solve(hessian, left, scale, SOLVED)[self._place]

    def first_step(self, cells: SphericalCells, direction: np.ndarray) -> float:
        """The first share of a direction (n,) to try.

        As many times as a step may grow that at which, to first order, a bisector of two neighbours reaches one.
        """
        i, j = cells.edges.T
        reach = 0.5 * ((self.sites[i] - self.sites[j]) ** 2).sum(axis=1)
        share = float((reach / np.maximum(np.abs(direction[i] - direction[j]), 1e-300)).min())
        return min(1.0, self.growth * share)
