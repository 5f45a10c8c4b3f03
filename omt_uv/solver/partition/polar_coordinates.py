"""Geodesic polar coordinates around many sites at once, each within a window of its own.

A triangle whose corners a, b have known distances is unfolded next to a virtual source, and the third corner gets its
distance and its direction from there (Melvaer, Reimers 2012, section 3): exact wherever the surface unfolds. All
windows advance together until nothing gets nearer, so that there is no order of vertices to keep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from ..mesh.geometry import face_areas, halfedge_lengths
from ..mesh.topology import expand, graph_components, halfedges, split_fans
from .sites import Sites

# A distance is new when it is shorter by more than this share,
SHORTER = 1e-9
# and after it has been new so often, by so many times more each time: across slivers, two corners may shorten each
# other by less and less without an end.
OFTEN = 16
MORE = 4.0
# Rounds at most, of one ring of triangles each.
MOST_ROUNDS = 5000
# Width of a band of distances that advance together, in mean sides of the triangles.
BAND = 1.0


@dataclass(frozen=True)
class PolarCoordinates:
    """Windows of sites, as pairs of a site and a triangle, ordered by triangle.

    site (p,), face (p,); squared (p,3): squared geodesic distance of each corner; log (p,3,2): the corners as the site
    sees them, with their distances as lengths; nearest, farthest (p,): least and greatest
    of the squares; last (p,) bool: pairs where the window ends although the surface goes on
    """

    site: np.ndarray
    face: np.ndarray
    squared: np.ndarray
    log: np.ndarray
    nearest: np.ndarray
    farthest: np.ndarray
    last: np.ndarray

    def chosen(self, rows: np.ndarray) -> PolarCoordinates:
        """Those of some rows, (r,) or (p,) bool."""
        return PolarCoordinates(**{name: values[rows] for name, values in vars(self).items()})

    def joined(self, other: PolarCoordinates, without: np.ndarray) -> PolarCoordinates:
        """These but those of some sites (k,), and another's instead."""
        there = np.zeros(int(max(self.site.max(), other.site.max())) + 1, bool)
        there[without] = True
        keep = ~there[self.site]
        mine, its = vars(self.chosen(keep)), vars(other)
        return _by_face(PolarCoordinates(**{name: np.concatenate([mine[name], its[name]]) for name in mine}))


class WindowMesh:
    """What the windows of a mesh (n,3), (m,3) share: parts, sides, layouts of the triangles, faces around vertices."""

    def __init__(self, positions: np.ndarray, triangles: np.ndarray):
        # No way leads through a single vertex: cells that passed there would fall into pieces.
        triangles, vertex = split_fans(triangles, len(positions))
        positions = positions[vertex]
        self.positions, self.triangles = positions, triangles
        n, m = len(positions), len(triangles)
        self.tree = cKDTree(positions)
        self.part = graph_components(*halfedges(triangles), n)[1]
        incidence = csr_matrix((np.ones(3 * m, bool), (triangles.ravel(), np.repeat(np.arange(m), 3))), shape=(n, m))
        self.first, self.around = incidence.indptr.astype(np.int64), incidence.indices.astype(np.int64)
        self.degree = np.diff(self.first)
        self.areas = face_areas(positions, triangles)
        side = halfedge_lengths(positions, triangles).reshape(-1, 3)
        # Side k runs from corner k to the next one; seen from corner k, sides k and k + 2 start there.
        base, self.to_a, to_b = side[:, [1, 2, 0]], side, side[:, [2, 0, 1]]
        with np.errstate(divide="ignore", invalid="ignore"):
            x = (self.to_a**2 - to_b**2 + base**2) / (2 * base)
        x = np.where(np.isfinite(x), x, 0)
        y = np.sqrt(np.maximum(self.to_a**2 - x**2, 0))
        # A row for each corner: the side opposite, the corner above it, and its distances from both ends.
        self.layout = np.stack([base, x, y, self.to_a, to_b], axis=2).reshape(-1, 5)
        # Corners in the plane: 0 at the origin, 1 on the axis.
        flat = np.zeros((m, 3, 2))
        flat[:, 1, 0] = side[:, 0]
        flat[:, 2, 0], flat[:, 2, 1] = x[:, 2], y[:, 2]
        self.flat = flat


def polar_coordinates(mesh: WindowMesh, sites: Sites, radius: np.ndarray, chosen: np.ndarray) -> PolarCoordinates:
    """Distances and directions around the chosen (k,) of the sites, on the triangles within `radius` (k,) of them.

    Triangles belong to a window when a corner of theirs lies within the radius, in space, and can be reached within it.
    """
    window = _window(mesh, sites, radius, chosen)
    n = len(mesh.positions)
    distance, log = np.full(len(window.entries), np.inf), np.zeros((len(window.entries), 2))
    start = np.flatnonzero(sites.triangle[chosen[window.site]] == window.face)
    flat = mesh.flat[window.face[start]]
    source = np.einsum("kc,kcd->kd", sites.barycentric[chosen[window.site[start]]], flat)
    log[window.where[start]] = flat - source[:, None]
    distance[window.where[start]] = np.linalg.norm(flat - source[:, None], axis=2)
    # The corners of a site's own triangle always go on.
    limit = np.maximum(radius, mesh.to_a[sites.triangle[chosen]].max(axis=1))[window.entries // n]
    _propagate(mesh, window, distance, log, limit)
    a, b, c = np.isfinite(distance)[window.where].T
    reached = a & b & c
    where = window.where[reached]
    inside = np.bincount(where.ravel(), minlength=len(window.entries))
    ends = (inside < mesh.degree[window.entries % n])[where]
    last = ends[:, 0] | ends[:, 1] | ends[:, 2]
    site = chosen[window.site[reached]]
    squared = distance[where] ** 2
    a, b, c = squared.T
    nearest, farthest = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return _by_face(PolarCoordinates(site, window.face[reached], squared, log[where], nearest, farthest, last))


def _by_face(pairs: PolarCoordinates) -> PolarCoordinates:
    return pairs.chosen(np.argsort(pairs.face * (int(pairs.site.max()) + 1) + pairs.site))


@dataclass(frozen=True)
class Window:
    """Pairs of a row of the sites (p,) and a triangle (p,) near them; entries (e,) are pairs of a row and a vertex, as
    row * n + vertex, and where (p,3) the entries of the corners."""

    site: np.ndarray
    face: np.ndarray
    entries: np.ndarray
    where: np.ndarray


def _window(mesh: WindowMesh, sites: Sites, radius: np.ndarray, chosen: np.ndarray) -> Window:
    """The triangles with a corner near each of the chosen sites (k,)."""
    m, n = len(mesh.triangles), len(mesh.positions)
    own = sites.triangle[chosen]
    centre = np.einsum("kc,kcd->kd", sites.barycentric[chosen], mesh.positions[mesh.triangles[own]])
    balls = mesh.tree.query_ball_point(centre, radius, return_sorted=False)
    size = np.array([len(ball) for ball in balls], dtype=np.int64)
    vertex = np.concatenate([np.asarray(ball, dtype=np.int64) for ball in balls])
    holder = np.repeat(np.arange(len(chosen)), size)
    # What lies near in space may be another part, of any number of triangles, which no way leads to.
    same = mesh.part[vertex] == mesh.part[mesh.triangles[own, 0]][holder]
    vertex, holder = vertex[same], holder[same]
    row, place = expand(mesh.degree[vertex])
    face = mesh.around[mesh.first[vertex][row] + place]
    key = holder[row] * m + face
    key = np.unique(np.concatenate([key, np.arange(len(chosen)) * m + own]))
    site, face = key // m, key % m
    entries, where = np.unique(site[:, None] * n + mesh.triangles[face], return_inverse=True)
    return Window(site, face, entries, where.reshape(-1, 3))


def _propagate(mesh: WindowMesh, window: Window, distance: np.ndarray, log: np.ndarray, limit: np.ndarray) -> None:
    """Shorten distances (e,) and turn their directions (e,2) until no triangle of any window shortens one.

    What is nearest goes first, in bands of one edge's length, of every window by itself: fine triangles of one hold up
    no other. Beyond its limit (e,) nothing goes on.
    """
    where = window.where
    order = np.argsort(where.ravel(), kind="stable")
    first = np.searchsorted(where.ravel()[order], np.arange(len(distance) + 1))
    count = np.diff(first)
    side = np.bincount(window.site, mesh.to_a[window.face].mean(axis=1)) / np.bincount(window.site)
    row = window.entries // len(mesh.positions)
    width = BAND * side[row]
    new = np.isfinite(distance) & (distance <= limit)
    gain = np.full(len(distance), SHORTER / MORE**OFTEN)
    # What waits to go on: all of `new`, and nothing else, as rounds are many and each is small.
    waiting = np.flatnonzero(new)
    for _ in range(MOST_ROUNDS):
        if not len(waiting):
            return
        level, site = distance[waiting] / width[waiting], row[waiting]
        least = np.full(len(side), np.inf)
        np.minimum.at(least, site, level)
        ahead = level <= least[site] + 1
        ready, waiting = waiting[ahead], waiting[~ahead]
        new[ready] = False
        at = _spread_from(mesh, window, ready, (order, first, count), distance, log, gain)
        gain[at] *= MORE
        at = np.unique(at[~new[at] & (distance[at] <= limit[at])])
        new[at] = True
        waiting = np.concatenate([waiting, at])


def _spread_from(
    mesh: WindowMesh,
    window: Window,
    ready: np.ndarray,
    corners: tuple[np.ndarray, np.ndarray, np.ndarray],
    distance: np.ndarray,
    log: np.ndarray,
    gain: np.ndarray,
) -> np.ndarray:
    """Entries (k,) that come nearer by a share of more than their `gain` (e,), seen from those that are ready (r,).

    corners : those of each entry, ordered by entry (3 p,), where its own begin (e + 1,), and how many they are (e,)
    """
    order, first, count = corners
    row, place = expand(count[ready])
    halfedge = order[first[ready][row] + place]
    # Seen from its triangle, the corner that is ready is the first end for one of the others, and the second one.
    turn = np.repeat([1, 2], len(halfedge))
    at, values, places = _unfolded(mesh, window, np.tile(halfedge, 2), turn, distance, log, gain)
    np.minimum.at(distance, at, values)
    least = values == distance[at]
    log[at[least]] = places[least]
    return at


def _unfolded(
    mesh: WindowMesh,
    window: Window,
    halfedge: np.ndarray,
    turn: np.ndarray,
    distance: np.ndarray,
    log: np.ndarray,
    gain: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What corners of triangles get nearer by: entries (k,), their distances (k,) and places (k,2).

    halfedge : corners that are known (h,), 3 p + k of the pair p; the corner `turn` (h,) after them is looked for, and
    the third one helps. With a = (0, 0), b = (c, 0) and the corner at (x, y), y > 0, the source lies at (u, -v).
    """
    pair, known = halfedge // 3, halfedge % 3
    corner = (known + turn) % 3
    at = window.where[pair, corner]
    a, b = window.where[pair, (corner + 1) % 3], window.where[pair, (corner + 2) % 3]
    # Of the other two, the nearer one may be old, and the new one farther than the corner itself.
    ahead = np.minimum(distance[a], distance[b]) < distance[at]
    pair, corner, at, a, b = pair[ahead], corner[ahead], at[ahead], a[ahead], b[ahead]
    da, db = distance[a], distance[b]
    row = 3 * window.face[pair] + corner
    c, x, y, to_a, to_b = mesh.layout[row].T
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (da**2 - db**2 + c**2) / (2 * c)
        v = np.sqrt(da**2 - u**2)
        crossing = u + (x - u) * v / (v + y)
        straight = (crossing >= 0) & (crossing <= c) & (v > 0)
        along = np.minimum(da + to_a, db + to_b)
        found = np.where(straight, np.sqrt((x - u) ** 2 + (y + v) ** 2), along)
        better = found < distance[at] * (1 - np.maximum(gain[at], SHORTER))
        at, a, b, found, straight = at[better], a[better], b[better], found[better], straight[better]
        c, x, y, u, v, da, db = (k[better] for k in (c, x, y, u, v, da, db))
        # The corner as a combination of a and b, all seen from the source; the surface's directions combine alike.
        beta = ((x - u) * v + u * (y + v)) / (v * c)
        alpha = (y + v) / v - beta
        by_a = (da + to_a[better] <= db + to_b[better]).astype(float)
        alpha, beta = np.where(straight, alpha, by_a), np.where(straight, beta, 1 - by_a)
    seen = np.where(alpha != 0, alpha, 0)[:, None] * log[a] + np.where(beta != 0, beta, 0)[:, None] * log[b]
    size = np.sqrt(seen[:, 0] ** 2 + seen[:, 1] ** 2)
    seen *= (found / np.where(size > 0, size, 1))[:, None]
    return at, found, seen
