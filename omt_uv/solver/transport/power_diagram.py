"""Clip a power diagram to a convex domain: areas, moments and dual edges of all cells at once (Aurenhammer 1987).

The cell of site y_i with site weight h_i is where |x - y_i|^2 - h_i is least. The dual is the regular triangulation
(`regular_triangulation`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import TransportError
from ..mesh.geometry import as_complex, as_points, dot2, in_parts
from ..mesh.topology import next_halfedge
from .convex_domain import Domain, segment_integrals
from .regular_triangulation import RegularTriangulation, by_hull, power_centres


@dataclass(frozen=True)
class PowerDiagram:
    """Cells of n sites in a domain.

    Attributes
    ----------
    area : (n,)
    moment : (n,2) integral of x over the cell
    second : (n,) integral of |x|^2
    edges : (k,2) pairs of sites whose cells share a side
    length : (k,) of these sides inside the domain
    dual : the regular triangulation
    """

    area: np.ndarray
    moment: np.ndarray
    second: np.ndarray
    edges: np.ndarray
    length: np.ndarray
    dual: RegularTriangulation

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
        return PowerDiagram(
            area=area,
            moment=moment,
            second=second,
            edges=order[self.edges],
            length=self.length,
            dual=self.dual.renumbered(order),
        )


def power_diagram(
    sites: np.ndarray, site_weights: np.ndarray, domain: Domain, dual: RegularTriangulation | None = None
) -> PowerDiagram:
    """Power diagram of sites (n,2) with site weights (n,) inside the domain; hidden sites have area 0.

    `dual` is the regular triangulation of these sites and weights, if it is known already.

    The areas sum to the domain's area exactly, whatever the rounding of single vertices: every side is
    counted once for each of its two cells, and the arcs of the boundary telescope.

    Raises
    ------
    TransportError : the sites cannot be triangulated, or coincide
    """
    if dual is None:
        dual = by_hull(sites, site_weights)
    z = as_complex(sites)
    centre = power_centres(z, site_weights, dual)
    inside = np.append(domain.contains(as_points(centre)), False)
    once = np.flatnonzero(dual.twin < np.arange(len(dual.twin)))
    whole = inside[once // 3] & inside[dual.twin[once] // 3]
    cut, p, q, entering, leaving = _cut_sides(z, site_weights, centre, inside, dual, once[~whole], domain)
    parts = [_whole_sides(z, centre, dual, h) for (h,) in in_parts(once[whole])]
    i, j, length, along = (np.concatenate(kind, axis=-1) for kind in zip(*parts, cut, strict=True))
    # At a crossing of the boundary one cell's arc ends and its neighbour's begins.
    a, b, *_ = cut
    ends, begins = np.concatenate([a[entering], b[leaving]]), np.concatenate([b[entering], a[leaving]])
    integrals = _arcs(z, site_weights, domain, np.concatenate([p[entering], q[leaving]]), ends, begins)
    _scatter(integrals, i, j, along)
    return PowerDiagram(
        area=integrals[0] / 2,
        moment=integrals[1:3].T,
        second=integrals[3],
        edges=np.stack([i, j], axis=1),
        length=length,
        dual=dual,
    )


def _arcs(z, site_weights, domain: Domain, crossing, ends, begins) -> np.ndarray:
    """The four integrals of every cell along the boundary, (4,n); which cells end and begin at the crossings (k,)."""
    arcs = np.zeros((4, len(z)))
    if len(crossing):
        _scatter(arcs, ends, begins, domain.boundary_integrals(domain.boundary_parameter(as_points(crossing))))
        # Only the arc that runs through parameter 0 comes out negative.
        around = int(arcs[0].argmin())
    else:
        corner = as_complex(domain.boundary_point(np.zeros(1)))
        around = int((np.abs(z - corner) ** 2 - site_weights).argmin())
    arcs[:, around] += domain.total_integrals()
    return arcs


def _whole_sides(z, centre, dual: RegularTriangulation, h) -> tuple[np.ndarray, ...]:
    """Sides of the halfedges h (k,) that end at power centres inside the domain, the one to their left last.

    Returns the sites i, j on both sides (k,), the lengths (k,), and the integrals along (4,k).
    """
    g, tail = dual.twin[h], dual.triangles.ravel()
    i, j, p, q = tail[h], tail[g], centre[g // 3], centre[h // 3]
    apart = z[j] - z[i]
    # By rounding a triangle of sites that nearly coincide is turned over, and shares an edge from a site to itself.
    if not apart.all():
        raise TransportError("Sites coincide")
    length = (apart.conj() * (q - p)).imag / np.sqrt((apart * apart.conj()).real)
    return i, j, np.maximum(length, 0), segment_integrals(as_points(p), as_points(q))


def _cut_sides(z, site_weights, centre, inside, dual: RegularTriangulation, h, domain: Domain):
    """Sides that reach out of the domain, cut, as `_whole_sides`.

    Also their ends p, q (k,) complex, and which of them enter (k,), and which leave, (k,).
    """
    tail, left, right = dual.triangles.ravel(), h // 3, dual.twin[h] // 3
    i, j = tail[h], tail[next_halfedge(h)]
    apart = z[j] - z[i]
    distance = np.abs(apart)
    origin = z[i] + (0.5 + (site_weights[i] - site_weights[j]) / (2 * distance**2)) * apart
    direction = 1j * apart / distance
    t_left = ((centre[left] - origin) * direction.conj()).real
    t_right = np.where(right < 0, -np.inf, ((centre[right] - origin) * direction.conj()).real)
    enter, leave = domain.clip(as_points(origin), as_points(direction))
    middle = (enter + leave) / 2
    entering, leaving = ~inside[right], ~inside[left]
    # A side with both ends outside may still pass through the domain.
    through = (enter < leave) & (t_right < middle) & (middle < t_left)
    # Where rounding lets the line miss the domain next to an end inside, the side shrinks to that end.
    start = np.where(entering, np.minimum(enter, np.where(leaving, np.inf, t_left)), t_right)
    end = np.maximum(np.where(leaving, leave, t_left), start)
    keep = np.flatnonzero(~(entering & leaving) | through)
    i, j, origin, direction, start, end = (x[keep] for x in (i, j, origin, direction, start, end))
    p, q = origin + start * direction, origin + end * direction
    along = segment_integrals(as_points(p), as_points(q))
    return (i, j, end - start, along), p, q, entering[keep], leaving[keep]


def _scatter(target: np.ndarray, plus: np.ndarray, minus: np.ndarray, values: np.ndarray) -> None:
    n = target.shape[1]
    for row, value in zip(target, values, strict=True):
        row += np.bincount(plus, value, n) - np.bincount(minus, value, n)
