"""Coarsen a surface of any topology, by independent half-edge collapses that keep it a manifold (Hoppe 1996).

Seams are searched where a log scale costs milliseconds: on about a thousand vertices. Every vertex that goes hands its
curvature and area to the one it collapses into, so that both keep their sums exactly (Gauss and Bonnet).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.geometry import angle_defects, angles_from_lengths, cross3, halfedge_lengths, vertex_areas
from ..mesh.topology import graph_components, halfedges, next_halfedge, previous_halfedge, twins

# Of the vertices that could go, those above this quantile of the cost wait for a later round.
QUANTILE = 0.6
# Collapses that turn a face by more than this cosine
TURNED = 0.2
# cost so many times as much.
TURNED_COST = 4.0
# A collapse that turns a face costs more by this times (1 - cosine): limbs keep more vertices for their area.
BENT_COST = 15.0
# Least shape that the cost of a vertex is divided by; 1 is equilateral.
LEAST_SHAPE = 1e-4
# Sum of two degrees beyond which every edge more adds the length of the collapsed edge once more to its price.
HIGH_DEGREE = 13
# Coarse surfaces of one fine one are the same until they have so many times their vertices.
COMMON = 4
# Rounds end when one removes a smaller share of the vertices.
LEAST_PROGRESS = 0.01


@dataclass(frozen=True)
class CoarseSurface:
    """A coarse surface.

    Attributes
    ----------
    kept (c,) : vertices of the fine surface
    positions (c,3), triangles (t,3) : of them
    curvature (c,) : angle defects of the fine surface, radians; 0 on the boundary
    area (c,) : of the fine surface, at each vertex, their sum is 1
    boundary (c,) bool : which are on a boundary
    size : square root of the area of the fine surface, in the units of the positions
    """

    kept: np.ndarray
    positions: np.ndarray
    triangles: np.ndarray
    curvature: np.ndarray
    area: np.ndarray
    boundary: np.ndarray
    size: float


@dataclass(frozen=True)
class Coarsening:
    """A surface on its way to several coarse ones, which differ by how they end.

    Attributes
    ----------
    positions (n,3) : of the fine surface; on_boundary (n,) bool : of its vertices
    kind (k,) : of vertices and of cones over boundaries, see `_ShrinkingMesh`
    faces (f,3), curvature (n,), area (n,), left : what is left of it, and of how many vertices that is
    """

    positions: np.ndarray
    on_boundary: np.ndarray
    kind: np.ndarray
    faces: np.ndarray
    curvature: np.ndarray
    area: np.ndarray
    left: int

    def towards(self, count: int, trial: int) -> Coarsening:
        """The same with about `count` vertices, where it has more."""
        n, curvature, area, left = len(self.positions), self.curvature.copy(), self.area.copy(), self.left
        mesh = _ShrinkingMesh(
            np.concatenate([self.positions, np.zeros((len(self.kind) - n, 3))]), self.faces, self.kind, n, trial
        )
        while left > count:
            vertex, parent = mesh.collapse(left - count)
            np.add.at(curvature, parent, curvature[vertex])
            np.add.at(area, parent, area[vertex])
            left -= len(vertex)
            if len(vertex) < LEAST_PROGRESS * left:
                break
        return replace(self, faces=mesh.faces, curvature=curvature, area=area, left=left)

    def ended(self, count: int, trial: int = 0) -> CoarseSurface:
        """A coarse surface of about `count` vertices, one of several by the number of the trial; a surface with fewer
        stays as it is."""
        end, n = self.towards(count, trial), len(self.positions)
        real = end.faces[(end.faces < n).all(axis=1)]
        kept = np.unique(real)
        place = np.full(n, -1)
        place[kept] = np.arange(len(kept))
        whole = end.area[kept].sum()
        return CoarseSurface(
            kept=kept,
            positions=self.positions[kept],
            triangles=place[real],
            curvature=end.curvature[kept],
            area=end.area[kept] / whole,
            boundary=self.on_boundary[kept],
            size=float(np.sqrt(whole)),
        )


def coarsening(positions: np.ndarray, triangles: np.ndarray, count: int, line: np.ndarray | None = None) -> Coarsening:
    """A surface (n,3), (m,3) with COMMON times as many vertices as coarse ones of `count` have, from which these go on:
    most of the time is gone by then, and where cuts may lie is not decided yet.

    line (n,) bool: vertices that collapse only among themselves, as those of a boundary do, so that lines stay lines
    """
    n = len(positions)
    tail, head = halfedges(triangles)
    border = np.flatnonzero(twins(triangles) < 0)
    on_boundary = np.zeros(n, dtype=bool)
    on_boundary[tail[border]] = True
    lengths = halfedge_lengths(positions, triangles).reshape(-1, 3)
    curvature = angle_defects(triangles, angles_from_lengths(lengths), np.flatnonzero(on_boundary), n)
    # A boundary is closed by a cone, so that every vertex is surrounded by faces.
    _, label = graph_components(tail[border], head[border], n)
    _, loop = np.unique(label[tail[border]], return_inverse=True)
    faces = np.concatenate([triangles, np.column_stack([head[border], tail[border], n + loop.ravel()])])
    kind = np.zeros(int(faces.max()) + 1 if len(border) else n, dtype=np.int64)
    if line is not None:
        kind[:n][line] = 1
    kind[:n][on_boundary] += 2
    kind[n:] = -1
    begun = Coarsening(positions, on_boundary, kind, faces, curvature, vertex_areas(positions, triangles), n)
    return begun.towards(COMMON * count, 0)


class _ShrinkingMesh:
    """A mesh while it becomes coarser: points, faces, and the kind of every vertex, which only goes to its like.

    Vertices from number n on are cones over boundaries, of kind -1.
    """

    def __init__(self, points: np.ndarray, faces: np.ndarray, kind: np.ndarray, n: int, trial: int):
        self.points, self.faces, self.kind, self.n = points, faces, kind, n
        self.round, self.trial = 0, trial

    def collapse(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Collapse an independent set of vertices, `most` at most: those that went (k,), and where to (k,)."""
        vertex, parent = self._choose()
        vertex, parent = vertex[:most], parent[:most]
        into = np.arange(len(self.points))
        into[vertex] = parent
        # The two faces beside a collapsed edge become lines, and go.
        faces = into[self.faces]
        a, b, c = faces.T
        self.faces = faces[(a != b) & (b != c) & (c != a)]
        self.round += 1
        return vertex, parent

    def _choose(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (k,) that may go together, cheapest first, and the neighbours (k,) that they go to."""
        size = len(self.points)
        tail, head = halfedges(self.faces)
        parent, price = self._parents(tail, head)
        fans = self._fans(parent)
        cost = price / np.sqrt(fans.shape) * np.where(fans.turned, TURNED_COST, 1.0) * (1 + BENT_COST * fans.bend)
        # A new edge must not be there already: the surface would be pinched (Dey et al. 1999).
        old = np.sort(_keys(tail, head, size))
        there = old[np.minimum(np.searchsorted(old, fans.key), len(old) - 1)] == fans.key
        cost[fans.owner[there]] = np.inf
        candidates = np.flatnonzero(np.isfinite(cost))
        if len(candidates) == 0:
            return candidates, candidates
        cheap = cost <= np.quantile(cost[candidates], QUANTILE)
        turn = np.full(size, size)
        turn[cheap] = np.random.default_rng([self.trial, self.round]).permutation(size)[cheap]
        least = turn.copy()
        np.minimum.at(least, tail, turn[head])
        chosen = (turn < size) & (turn == least)
        # Nor may two stars get the same new edge.
        mine = chosen[fans.owner]
        owner, key = fans.owner[mine], fans.key[mine]
        again = np.ones(len(key), dtype=bool)
        again[np.unique(key, return_index=True)[1]] = False
        chosen[owner[again]] = False
        vertex = np.flatnonzero(chosen)
        vertex = vertex[np.argsort(cost[vertex], kind="stable")]
        return vertex, parent[vertex]

    def _parents(self, tail: np.ndarray, head: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nearest neighbour (n,) of its kind of every vertex, -1 for none, and the price (n,) of going there."""
        size = len(self.points)
        allowed = np.flatnonzero((self.kind[tail] == self.kind[head]) & (self.kind[tail] >= 0))
        tail, head = tail[allowed], head[allowed]
        degree = np.bincount(self.faces.ravel(), minlength=size)
        price = np.linalg.norm(self.points[tail] - self.points[head], axis=1)
        price = price * (1 + np.maximum(degree[tail] + degree[head] - HIGH_DEGREE, 0))
        cost = np.full(size, np.inf)
        np.minimum.at(cost, tail, price)
        nearest = price == cost[tail]
        parent = np.full(size, size)
        np.minimum.at(parent, tail[nearest], head[nearest])
        return np.where(parent < size, parent, -1), cost

    def _fans(self, parent: np.ndarray) -> _Fans:
        size = len(self.points)
        corner = np.arange(3 * len(self.faces))
        flat = self.faces.ravel()
        i, a, b = flat, flat[next_halfedge(corner)], flat[previous_halfedge(corner)]
        j = parent[i]
        # The corner of the last face of a fan, before the one that comes back to the parent.
        last = np.full(size, -1)
        back = (j >= 0) & (b == j)
        last[i[back]] = a[back]
        stays = (j >= 0) & (j != a) & (j != b)
        i, a, b, j = i[stays], a[stays], b[stays], j[stays]
        inner = b != last[i]
        key = _keys(j[inner], b[inner], size)
        real = (a < self.n) & (b < self.n)
        p, q, r, s = (self.points[x[real]] for x in (i, a, b, j))
        old, new = cross3(q - p, r - p), cross3(q - s, r - s)
        area = np.linalg.norm(new, axis=1)
        squares = ((q - s) ** 2).sum(axis=1) + ((r - q) ** 2).sum(axis=1) + ((s - r) ** 2).sum(axis=1)
        shape = np.ones(size)
        np.minimum.at(shape, i[real], 2 * np.sqrt(3) * area / np.maximum(squares, 1e-300))
        cosine = (old * new).sum(axis=1) / np.maximum(np.linalg.norm(old, axis=1) * area, 1e-300)
        turned = np.zeros(size, dtype=bool)
        turned[i[real][cosine < TURNED]] = True
        bend = np.zeros(size)
        np.maximum.at(bend, i[real], 1 - cosine)
        return _Fans(np.maximum(shape, LEAST_SHAPE), turned, bend, i[inner], key)


@dataclass(frozen=True)
class _Fans:
    """The fans that fill the stars of vertices, from the neighbours they go to: least shape (n,) of a face, whether
    one turns over (n,), 1 - cosine (n,) of the angle that one turns by at most, and owner (e,) and key (e,) of their
    inner edges."""

    shape: np.ndarray
    turned: np.ndarray
    bend: np.ndarray
    owner: np.ndarray
    key: np.ndarray


def _keys(a: np.ndarray, b: np.ndarray, size: int) -> np.ndarray:
    return np.minimum(a, b) * size + np.maximum(a, b)
