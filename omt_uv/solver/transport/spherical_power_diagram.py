"""Divide the sphere into the cells of unit vectors with site weights, by a convex hull (Oliker 2007).

The cell of site y_i with weight h_i is {x : x . q_i >= x . q_j for all j}, q_i = exp(h_i) y_i: the outer normals of the
convex hull of all q at the corner q_i, a spherical polygon whose corners are the normals of the facets around q_i
(Aleksandrov's polyhedron; Cui, Qi, Wen, Lei, Li, Zhang, Gu 2019). The cost is -log cos of the distance.

Sites may lie so close together that their hull is lost to rounding. So a known hull is repaired by flips, and all
that matters is computed from differences: with d = y_j - y_i and s = exp(h_j - h_i), q_j - q_i over exp(h_i) has the
part s - 1 - s |d|^2 / 2 along y_i and the part s d, less its own along y_i, across.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..errors import TransportError
from ..mesh.edge_flips import flip_in_place, flip_until_none
from ..mesh.geometry import cross3, lengths
from ..mesh.spherical_geometry import normalized, triangle_areas, triple_products
from ..mesh.topology import halfedges, previous_halfedge, twins

# Edges flip only where the hull is hollow by more than rounding can explain.
ROUNDING = 1e-13
MAX_ROUNDS = 200  # of flips


@dataclass(frozen=True)
class Hull:
    """Triangles (2n-4,3) of the n sites, counter-clockwise seen from outside, and their twin halfedges."""

    triangles: np.ndarray
    twin: np.ndarray


@dataclass(frozen=True)
class SphericalCells:
    """Cells of n sites on the sphere.

    Attributes
    ----------
    area : (n,), summing to 4 pi
    moment : (n,3) integral of x over the cell
    edges : (e,2) pairs of neighbours
    conductance : (e,) derivative of the area of either by the site weight of the other, times -1
    hull : of the weighted sites
    """

    area: np.ndarray
    moment: np.ndarray
    edges: np.ndarray
    conductance: np.ndarray
    hull: Hull

    def centroids(self) -> np.ndarray:
        """Unit vectors (n,3) to the centroids of the cells."""
        return normalized(self.moment)


def spherical_cells(sites: np.ndarray, site_weights: np.ndarray, hull: Hull) -> SphericalCells:
    """Cells of unit vectors (n,3) with weights (n,), whose convex hull is given.

    Raises TransportError where sites coincide: facets on both sides of an edge then have no normals.
    """
    triangles = hull.triangles
    normal = facet_normals(sites, site_weights, triangles)
    tail, head = halfedges(triangles)
    # Around the tail, counter-clockwise, the facet to the right of a halfedge comes before its own.
    before, after = normal[hull.twin // 3], np.repeat(normal, 3, axis=0)
    n = len(sites)
    middle = normalized(_sum(tail, after, n))
    area = np.bincount(tail, triangle_areas(middle[tail], before, after), n)
    apart, along = lengths(after - before), lengths(after + before)
    if not along.all():
        lost = np.unique([tail[along == 0], head[along == 0]])
        raise TransportError("The sites of the transport coincide", kind="vertex", elements=lost)
    arc = 2 * np.arctan2(apart, along)
    moment = _sum(tail, 0.5 * arc[:, None] * normalized(cross3(before, after - before)), n)
    once = np.arange(len(tail)) < hull.twin
    i, j = tail[once], head[once]
    radial, across = _from(sites, site_weights, i, j)
    # The integral of x along an arc is tan(arc / 2) times the sum of its ends; lengths are in units of exp(h_i).
    integral = np.einsum("md,md->m", (before + after)[once], sites[i]) * apart[once] / along[once]
    conductance = np.maximum(integral, 0) / np.hypot(radial, lengths(across))
    return SphericalCells(area=area, moment=moment, edges=np.stack([i, j], axis=1), conductance=conductance, hull=hull)


def by_hull(sites: np.ndarray, site_weights: np.ndarray) -> Hull:
    """Convex hull of the weighted sites (n,3), (n,).

    Raises TransportError where sites coincide, are hidden, or leave half of the sphere empty.
    """
    points = sites * np.exp(site_weights - site_weights.max())[:, None]
    try:
        hull = ConvexHull(points, qhull_options="Qt Q12")
    except (QhullError, ValueError) as error:
        raise TransportError("The sites of the transport lie in one plane or coincide") from error
    if not (hull.equations[:, 3] < 0).all():
        raise TransportError("The sites of the transport leave half of the sphere empty")
    triangles = hull.simplices.astype(np.int64)
    p = points[triangles]
    inward = np.einsum("md,md->m", cross3(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    hidden = np.flatnonzero(np.bincount(triangles.ravel(), minlength=len(sites)) == 0)
    twin = twins(triangles)
    if len(hidden) or (twin < 0).any():
        raise TransportError("The sites of the transport coincide", kind="vertex", elements=hidden)
    return Hull(triangles, twin)


def by_flips(near: Hull, sites: np.ndarray, site_weights: np.ndarray) -> tuple[Hull | None, bool]:
    """Repair a hull of all sites after their weights changed.

    Returns the hull, or None where flips alone do not reach it, and whether a site is certainly hidden: it has three
    neighbours and lies below their plane.
    """
    triangles, twin = near.triangles.copy(), near.twin.copy()
    flat = triangles.reshape(-1)

    def violation(edges):
        hollow, possible = _hollow(sites, site_weights, flat, edges, twin[edges])
        return np.where(possible, -hollow, 0.0)

    flip_until_none(twin, violation, lambda edges: flip_in_place(triangles, twin, edges), MAX_ROUNDS)
    edges = np.flatnonzero(twin > np.arange(len(twin)))
    hollow, _ = _hollow(sites, site_weights, flat, edges, twin[edges])
    stuck = edges[hollow > 0]
    if len(stuck) == 0:
        return Hull(triangles, twin), False
    degree = np.bincount(flat, minlength=len(sites))
    return None, bool((degree[np.concatenate([flat[stuck], flat[twin[stuck]]])] == 3).any())


def _from(sites, site_weights, i, j) -> tuple[np.ndarray, np.ndarray]:
    """q_j - q_i (k,) in units of exp(h_i): its part along y_i, (k,), and across, (k,3)."""
    d = sites[j] - sites[i]
    change = site_weights[j] - site_weights[i]
    half = 0.5 * np.einsum("md,md->m", d, d)
    scale = np.exp(change)
    return np.expm1(change) - scale * half, scale[:, None] * (d + half[:, None] * sites[i])


def facet_normals(sites, site_weights, triangles) -> np.ndarray:
    """Unit outer normals (m,3) of the facets."""
    i, j, k = triangles.T
    (ra, a), (rb, b) = _from(sites, site_weights, i, j), _from(sites, site_weights, i, k)
    y = sites[i]
    normal = y * np.einsum("md,md->m", y, cross3(a, b))[:, None]
    return normalized(normal + ra[:, None] * cross3(y, b) + rb[:, None] * cross3(a, y))


def _hollow(sites, site_weights, flat, h, g) -> tuple[np.ndarray, np.ndarray]:
    """How far the far corner of g rises above the facet of h, (k,), 0 if not at all; and whether a flip is possible."""
    i, j, k, far = flat[h], flat[g], flat[previous_halfedge(h)], flat[previous_halfedge(g)]
    (ra, a), (rb, b), (rc, c) = (_from(sites, site_weights, i, x) for x in (j, k, far))
    y = sites[i]
    terms = np.stack([r * np.einsum("md,md->m", y, cross3(u, v)) for r, u, v in ((ra, b, c), (rb, c, a), (rc, a, b))])
    determinant, size = terms.sum(axis=0), np.abs(terms).sum(axis=0)
    possible = (triple_products(sites[i], sites[far], sites[k]) > 0) & (
        triple_products(sites[j], sites[k], sites[far]) > 0
    )
    return np.where(determinant > ROUNDING * size, determinant / np.maximum(size, 1e-300), 0.0), possible


def _sum(index: np.ndarray, vectors: np.ndarray, n: int) -> np.ndarray:
    return np.column_stack([np.bincount(index, vectors[:, k], n) for k in range(3)])
