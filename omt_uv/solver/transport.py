"""Semi-discrete optimal transport: weights of a power diagram whose cells have prescribed areas.

Damped Newton on the concave dual (Gu, Luo, Sun, Yau 2013; Kitagawa, Merigot, Thibert 2019, algorithm 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .domain import Domain
from .errors import TransportError
from .geometry import laplacian_from_weights
from .linear import solve_spd
from .power_diagram import PowerDiagram, power_diagram
from .progress import Progress, Steps

TOLERANCE = 5e-7
MAX_STEPS = 100
MAX_HALVINGS = 30


@dataclass(frozen=True)
class Transport:
    """Weights (n,) and cells; residual: largest |area - mass| / mass; cost; Newton steps and diagrams built."""

    weights: np.ndarray
    cells: PowerDiagram
    residual: float
    cost: float
    iterations: int
    diagrams: int


def transport(
    sites: np.ndarray,
    mass: np.ndarray,
    domain: Domain,
    tolerance: float = TOLERANCE,
    weights: np.ndarray | None = None,
) -> Steps[Transport]:
    """Transport the uniform measure of a convex domain to sites (n,2) with mass (n,) > 0.

    The masses are scaled to sum to the domain's area. All sites must lie in the closed domain and be
    distinct. `weights` (n,) start the iteration, 0 by default (the Voronoi diagram).

    Raises
    ------
    TransportError : masses that are not positive, sites that coincide, or no convergence
    """
    mass = np.asarray(mass, dtype=float)
    wrong = np.flatnonzero(~(np.isfinite(mass) & (mass > 0)))
    if len(wrong):
        raise TransportError("Transport needs positive, finite masses", "Give every vertex area", "vertex", wrong)
    mass = mass * (domain.area / mass.sum())
    w = np.zeros(len(sites)) if weights is None else weights - weights.mean()
    cells = power_diagram(sites, w, domain)
    diagrams = 1
    hidden = np.flatnonzero(cells.area <= 0)
    if len(hidden):
        raise TransportError("Sites coincide or lie outside the domain", kind="vertex", elements=hidden)
    floor = 0.5 * min(cells.area.min(), mass.min())
    error = np.linalg.norm(cells.area - mass)
    first = max(_residual(cells, mass), tolerance)
    step = 1.0
    for iteration in range(MAX_STEPS):
        residual = _residual(cells, mass)
        done = 1 - np.log(max(residual, tolerance) / tolerance) / np.log(1 + first / tolerance)
        yield Progress("Optimal transport", float(np.clip(done, 0, 1)))
        if residual <= tolerance:
            return Transport(w, cells, residual, cells.cost(sites), iteration, diagrams)
        direction = _newton_direction(sites, cells, mass)
        step = min(1.0, 4 * step)
        for _ in range(MAX_HALVINGS):
            trial_w = w + step * direction
            trial = power_diagram(sites, trial_w, domain)
            diagrams += 1
            trial_error = np.linalg.norm(trial.area - mass)
            if trial.area.min() >= floor and trial_error <= (1 - step / 2) * error:
                break
            step /= 2
        else:
            raise TransportError(f"The transport is stuck at a residual of {residual:.1e}")
        w, cells, error = trial_w, trial, trial_error
    raise TransportError(f"The transport did not converge in {MAX_STEPS} steps")


def _residual(cells: PowerDiagram, mass: np.ndarray) -> float:
    return float(np.max(np.abs(cells.area - mass) / mass))


def _newton_direction(sites: np.ndarray, cells: PowerDiagram, mass: np.ndarray) -> np.ndarray:
    """Derivative of area i by weight j: -|side ij| / (2 |y_i - y_j|); a common weight is its kernel."""
    n = len(sites)
    i, j = cells.edges.T
    conductance = cells.length / (2 * np.linalg.norm(sites[i] - sites[j], axis=1))
    hessian = laplacian_from_weights(i, j, conductance, n)[1:, 1:]
    return np.concatenate([[0.0], solve_spd(hessian.tocsc(), (mass - cells.area)[1:], order="mmd")])
