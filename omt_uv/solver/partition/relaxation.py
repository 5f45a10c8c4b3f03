"""Move sites to the means of their cells, as they see them in geodesic polar coordinates, and apart."""

from __future__ import annotations

import numpy as np

from ..mesh.topology import expand
from .cells import GeodesicCells
from .polar_coordinates import PolarCoordinates, WindowMesh, polar_coordinates
from .sites import Sites, inner

# Sites nearer than this share of the mean are pushed apart, by so much of what is missing, so often at most.
LEAST = 0.8
PUSH = 0.6
MOST_PUSHES = 12


def spaced(mesh: WindowMesh, sites: Sites, pairs: PolarCoordinates, size: np.ndarray, radius: np.ndarray):
    """The sites, pushed apart where two are much nearer than others are, and their pairs.

    Where a limb is thinner than a cell, the mean of a cell may lie on its far side, next to another site.

    size (k,): radius of a round cell at each site; radius (k,): of the windows
    """
    for _ in range(MOST_PUSHES):
        i, j, place, distance = sights(mesh, sites, pairs)
        near = distance / (size[i] + size[j])
        least = np.full(len(size), np.inf)
        np.minimum.at(least, i, near)
        usual = least[np.isfinite(least)]
        if not len(usual):
            break
        short = LEAST * usual.mean() - near
        rows = np.flatnonzero(short > 0)
        if not len(rows):
            break
        i, place = i[rows], place[rows]
        away = -place / np.maximum(np.hypot(place[:, 0], place[:, 1]), 1e-300)[:, None]
        step = PUSH * short[rows] * (size[i] + size[j[rows]])
        moved = np.unique(i)
        goal = np.stack([np.bincount(i, step * x, len(size)) for x in away.T], axis=1)
        sites = _placed(sites, pairs.chosen(np.isin(pairs.site, moved)), goal)
        pairs = pairs.joined(polar_coordinates(mesh, sites, radius[moved], moved), moved)
    return sites, pairs


def sights(
    mesh: WindowMesh, sites: Sites, pairs: PolarCoordinates
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Which site i (r,) sees which other one j (r,), where (r,2), and how far (r,)."""
    order = np.argsort(sites.triangle, kind="stable")
    own = sites.triangle[order]
    begin, end = np.searchsorted(own, pairs.face, side="left"), np.searchsorted(own, pairs.face, side="right")
    row, place = expand(end - begin)
    other = order[begin[row] + place]
    different = other != pairs.site[row]
    row, other = row[different], other[different]
    a, b, c = share = sites.barycentric[other].T
    seen = np.einsum("ck,kcd->kd", share, pairs.log[row])
    # As if the triangle were flat: directions may jump within it, where two ways are equally short.
    ab, bc, ca = mesh.to_a[pairs.face[row]].T ** 2
    squared = np.einsum("ck,kc->k", share, pairs.squared[row]) - a * b * ab - b * c * bc - c * a * ca
    return pairs.site[row], other, seen, np.sqrt(np.maximum(squared, 0))


def karcher_means(sites: Sites, pairs: PolarCoordinates, cells: GeodesicCells) -> Sites:
    """The sites (k,), each at the mean of its cell as it sees it: one step of Newton's method for the Karcher mean."""
    n = len(sites.triangle)
    _, centre = cells.polygons.moments()
    s, t = centre.T
    corner = pairs.log[cells.pair]
    seen = s[:, None] * corner[:, 0] + t[:, None] * corner[:, 1] + (1 - s - t)[:, None] * corner[:, 2]
    owner = pairs.site[cells.pair]
    mean = np.stack([np.bincount(owner, cells.part * x, n) for x in seen.T], axis=1) / cells.area[:, None]
    return _placed(sites, pairs, mean)


def _placed(sites: Sites, pairs: PolarCoordinates, place: np.ndarray) -> Sites:
    """The points of the surface that sites (k,) see at the places (k,2); a site stays where it sees none."""
    a, b, c = (pairs.log[:, k] - place[pairs.site] for k in range(3))
    areas = [u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] for u, v in ((b, c), (c, a), (a, b))]
    total = areas[0] + areas[1] + areas[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        barycentric = np.stack(areas, axis=1) / total[:, None]
    depth = np.where(np.isfinite(barycentric).all(axis=1), barycentric.min(axis=1), -np.inf)
    # Of several places that look alike from there, the nearest.
    rank = np.where(depth >= -1e-6, 1 / (1 + pairs.squared.min(axis=1)), depth - 1)
    order = np.lexsort((rank, pairs.site))
    last = np.r_[np.flatnonzero(np.diff(pairs.site[order])), len(order) - 1]
    best = order[last]
    owner = pairs.site[best]
    good = depth[best] > -0.1
    triangle, where = sites.triangle.copy(), sites.barycentric.copy()
    triangle[owner[good]] = pairs.face[best[good]]
    where[owner[good]] = inner(barycentric[best[good]])
    return Sites(triangle, where)
