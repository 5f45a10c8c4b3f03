"""Semi-discrete optimal transport on the sphere: weights whose spherical cells have prescribed areas.

Damped Newton as in `transport.py` (Kitagawa, Merigot, Thibert 2019), for the cost -log cos of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import TransportError
from ..linalg.multigrid import LaplacianSolver
from ..mesh.geometry import laplacian_from_weights
from ..progress import Progress, Steps
from .spherical_power_diagram import Hull, SphericalCells, by_flips, by_hull, spherical_cells

TOLERANCE = 5e-7
MAX_STEPS = 100
MAX_HALVINGS = 30
# Directions are solved for up to this residual, relative to that of the areas.
SOLVED = 1e-4
# Where cells start tiny, so do steps: from one to the next they may grow by this, and below SMALL they shrink by 4.
GROWTH = 16.0
SMALL = 0.05
# Among cells that were 1e-19 of the sphere at first, rounding may end the search before the tolerance is reached. Below
# this residual a step that would have to be small tells of that, and what is reached will do.
ENOUGH = 1e-3


@dataclass(frozen=True)
class SphereTransport:
    """Weights (n,) and cells; residual: largest |area - mass| / mass; Newton steps, and diagrams built.

    The residual is above the tolerance, but at most ENOUGH, where rounding ended the search.
    """

    weights: np.ndarray
    cells: SphericalCells
    residual: float
    iterations: int
    diagrams: int


def sphere_transport(
    sites: np.ndarray,
    mass: np.ndarray,
    tolerance: float = TOLERANCE,
    hull: Hull | None = None,
    most: int = MAX_STEPS,
) -> Steps[SphereTransport]:
    """Transport the uniform measure of the sphere to unit vectors (n,3) with mass (n,) > 0, scaled to sum to 4 pi.

    `hull`, a triangulation of the sites, is where the search for their convex hull starts; sites closer together than
    about 1e-7 need one. A solution exists where no half of the mass is gathered too narrowly, as after centring
    (Oliker 2007).

    Raises
    ------
    TransportError : masses that are not positive, sites that coincide, or no convergence
    """
    mass = np.asarray(mass, dtype=float)
    wrong = np.flatnonzero(~(np.isfinite(mass) & (mass > 0)))
    if len(wrong):
        raise TransportError("Transport needs positive, finite masses", "Give every vertex area", "vertex", wrong)
    mass = mass * (4 * np.pi / mass.sum())
    h = np.zeros(len(sites))
    if hull is not None:
        hull, _ = by_flips(hull, sites, h)
    cells = spherical_cells(sites, h, hull or by_hull(sites, h))
    step, diagrams, newton = 0.0, 1, _Newton(sites)
    floor = 0.5 * min(cells.area.min(), mass.min())
    first = max(_residual(cells, mass), tolerance)
    for iteration in range(most):
        residual = _residual(cells, mass)
        done = 1 - np.log(max(residual, tolerance) / tolerance) / np.log(1 + first / tolerance)
        yield Progress("Optimal transport", float(np.clip(done, 0, 1)))
        if residual <= tolerance:
            return SphereTransport(h, cells, residual, iteration, diagrams)
        direction = newton.direction(cells, mass)
        error = float(np.linalg.norm(cells.area - mass))
        step = min(1.0, GROWTH * (step or _first_step(sites, cells, direction)))
        for _ in range(MAX_HALVINGS):
            trial = _near(cells, sites, h + step * direction)
            diagrams += 1
            if trial is not None and _acceptable(trial, mass, floor, (1 - step / 2) * error):
                break
            step /= 2 if step > SMALL else 4
            if residual <= ENOUGH and step <= SMALL:
                return SphereTransport(h, cells, residual, iteration, diagrams)
        else:
            raise TransportError(f"The transport is stuck at a residual of {residual:.1e}")
        h, cells = h + step * direction, trial
    raise TransportError(f"The transport did not converge in {most} steps")


def _first_step(sites: np.ndarray, cells: SphericalCells, direction: np.ndarray) -> float:
    """The share of a step at which, to first order, the bisector of two neighbours reaches one of them."""
    i, j = cells.edges.T
    reach = 0.5 * ((sites[i] - sites[j]) ** 2).sum(axis=1)
    return float((reach / np.maximum(np.abs(direction[i] - direction[j]), 1e-300)).min())


def _near(cells: SphericalCells, sites: np.ndarray, weights: np.ndarray) -> SphericalCells | None:
    """The cells for weights (n,) near those of other cells; None where a site is hidden."""
    hull, hidden = by_flips(cells.hull, sites, weights)
    if hidden:
        return None
    if hull is None:
        try:
            hull = by_hull(sites, weights)
        except TransportError:
            return None
    return spherical_cells(sites, weights, hull)


def _acceptable(cells: SphericalCells, mass: np.ndarray, floor: float, most: float) -> bool:
    return bool(cells.area.min() >= floor and np.linalg.norm(cells.area - mass) <= most)


def _residual(cells: SphericalCells, mass: np.ndarray) -> float:
    return float(np.max(np.abs(cells.area - mass) / mass))


class _Newton:
    """Newton's directions for sites (n,3), numbered along a kd-tree for `Multigrid`."""

    def __init__(self, sites: np.ndarray):
        self._order = cKDTree(sites).indices
        self._place, self._laplacians = np.argsort(self._order), LaplacianSolver()

    def direction(self, cells: SphericalCells, mass: np.ndarray) -> np.ndarray:
        """A common weight changes nothing: the mean is 0."""
        i, j = self._place[cells.edges.T]
        hessian = laplacian_from_weights(i, j, cells.conductance, len(mass))
        left, scale = (mass - cells.area)[self._order], mass[self._order]
        return self._laplacians.solve(hessian, left, scale, SOLVED)[self._place]
