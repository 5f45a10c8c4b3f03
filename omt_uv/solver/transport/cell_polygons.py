"""The cells of power diagrams, plane and sphere, as polygons to be drawn or written (Zhao et al. 2013, figure 4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import as_complex, as_points, cross3, lengths
from ..mesh.spherical_geometry import normalized
from .convex_domain import ConvexPolygon, Domain
from .regular_triangulation import by_hull, power_centres
from .spherical_power_diagram import Hull, facet_normals

# Sites this far away, in radii of the domain, close the cells around it.
FAR = 30.0
GUARDS = 8
# Points of the boundary of a disk that its cells have beside the ends of their sides.
AROUND = 720
# Points of a cell nearer than this, of the domain's radius, are one.
SAME = 1e-9


@dataclass(frozen=True)
class CellPolygons:
    """Convex polygons of n cells: points (k,d) counter-clockwise, one cell after the other; start (n+1,)."""

    points: np.ndarray
    start: np.ndarray

    @property
    def owner(self) -> np.ndarray:
        """The cell (k,) of every point."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))

    def areas(self) -> np.ndarray:
        """Areas (n,) of flat polygons, those of their points."""
        k = len(self.points)
        following = np.arange(1, k + 1)
        last = self.start[1:] - 1
        full = np.diff(self.start) > 0
        following[last[full]] = self.start[:-1][full]
        a, b = self.points, self.points[following]
        return np.bincount(self.owner, 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), len(self.start) - 1)

    def fans(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (t,3) of the points that fill the cells, and the cell (t,) of each."""
        inner = np.arange(len(self.points))
        first = self.start[:-1][self.owner]
        inner = inner[(inner > first) & (inner + 1 < self.start[1:][self.owner])]
        return np.stack([self.start[:-1][self.owner[inner]], inner, inner + 1], axis=1), self.owner[inner]


def planar_cells(sites: np.ndarray, site_weights: np.ndarray, domain: Domain) -> CellPolygons:
    """Cells of sites (n,2) with site weights (n,) in a convex domain; those of hidden sites are empty.

    >>> from .convex_domain import Rectangle
    >>> cells = planar_cells(np.array([[-0.25, 0], [0.25, 0]]), np.zeros(2), Rectangle())
    >>> cells.areas().round(6).tolist()
    [0.5, 0.5]

    Raises
    ------
    TransportError : the sites cannot be triangulated
    """
    n, radius = len(sites), float(np.abs(as_complex(domain.boundary_point(np.linspace(0, domain.period, 64)))).max())
    turn = 2 * np.pi * np.arange(GUARDS) / GUARDS
    guards = FAR * radius * np.column_stack([np.cos(turn), np.sin(turn)])
    z = as_complex(np.concatenate([sites, guards]))
    # Guards that weigh little stay away, whatever the weights of sites.
    weights = np.concatenate([site_weights, np.full(GUARDS, float(site_weights.min()))])
    dual = by_hull(as_points(z), weights)
    centre = power_centres(z, weights, dual)
    edge = np.flatnonzero(dual.twin >= 0)
    edge = edge[dual.triangles.ravel()[edge] < n]
    p, q = as_points(centre[edge // 3]), as_points(centre[dual.twin[edge] // 3])
    length = np.maximum(lengths(q - p), 1e-300)
    way = (q - p) / length[:, None]
    enter, leave = domain.clip(p, way)
    begin, end = np.maximum(enter, 0), np.minimum(leave, length)
    kept = begin <= end
    owner = dual.triangles.ravel()[edge[kept]]
    ends = [p[kept] + t[kept, None] * way[kept] for t in (begin, end)]
    around = _boundary(domain)
    cost = (np.abs(as_complex(around)[:, None] - z[None, :n]) ** 2 - site_weights).argmin(axis=1)
    points = np.concatenate([*ends, around])
    middle = sites if len(sites) == 1 else _means(points, np.concatenate([owner, owner, cost]), n)
    return _sorted(points, np.concatenate([owner, owner, cost]), middle, SAME * radius)


def spherical_cell_polygons(sites: np.ndarray, site_weights: np.ndarray, hull: Hull) -> CellPolygons:
    """Cells of unit vectors (n,3) with site weights (n,) on the sphere, whose weighted convex hull is given."""
    normal = np.repeat(facet_normals(sites, site_weights, hull.triangles), 3, axis=0)
    owner = hull.triangles.ravel()
    middle = normalized(_means(normal, owner, len(sites)))
    x = cross3(middle, np.eye(3)[np.abs(middle).argmin(axis=1)])
    x /= lengths(x)[..., None]
    y = cross3(middle, x)
    angle = np.arctan2((normal * y[owner]).sum(axis=1), (normal * x[owner]).sum(axis=1))
    order = np.lexsort((angle, owner))
    return CellPolygons(normal[order], _starts(owner, len(sites)))


def _boundary(domain: Domain) -> np.ndarray:
    """Points (k,2) of the boundary that cells have as corners: those of a polygon, many of a circle."""
    if isinstance(domain, ConvexPolygon):
        return domain.corners
    return domain.boundary_point(domain.period * np.arange(AROUND) / AROUND)


def _means(points: np.ndarray, owner: np.ndarray, n: int) -> np.ndarray:
    """Means (n,d) of the points (k,d) of each owner (k,)."""
    count = np.maximum(np.bincount(owner, minlength=n), 1)
    return np.stack([np.bincount(owner, x, n) / count for x in points.T], axis=1)


def _starts(owner: np.ndarray, n: int) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=n))])


def _sorted(points: np.ndarray, owner: np.ndarray, middle: np.ndarray, same: float) -> CellPolygons:
    """Points (k,2) of cells in the order of their angles about the middles (n,2) of their cells, equal ones once."""
    away = points - middle[owner]
    order = np.lexsort((np.arctan2(away[:, 1], away[:, 0]), owner))
    points, owner = points[order], owner[order]
    start = _starts(owner, len(middle))
    before = np.arange(len(points)) - 1
    first = start[:-1][np.diff(start) > 0]
    before[first] = start[1:][np.diff(start) > 0] - 1
    apart = lengths(points - points[before]) > same
    return CellPolygons(points[apart], _starts(owner[apart], len(middle)))
