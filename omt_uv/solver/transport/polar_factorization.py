"""Factor a map into a convex domain: a measure-preserving map, then the gradient of a convex function (Brenier 1991).

Every map phi of a measure space (S, mu) to a convex domain factors uniquely as phi = grad u o s, where s carries mu to
the uniform measure and u is convex. Su 2015, section 3.2.8, varies the measure between that of the surface and that of
the conformal map and thereby moves from the area-preserving to the angle-preserving map. Unwrapping does not come this
way: it stands by itself, as a tool to look at maps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..progress import Steps
from .convex_domain import Domain
from .power_diagram import power_diagram
from .semidiscrete import transport


@dataclass(frozen=True)
class PolarFactorisation:
    """phi = grad u o s at the vertices of a mesh.

    Attributes
    ----------
    sites : (n,2) phi
    uv : (n,2) s, the centroids of the cells
    mass : (n,) the measure, its sum the domain's area
    area : (n,) of the cells
    site_weights : (n,) h of the convex function u(x) = max_i (2 x . y_i - |y_i|^2 + h_i) / 2
    residual : largest |area - mass| / mass
    iterations : Newton steps of the transport
    """

    sites: np.ndarray
    uv: np.ndarray
    mass: np.ndarray
    area: np.ndarray
    site_weights: np.ndarray
    residual: float
    iterations: int

    def potential(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """u at points (k,2), (k,), and its gradient (k,2): the site whose cell the point lies in."""
        planes = x @ self.sites.T - ((self.sites**2).sum(axis=1) - self.site_weights) / 2
        cell = planes.argmax(axis=1)
        return planes[np.arange(len(x)), cell], self.sites[cell]


def polar_factorisation(
    sites: np.ndarray, mass: np.ndarray, domain: Domain, balance: float = 0.0
) -> Steps[PolarFactorisation]:
    """Polar factorisation of the map of vertices with mass (n,) > 0 to sites (n,2) in a disk or a square.

    `balance` t in [0, 1] replaces the masses mu_0 by (1 - t) mu_0 + t mu_1, where mu_1 are the areas that the sites'
    Voronoi cells have in the domain: 0 preserves the given measure, 1 leaves the sites where they are but for the
    difference between a site and the centroid of its own cell.

    Raises
    ------
    TransportError : masses that are not positive, or sites that coincide or lie outside
    """
    if not 0 <= balance <= 1:
        raise ValueError(f"balance must lie in [0, 1], not {balance}")
    mass = np.asarray(mass, float)
    own = power_diagram(sites, np.zeros(len(sites)), domain).area
    blend = (1 - balance) * mass * (domain.area / mass.sum()) + balance * own
    found = yield from transport(sites, blend, domain)
    return PolarFactorisation(
        sites=sites,
        uv=found.cells.centroid,
        mass=blend,
        area=found.cells.area,
        site_weights=found.site_weights,
        residual=found.residual,
        iterations=found.iterations,
    )
