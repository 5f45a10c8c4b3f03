"""Transport a convex domain of the plane to sites, by semi-discrete optimal transport (Gu, Luo, Sun, Yau 2013).

The cell of site y_i is where |x - y_i|^2 - h_i is least; the site weights h give every cell its mass (`damped_newton`).
Among all maps with such cells this one moves the domain least: the integral of |x - y|^2 (Aurenhammer, Hoffmann, Aronov
1998).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import TransportError
from ..linalg.multigrid import LaplacianSolver
from ..mesh.geometry import as_complex, laplacian_from_weights
from ..progress import Steps
from .convex_domain import Domain
from .damped_newton import MAX_HALVINGS, TOLERANCE, check_mass, solve_dual
from .power_diagram import PowerDiagram, power_diagram
from .regular_triangulation import by_flips

# The first step tried has bisectors of neighbours move at most this many times as far as to the nearer of the two.
BOLD = 256.0
# Directions are solved for to so many digits of the residual; with fewer there are more Newton steps.
ENOUGH = 1e-3


@dataclass(frozen=True)
class Transport:
    """Cells of prescribed areas.

    Attributes
    ----------
    site_weights : (n,)
    cells : power diagram
    residual : largest |area - mass| / mass
    cost : integral of |x - y|^2, y the site of x
    iterations : Newton steps
    diagrams, hulls, flips : power diagrams and hulls built, edges flipped
    """

    site_weights: np.ndarray
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
    site_weights: np.ndarray | None = None,
) -> Steps[Transport]:
    """Transport the uniform measure of a convex domain to sites (n,2) with mass (n,) > 0.

    The masses are scaled to sum to the domain's area. All sites must lie in the closed domain and be
    distinct. `site_weights` (n,) start the iteration, 0 by default (the Voronoi diagram).

    Raises
    ------
    TransportError : masses that are not positive, sites that coincide, or no convergence
    """
    nowhere = np.flatnonzero(~np.isfinite(sites).all(axis=1))
    if len(nowhere):
        raise TransportError("Sites have no finite place", kind="vertex", elements=nowhere)
    mass = check_mass(mass)
    # Neighbours in the plane become neighbours in memory, and `Multigrid` wants them so.
    order = cKDTree(sites).indices
    sites, mass = sites[order], mass[order] * (domain.area / mass.sum())
    w = np.zeros(len(sites)) if site_weights is None else site_weights[order] - site_weights.mean()
    dual = PlanarDual(sites, domain)
    cells = dual.anew(w)
    hidden = np.flatnonzero(cells.area <= 0)
    if len(hidden):
        raise TransportError(
            "Sites are too close together to tell apart, as at the ends of long limbs, or outside the domain",
            kind="vertex",
            elements=np.sort(order[hidden]),
        )
    found = yield from solve_dual(dual, w, cells, mass, tolerance)
    return Transport(
        site_weights=found.site_weights[np.argsort(order)],
        cells=found.cells.renumbered(order),
        residual=found.residual,
        cost=found.cells.cost(sites),
        iterations=found.iterations,
        diagrams=dual.diagrams,
        hulls=dual.hulls,
        flips=dual.flips,
    )


class PlanarDual:
    """The dual for sites (n,2) in a convex domain, see `damped_newton.Dual`; it counts diagrams, hulls and flips.

    Diagrams are repaired by flips where that works, else they have a hull of their own.
    """

    growth = 4.0
    small_step = 0.0
    good_residual = 0.0

    def __init__(self, sites: np.ndarray, domain: Domain):
        self.sites, self.domain = sites, domain
        self.diagrams = self.hulls = self.flips = 0
        self._flipped = False
        self._laplacians = LaplacianSolver()

    def anew(self, site_weights: np.ndarray) -> PowerDiagram:
        """The diagram of site weights (n,), from a hull of its own. Raises TransportError."""
        self.diagrams, self.hulls, self._flipped = self.diagrams + 1, self.hulls + 1, False
        return power_diagram(self.sites, site_weights, self.domain)

    def near(self, site_weights: np.ndarray, cells: PowerDiagram) -> PowerDiagram | None:
        """The diagram of site weights (n,) near another one; None if a cell has vanished, or there is no diagram."""
        dual, hidden = by_flips(cells.dual, self.sites, site_weights)
        if hidden:
            return None
        if dual is None:
            try:
                return self.anew(site_weights)
            except TransportError:
                return None
        self.diagrams, self._flipped = self.diagrams + 1, True
        self.flips += dual.flips
        return power_diagram(self.sites, site_weights, self.domain, dual)

    def confirmed(self, site_weights: np.ndarray, cells: PowerDiagram) -> PowerDiagram:
        """The diagram of site weights (n,), from a hull of its own where flips prove nothing: at straight sides."""
        return self.anew(site_weights) if self._flipped and not cells.dual.whole else cells

    def direction(self, cells: PowerDiagram, mass: np.ndarray) -> np.ndarray:
        """Newton's direction (n,) of site weights.

        The derivative of area i by weight j is -|side ij| / (2 |y_i - y_j|); a common weight is its kernel.
        """
        i, j = cells.edges.T
        z = as_complex(self.sites)
        conductance = cells.length / (2 * np.abs(z[i] - z[j]))
        hessian = laplacian_from_weights(i, j, conductance, len(self.sites))
        return self._laplacians.solve(hessian, mass - cells.area, mass, ENOUGH)

    def first_step(self, cells: PowerDiagram, direction: np.ndarray) -> float:
        """The first share of a direction (n,) to try, a power of a half.

        From cells of very different sizes a whole step hides so many sites that even to find one of them takes long,
        and so does half of it, and a quarter.
        """
        i, j = cells.edges.T
        apart = ((self.sites[i] - self.sites[j]) ** 2).sum(axis=1)
        reach = (apart / np.maximum(np.abs(direction[i] - direction[j]), 1e-300)).min()
        return float(np.exp2(np.floor(np.log2(np.clip(BOLD * reach, 0.5**MAX_HALVINGS, 1.0)))))
