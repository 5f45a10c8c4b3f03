"""Triangulate weighted sites regularly, by one convex hull, or by flips where only the weights changed.

The regular triangulation is the lower convex hull of the lifted points (y, |y|^2 - h) (Aurenhammer 1987); flips that
come to an end prove it (Edelsbrunner, Shah 1996).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..errors import TransportError
from ..mesh.edge_flips import flip_in_place, flip_until_none
from ..mesh.geometry import as_complex, dot2, in_parts
from ..mesh.topology import previous_halfedge, twins

# A facet this steep (third component of its normal) stands on the boundary of the hull; its power centre is far out of
# any domain.
STEEP = 1e-9
# Edges flip only where the lifted point is below the plane by more than rounding can explain.
ROUNDING = 1e-14
MAX_ROUNDS = 200  # of flips


@dataclass(frozen=True)
class RegularTriangulation:
    """A regular triangulation.

    Attributes
    ----------
    triangles : (k,3) sites, counter-clockwise
    twin : (3k,) halfedges, -1 on the hull
    whole : the triangles fill the convex hull of all sites, so that edges which are regular one by one prove that the
        triangulation is. Not so where sites lie on a straight boundary, or are hidden
    flips : of edges that led here
    """

    triangles: np.ndarray
    twin: np.ndarray
    whole: bool
    flips: int = 0

    def renumbered(self, order: np.ndarray) -> RegularTriangulation:
        """The same triangles with site k called order[k], (n,)."""
        return replace(self, triangles=order[self.triangles])


def by_hull(sites: np.ndarray, site_weights: np.ndarray) -> RegularTriangulation:
    """Regular triangulation of sites (n,2) with weights (n,); sites above the hull are in no triangle.

    Raises TransportError for fewer than three sites, sites on one line, and sites that coincide.
    """
    # The hull of three lifted points is flat; a fourth far above closes it from the upper side.
    lifted = np.column_stack([sites, dot2(sites, sites) - site_weights])
    spread = max(np.ptp(lifted[:, 2]), np.ptp(sites, axis=0).max(), 1e-300)
    above = np.append(sites.mean(axis=0), lifted[:, 2].max() + spread)
    try:
        hull = ConvexHull(np.vstack([lifted, above]), qhull_options="Qt Q12")
    except (QhullError, ValueError) as error:
        raise TransportError("The sites of the transport lie on one line or coincide") from error
    triangles, slope = hull.simplices.astype(np.int64), hull.equations[:, 2]
    of_sites = triangles.max(axis=1) < len(sites)
    whole = not (np.abs(slope[of_sites]) <= STEEP).any()
    triangles = triangles[(slope < -STEEP) & of_sites]
    # Triangles are neighbours in memory where their sites are.
    triangles = triangles[np.argsort(triangles.min(axis=1), kind="stable")]
    a, b, c = as_complex(sites)[triangles.T]
    turned = ((b - a).conj() * (c - a)).imag < 0
    triangles[turned] = triangles[turned][:, [0, 2, 1]]
    whole = whole and len(np.unique(triangles)) == len(sites)
    return RegularTriangulation(triangles, twins(triangles), whole)


def by_flips(
    start: RegularTriangulation, sites: np.ndarray, site_weights: np.ndarray
) -> tuple[RegularTriangulation | None, bool]:
    """Repair a triangulation of all sites after their weights changed.

    Returns the regular triangulation, or None where flips alone do not reach it, and whether a site is certainly
    hidden: it has three neighbours and lies above their plane.
    """
    z, triangles, twin = as_complex(sites), start.triangles.copy(), start.twin.copy()
    flat = triangles.reshape(-1)

    waiting = [np.zeros(0, np.int64)]

    def violation(edges):
        below, convex = _below(z, site_weights, flat, edges, twin[edges])
        waiting.append(edges[(below < 0) & ~convex])
        return np.where(convex, below, 0.0)

    def flip(edges):
        flip_in_place(triangles, twin, edges)

    flips, settled = flip_until_none(twin, violation, flip, MAX_ROUNDS, _backward(z, site_weights, start))
    # Edges that are not regular and could not flip; a flip next to them may have helped since.
    edges = np.unique(np.concatenate(waiting))
    edges = edges[twin[edges] >= 0]
    below, _ = _below(z, site_weights, flat, edges, twin[edges])
    stuck = edges[below < 0]
    if settled and len(stuck) == 0:
        return RegularTriangulation(triangles=triangles, twin=twin, whole=start.whole, flips=flips), False
    degree = np.bincount(flat, minlength=len(sites))
    on_hull = np.zeros(len(sites), dtype=bool)
    on_hull[flat[twin < 0]] = True
    ends = np.concatenate([flat[stuck], flat[twin[stuck]]])
    return None, bool(((degree[ends] == 3) & ~on_hull[ends]).any())


def power_centres(z: np.ndarray, site_weights: np.ndarray, dual: RegularTriangulation) -> np.ndarray:
    """Point of equal power of each triangle, (k,) complex, of sites z (n,) complex with weights (n,)."""
    return np.concatenate([_power_centres(z, site_weights, *corners.T) for (corners,) in in_parts(dual.triangles)])


def _power_centres(z, site_weights, i, j, k) -> np.ndarray:
    # Relative to the first corner, so that clusters keep precision.
    a, base = z[i], site_weights[i]
    b, c = z[j] - a, z[k] - a
    rb = (b * b.conj()).real - site_weights[j] + base
    rc = (c * c.conj()).real - site_weights[k] + base
    twice = 2 * (b.conj() * c).imag
    twice = np.where(np.abs(twice) > 1e-300, twice, 1e-300)
    return a - 1j * (rb * c - rc * b) / twice


def _backward(z, site_weights, start: RegularTriangulation) -> np.ndarray:
    """The edges whose side between two cells runs backwards, as one of each pair of halfedges: those that may flip."""
    centre, tail = power_centres(z, site_weights, start), start.triangles.ravel()
    found, edges = [], np.flatnonzero(start.twin > np.arange(len(start.twin)))
    for h, g in in_parts(edges, start.twin[edges]):
        apart, side = z[tail[g]] - z[tail[h]], centre[h // 3] - centre[g // 3]
        found.append(h[(apart.conj() * side).imag <= 0])
    return np.concatenate(found)


def _below(z, site_weights, flat, h, g) -> tuple[np.ndarray, np.ndarray]:
    """How far the far corner of g lies below the lifted triangle of h, negative when it does, else 0; flip possible?"""
    i, j, k, far = flat[h], flat[g], flat[previous_halfedge(h)], flat[previous_halfedge(g)]
    origin, base = z[far], site_weights[far]
    a, b, c = z[i] - origin, z[j] - origin, z[k] - origin
    za, zb, zc = ((x * x.conj()).real - site_weights[v] + base for x, v in ((a, i), (b, j), (c, k)))
    bc, ca, ab = ((x.conj() * y).imag for x, y in ((b, c), (c, a), (a, b)))
    terms = za * bc, zb * ca, zc * ab
    determinant = sum(terms)
    size = sum(np.abs(term) for term in terms)
    convex = (bc > 0) & (ca > 0)
    return np.where(determinant > ROUNDING * size, -determinant / np.maximum(size, 1e-300), 0.0), convex
