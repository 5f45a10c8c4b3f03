"""Semi-discrete optimal transport: weights of a power diagram whose cells have prescribed areas.

Damped Newton on the concave dual (Gu, Luo, Sun, Yau 2013; Kitagawa, Merigot, Thibert 2019, algorithm 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import TransportError
from ..linalg.multigrid import LaplacianSolver
from ..mesh.geometry import as_complex, laplacian_from_weights
from ..progress import Progress, Steps
from .convex_domain import Domain
from .power_diagram import PowerDiagram, power_diagram
from .regular_triangulation import by_flips

TOLERANCE = 5e-7
MAX_STEPS = 100
MAX_HALVINGS = 30
# The first step tried has bisectors of neighbours move at most this many times as far as to the nearer of the two.
BOLD = 256.0
# Directions are solved for to so many digits of the residual; with fewer there are more Newton steps.
ENOUGH = 1e-3


@dataclass(frozen=True)
class Transport:
    """Weights (n,) and cells; residual: largest |area - mass| / mass; cost; Newton steps; diagrams
    and hulls built; flips of edges."""

    weights: np.ndarray
    cells: PowerDiagram
    residual: float
    cost: float
    iterations: int
    diagrams: int
    hulls: int
    flips: int


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
    nowhere = np.flatnonzero(~np.isfinite(sites).all(axis=1))
    if len(nowhere):
        raise TransportError("Sites have no finite place", kind="vertex", elements=nowhere)
    if len(wrong):
        raise TransportError("Transport needs positive, finite masses", "Give every vertex area", "vertex", wrong)
    # Neighbours in the plane become neighbours in memory, and `Multigrid` wants them so.
    order = cKDTree(sites).indices
    sites, mass = sites[order], mass[order] * (domain.area / mass.sum())
    w = np.zeros(len(sites)) if weights is None else weights[order] - weights.mean()
    diagrams, laplacians = _Diagrams(sites, domain), LaplacianSolver()
    cells = diagrams.anew(w)
    hidden = np.flatnonzero(cells.area <= 0)
    if len(hidden):
        raise TransportError("Sites coincide or lie outside the domain", kind="vertex", elements=np.sort(order[hidden]))
    floor = 0.5 * min(cells.area.min(), mass.min())
    first = max(_residual(cells, mass), tolerance)
    step = 0.0
    for iteration in range(MAX_STEPS):
        residual = _residual(cells, mass)
        done = 1 - np.log(max(residual, tolerance) / tolerance) / np.log(1 + first / tolerance)
        yield Progress("Optimal transport", float(np.clip(done, 0, 1)))
        if residual <= tolerance:
            if diagrams.flipped and not cells.dual.whole:
                # Flips prove nothing on a straight rim: let the result stand on a hull of its own.
                cells = diagrams.anew(w)
                residual = _residual(cells, mass)
            if residual <= tolerance:
                cost, place = cells.cost(sites), np.argsort(order)
                return Transport(w[place], cells.renumbered(order), residual, cost, iteration, *diagrams.counts())
        direction = _newton_direction(sites, cells, mass, laplacians)
        error = float(np.linalg.norm(cells.area - mass))
        step = min(1.0, 4 * step) if iteration else _first_step(sites, cells, direction)
        for _ in range(MAX_HALVINGS):
            trial_w = w + step * direction
            trial = diagrams.next(trial_w, cells)
            if trial is not None and _acceptable(trial, mass, floor, (1 - step / 2) * error):
                break
            step /= 2
        else:
            raise TransportError(f"The transport is stuck at a residual of {residual:.1e}")
        w, cells = trial_w, trial
    raise TransportError(f"The transport did not converge in {MAX_STEPS} steps")


def _first_step(sites: np.ndarray, cells: PowerDiagram, direction: np.ndarray) -> float:
    """A power of a half: from cells of very different sizes a whole step hides so many sites that even to find one of
    them takes long, and so does half of it, and a quarter."""
    i, j = cells.edges.T
    apart = ((sites[i] - sites[j]) ** 2).sum(axis=1)
    reach = (apart / np.maximum(np.abs(direction[i] - direction[j]), 1e-300)).min()
    return float(np.exp2(np.floor(np.log2(np.clip(BOLD * reach, 0.5**MAX_HALVINGS, 1.0)))))


class _Diagrams:
    """Diagrams of the same sites under changing weights: repaired by flips where that works, else by a hull."""

    def __init__(self, sites: np.ndarray, domain: Domain):
        self.sites, self.domain = sites, domain
        self.count = self.hulls = self.flips = 0
        self.flipped = False

    def counts(self) -> tuple[int, int, int]:
        """Diagrams, hulls and flips so far."""
        return self.count, self.hulls, self.flips

    def anew(self, weights: np.ndarray) -> PowerDiagram:
        """The diagram of weights (n,), from a hull of its own. Raises TransportError."""
        self.count, self.hulls, self.flipped = self.count + 1, self.hulls + 1, False
        return power_diagram(self.sites, weights, self.domain)

    def next(self, weights: np.ndarray, near: PowerDiagram) -> PowerDiagram | None:
        """The diagram near another one; None if a cell has certainly vanished."""
        dual, hidden = by_flips(near.dual, self.sites, weights)
        if hidden:
            return None
        if dual is None:
            return self.anew(weights)
        self.count, self.flipped = self.count + 1, True
        self.flips += dual.flips
        return power_diagram(self.sites, weights, self.domain, dual)


def _acceptable(cells: PowerDiagram, mass: np.ndarray, floor: float, most: float) -> bool:
    return bool(cells.area.min() >= floor and np.linalg.norm(cells.area - mass) <= most)


def _residual(cells: PowerDiagram, mass: np.ndarray) -> float:
    return float(np.max(np.abs(cells.area - mass) / mass))


def _newton_direction(
    sites: np.ndarray, cells: PowerDiagram, mass: np.ndarray, laplacians: LaplacianSolver
) -> np.ndarray:
    """Derivative of area i by weight j: -|side ij| / (2 |y_i - y_j|); a common weight is its kernel."""
    i, j = cells.edges.T
    z = as_complex(sites)
    conductance = cells.length / (2 * np.abs(z[i] - z[j]))
    hessian = laplacian_from_weights(i, j, conductance, len(sites))
    return laplacians.solve(hessian, mass - cells.area, mass, ENOUGH)
