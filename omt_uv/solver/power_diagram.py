"""Power diagrams clipped to a convex domain: areas, moments and dual edges, all cells at once.

The cell of site i is where |x - y_i|^2 - w_i is least (Aurenhammer 1987). The dual is the regular triangulation of
`regular.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .domain import Domain, segment_integrals
from .geometry import cross2, dot2
from .regular import Regular, by_hull, power_centres
from .topology import next_halfedge


@dataclass(frozen=True)
class PowerDiagram:
    """Cells of n sites in a domain.

    area (n,), moment (n,2) the integral of x over the cell, second (n,) the integral of |x|^2;
    edges (k,2) pairs of sites whose cells share a side, length (k,) of these sides inside the domain;
    dual: the regular triangulation.
    """

    area: np.ndarray
    moment: np.ndarray
    second: np.ndarray
    edges: np.ndarray
    length: np.ndarray
    dual: Regular

    @property
    def centroid(self) -> np.ndarray:
        """Centroids of the cells, (n,2)."""
        return self.moment / self.area[:, None]

    def cost(self, sites: np.ndarray) -> float:
        """The transport cost, the integral of |x - y_i|^2 over all cells i of sites (n,2)."""
        return float((self.second - 2 * dot2(sites, self.moment) + dot2(sites, sites) * self.area).sum())

    def renumbered(self, order: np.ndarray) -> PowerDiagram:
        """The same cells with site k called order[k], (n,)."""
        place = np.argsort(order)
        area, moment, second = (values[place] for values in (self.area, self.moment, self.second))
        return PowerDiagram(area, moment, second, order[self.edges], self.length, self.dual.renumbered(order))


def power_diagram(sites: np.ndarray, weights: np.ndarray, domain: Domain, dual: Regular | None = None) -> PowerDiagram:
    """Power diagram of sites (n,2) with power weights (n,) inside the domain; hidden sites have area 0.

    `dual` is the regular triangulation of these sites and weights, if it is known already.

    The areas sum to the domain's area exactly, whatever the rounding of single vertices: every side is
    counted once for each of its two cells, and the arcs of the boundary telescope.

    Raises
    ------
    TransportError : the sites cannot be triangulated
    """
    n = len(sites)
    if dual is None:
        dual = by_hull(sites, weights)
    centre = power_centres(sites, weights, dual)
    inside = np.append(domain.contains(centre), False)
    once = np.flatnonzero(dual.twin < np.arange(len(dual.twin)))
    whole = inside[once // 3] & inside[dual.twin[once] // 3]
    sides = _whole_sides(sites, centre, dual, once[whole])
    cut, entering, leaving = _cut_sides(sites, weights, centre, inside, dual, once[~whole], domain)
    pairs, p, q, length = (np.concatenate(both) for both in zip(sides, cut, strict=True))

    integrals = np.zeros((4, n))
    _scatter(integrals, pairs[:, 0], pairs[:, 1], segment_integrals(p, q))
    # At a crossing of the boundary one cell's arc ends and its neighbour's begins.
    cut_pairs, cut_p, cut_q, _ = cut
    crossing = np.concatenate([cut_p[entering], cut_q[leaving]])
    ends = np.concatenate([cut_pairs[entering, 0], cut_pairs[leaving, 1]])
    begins = np.concatenate([cut_pairs[entering, 1], cut_pairs[leaving, 0]])
    arcs = np.zeros((4, n))
    if len(crossing):
        _scatter(arcs, ends, begins, domain.boundary_integrals(domain.boundary_parameter(crossing)))
        # Only the arc that runs through parameter 0 comes out negative.
        around = int(arcs[0].argmin())
    else:
        corner = domain.boundary_point(np.zeros(1))
        around = int((((sites - corner) ** 2).sum(axis=1) - weights).argmin())
    arcs[:, around] += domain.total_integrals()
    integrals += arcs
    return PowerDiagram(integrals[0] / 2, integrals[1:3].T, integrals[3], pairs, length, dual)


def _whole_sides(sites, centre, dual: Regular, h):
    """Sides of the halfedges h (k,) that end at the power centres to their right, p (k,2), and to their left, q (k,2).

    Returns the pairs of sites (k,2), p, q and the lengths (k,).
    """
    pairs = _pairs(dual, h)
    p, q = centre[dual.twin[h] // 3], centre[h // 3]
    apart = sites[pairs[:, 1]] - sites[pairs[:, 0]]
    length = cross2(apart, q - p) / np.sqrt(dot2(apart, apart))
    return pairs, p, q, np.maximum(length, 0)


def _cut_sides(sites, weights, centre, inside, dual: Regular, h, domain: Domain):
    """Sides that reach out of the domain, as `_whole_sides`, cut; which of them enter (k,), and which leave, (k,)."""
    pairs, left, right = _pairs(dual, h), h // 3, dual.twin[h] // 3
    i, j = pairs.T
    apart = sites[j] - sites[i]
    squared = dot2(apart, apart)
    share = 0.5 + (weights[i] - weights[j]) / (2 * squared)
    origin = sites[i] + share[:, None] * apart
    direction = np.stack([-apart[:, 1], apart[:, 0]], axis=1) / np.sqrt(squared)[:, None]
    t_left = dot2(centre[left] - origin, direction)
    t_right = np.where(right < 0, -np.inf, dot2(centre[right] - origin, direction))
    enter, leave = domain.clip(origin, direction)
    middle = (enter + leave) / 2
    entering, leaving = ~inside[right], ~inside[left]
    # A side with both ends outside may still pass through the domain.
    through = (enter < leave) & (t_right < middle) & (middle < t_left)
    keep = ~(entering & leaving) | through
    # Where rounding lets the line miss the domain next to an end inside, the side shrinks to that end.
    start = np.where(entering, np.minimum(enter, np.where(leaving, np.inf, t_left)), t_right)[keep]
    end = np.maximum(np.where(leaving, leave, t_left)[keep], start)
    p, q = (origin[keep] + t[:, None] * direction[keep] for t in (start, end))
    return (pairs[keep], p, q, end - start), entering[keep], leaving[keep]


def _pairs(dual: Regular, h: np.ndarray) -> np.ndarray:
    """Tails and heads of halfedges h (k,), (k,2)."""
    corners = dual.triangles.ravel()
    return np.stack([corners[h], corners[next_halfedge(h)]], axis=1)


def _scatter(target: np.ndarray, plus: np.ndarray, minus: np.ndarray, values: np.ndarray) -> None:
    n = target.shape[1]
    for row, value in zip(target, values, strict=True):
        row += np.bincount(plus, value, n) - np.bincount(minus, value, n)
