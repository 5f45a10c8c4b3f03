"""Power diagrams clipped to a convex domain: areas, moments and dual edges, all cells at once.

The cell of site i is where |x - y_i|^2 - w_i is least (Aurenhammer 1987). The dual is the regular triangulation of
`regular.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .domain import Domain, segment_integrals
from .geometry import cross2, dot2
from .regular import Regular, by_hull
from .topology import halfedges


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
    edge = _dual_edges(sites, weights, dual)
    centre_inside = np.append(domain.contains(edge.centre), False)
    right_inside, left_inside = centre_inside[edge.right], centre_inside[edge.left]
    enter, leave = domain.clip(edge.origin, edge.direction)
    middle = (enter + leave) / 2
    # A side with both ends outside may still pass through the domain.
    through = ~right_inside & ~left_inside & (enter < leave) & (edge.t_right < middle) & (middle < edge.t_left)
    keep = np.flatnonzero(right_inside | left_inside | through)
    entering, leaving = ~right_inside[keep], ~left_inside[keep]
    # Where rounding lets the line miss the domain next to an end inside, the side shrinks to that end.
    low, high = edge.t_right[keep], edge.t_left[keep]
    start = np.where(entering, np.minimum(enter[keep], np.where(leaving, np.inf, high)), low)
    end = np.where(leaving, np.maximum(leave[keep], start), high)
    origin, direction, pairs = edge.origin[keep], edge.direction[keep], edge.pairs[keep]
    p, q = origin + start[:, None] * direction, origin + end[:, None] * direction

    integrals = np.zeros((4, n))
    _scatter(integrals, pairs[:, 0], pairs[:, 1], segment_integrals(p, q))
    # At a crossing of the boundary one cell's arc ends and its neighbour's begins.
    crossing = np.concatenate([p[entering], q[leaving]])
    ends = np.concatenate([pairs[entering, 0], pairs[leaving, 1]])
    begins = np.concatenate([pairs[entering, 1], pairs[leaving, 0]])
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
    return PowerDiagram(integrals[0] / 2, integrals[1:3].T, integrals[3], pairs, np.maximum(end - start, 0), dual)


@dataclass(frozen=True)
class _DualEdges:
    """Sides between cells as pieces t_right < t < t_left of their lines; left, right index centres, -1 far away."""

    pairs: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    left: np.ndarray
    right: np.ndarray
    t_left: np.ndarray
    t_right: np.ndarray
    centre: np.ndarray


def _dual_edges(sites, weights, dual: Regular) -> _DualEdges:
    centre = _power_centres(sites, weights, dual.triangles)
    tail, head = halfedges(dual.triangles)
    inner = np.flatnonzero(dual.twin > np.arange(len(dual.twin)))
    rim = np.flatnonzero(dual.twin < 0)
    h = np.concatenate([inner, rim])
    left = h // 3
    right = np.concatenate([dual.twin[inner] // 3, np.full(len(rim), -1)])
    i, j = tail[h], head[h]
    apart = sites[j] - sites[i]
    squared = dot2(apart, apart)
    share = 0.5 + (weights[i] - weights[j]) / (2 * squared)
    origin = sites[i] + share[:, None] * apart
    direction = np.stack([-apart[:, 1], apart[:, 0]], axis=1) / np.sqrt(squared)[:, None]
    t_left = dot2(centre[left] - origin, direction)
    t_right = dot2(centre[right] - origin, direction)
    t_right[len(inner) :] = -np.inf
    return _DualEdges(np.stack([i, j], axis=1), origin, direction, left, right, t_left, t_right, centre)


def _power_centres(sites, weights, triangles) -> np.ndarray:
    """Point of equal power of each triangle, (k,2), relative to its first corner so that clusters keep precision."""
    a = sites[triangles[:, 0]]
    b, c = sites[triangles[:, 1]] - a, sites[triangles[:, 2]] - a
    rb = dot2(b, b) - weights[triangles[:, 1]] + weights[triangles[:, 0]]
    rc = dot2(c, c) - weights[triangles[:, 2]] + weights[triangles[:, 0]]
    twice = 2 * cross2(b, c)
    twice = np.where(np.abs(twice) > 1e-300, twice, 1e-300)
    return a + np.stack([rb * c[:, 1] - rc * b[:, 1], rc * b[:, 0] - rb * c[:, 0]], axis=1) / twice[:, None]


def _scatter(target: np.ndarray, plus: np.ndarray, minus: np.ndarray, values: np.ndarray) -> None:
    n = target.shape[1]
    for row, value in zip(target, values, strict=True):
        row += np.bincount(plus, value, n) - np.bincount(minus, value, n)
