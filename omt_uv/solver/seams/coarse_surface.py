"""Coarsen a surface of any topology, by independent half-edge collapses that keep it a manifold (Hoppe 1996).

Seams are searched where a log scale costs milliseconds: on about a thousand vertices. Every vertex that goes hands its
curvature and area to the one it collapses into, so that both keep their sums exactly (Gauss and Bonnet).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.edge_flips import flip_in_place
from ..mesh.geometry import (
    angle_defects,
    angles_from_lengths,
    cross3,
    face_areas,
    halfedge_lengths,
    vertex_areas,
)
from ..mesh.topology import (
    boundary_edges,
    euler_characteristic,
    graph_components,
    halfedges,
    next_halfedge,
    pair_keys,
    previous_halfedge,
    twins,
)

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
# A half and its image have the area of the whole but for this share, or they are no image of it.
WHOLE = 0.05
# Rounds end when one removes a smaller share of the vertices.
LEAST_PROGRESS = 0.01


@dataclass(frozen=True)
class Mirrored:
    """The mirror image (n,) of every vertex, and which are on the one side or in the plane, (n,) bool."""

    image: np.ndarray
    side: np.ndarray


@dataclass(frozen=True)
class CoarseSurface:
    """A coarse surface.

    Attributes
    ----------
    kept (c,) : vertices of the fine surface
    positions (c,3), triangles (t,3) : of them
    curvature (c,) : angle defects of the fine surface, radians; on the boundary beside a straight one
    area (c,) : of the fine surface, at each vertex, their sum is 1
    boundary (c,) bool : which are on a boundary
    size : square root of the area of the fine surface, in the units of the positions
    images : of one that is its own mirror image, see `HalfSurface`; None of others
    """

    kept: np.ndarray
    positions: np.ndarray
    triangles: np.ndarray
    curvature: np.ndarray
    area: np.ndarray
    boundary: np.ndarray
    size: float
    images: Mirrored | None = None


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
    on_boundary = np.zeros(n, dtype=bool)
    on_boundary[boundary_edges(triangles)[:, 0]] = True
    curvature = _curvature(positions, triangles, on_boundary)
    kind = 2 * on_boundary.astype(np.int64)
    if line is not None:
        kind[line] += 1
    return _begun(positions, triangles, kind, on_boundary, curvature).towards(COMMON * count, 0)


def _curvature(positions: np.ndarray, triangles: np.ndarray, on_boundary: np.ndarray) -> np.ndarray:
    """Angle defects (n,) of a surface with this boundary (n,) bool, beside a straight one there."""
    angles = angles_from_lengths(halfedge_lengths(positions, triangles).reshape(-1, 3))
    return angle_defects(triangles, angles, np.flatnonzero(on_boundary), len(positions))


def _begun(positions, triangles, kind: np.ndarray, on_boundary: np.ndarray, curvature: np.ndarray) -> Coarsening:
    """A surface before the first collapse, whose vertices are of these kinds (n,)."""
    n = len(positions)
    # A boundary is closed by a cone, so that every vertex is surrounded by faces.
    tail, head = boundary_edges(triangles).T
    _, label = graph_components(tail, head, n)
    _, loop = np.unique(label[tail], return_inverse=True)
    faces = np.concatenate([triangles, np.column_stack([head, tail, n + loop.ravel()])])
    kind = np.concatenate([kind, np.full(int(loop.max(initial=-1)) + 1, -1)])
    return Coarsening(positions, on_boundary, kind, faces, curvature, vertex_areas(positions, triangles), n)


@dataclass(frozen=True)
class HalfSurface:
    """One half of a surface that is nearly its own mirror image, on its way to coarse ones, which are exactly so.

    begun : the half, with its border in the plane; plane (n,) bool : vertices there; image (n,) : the vertex of the
    surface nearest to the mirror image of each; height (n,) : over the plane; normal (3,) : of it
    """

    begun: Coarsening
    plane: np.ndarray
    image: np.ndarray
    height: np.ndarray
    normal: np.ndarray

    def ended(self, count: int, trial: int = 0) -> CoarseSurface | None:
        """A coarse surface of about `count` vertices, a half and its image; None where they would meet elsewhere than
        along their borders."""
        half = self.begun.ended(count // 2, trial)
        plane, n = self.plane[half.kept], len(half.kept)
        triangles = _without_chords(half.triangles, plane)
        if triangles is None:
            return None
        off = np.flatnonzero(~plane)
        image = np.arange(n)
        image[off] = n + np.arange(len(off))
        beyond = half.positions[off] - 2 * self.height[half.kept[off], None] * self.normal
        twice = np.where(plane, 2.0, 1.0)
        return CoarseSurface(
            kept=np.concatenate([half.kept, self.image[half.kept[off]]]),
            positions=np.concatenate([half.positions, beyond]),
            triangles=np.concatenate([triangles, image[triangles][:, ::-1]]),
            curvature=np.concatenate([half.curvature * twice, half.curvature[off]]),
            area=np.concatenate([half.area * twice, half.area[off]]) / 2,
            boundary=np.concatenate([half.boundary, half.boundary[off]]),
            size=half.size * float(np.sqrt(2)),
            images=Mirrored(np.concatenate([image, off]), np.arange(n + len(off)) < n),
        )


def half_coarsening(
    positions: np.ndarray,
    triangles: np.ndarray,
    count: int,
    plane: np.ndarray,
    image: np.ndarray,
    height: np.ndarray,
    normal: np.ndarray,
) -> HalfSurface | None:
    """One half of a surface (n,3), (m,3) on its way to coarse ones of `count` vertices; None where the surface does not
    fall into two along a line of vertices by the plane.

    plane (n,) bool, image (n,), height (n,), normal (3,): see `HalfSurface`
    """
    n, outline = len(positions), boundary_edges(triangles)
    half = _largest(triangles[in_half(triangles, (height >= 0) | plane, plane)], n)
    border = boundary_edges(half)
    in_plane = plane[border].all(axis=1)
    outer = np.isin(pair_keys(*border[in_plane].T), pair_keys(*outline.T))
    if outer.any() or not is_half(positions, triangles, half, plane):
        return None
    # Not where two fans of the half meet in a vertex.
    if np.bincount(border[:, 0], minlength=1).max(initial=0) > 1:
        return None
    if 2 * _euler(half) - (len(np.unique(border[in_plane])) - int(in_plane.sum())) != _euler(triangles):
        return None
    line, on_boundary = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    line[border[in_plane]] = on_boundary[outline] = True
    above = np.where(line, height, 0.0)
    points = positions - above[:, None] * normal
    # Half of what the whole has in the plane.
    curvature = _curvature(points, half, on_boundary)
    curvature -= np.where(line, np.where(on_boundary, np.pi / 2, np.pi), 0.0)
    kind = 3 * line.astype(np.int64)
    kind[on_boundary] = 2
    corners = np.flatnonzero(line & on_boundary)
    kind[corners] = 4 + np.arange(len(corners))
    begun = _begun(points, half, kind, on_boundary, curvature)
    begun = replace(begun, left=len(np.unique(half)))
    return HalfSurface(begun.towards(COMMON * count // 2, 0), line, image, height - above, normal)


def in_half(triangles: np.ndarray, within: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """Triangles (t,) bool of one half, whose vertices within (n,) bool are on its side or in the plane (n,) bool; those
    that lie in the plane are of none."""
    return within[triangles].all(axis=1) & ~plane[triangles].all(axis=1)


def is_half(positions: np.ndarray, triangles: np.ndarray, half: np.ndarray, plane: np.ndarray) -> bool:
    """Whether some of the triangles (t,3), `half` (h,3), end in the plane (n,) bool or on the boundary, and have half
    of the area."""
    ends = boundary_edges(half)
    outside = np.isin(pair_keys(*ends.T), pair_keys(*boundary_edges(triangles).T))
    area, whole = (face_areas(positions, part).sum() for part in (half, triangles))
    return bool((outside | plane[ends].all(axis=1)).all() and abs(2 * area - whole) <= WHOLE * whole)


def _largest(triangles: np.ndarray, n: int) -> np.ndarray:
    """The triangles (t,3) of the part with most of them, of those that hang together."""
    _, label = graph_components(*halfedges(triangles), n)
    label = label[triangles[:, 0]]
    return triangles[label == np.bincount(label, minlength=1).argmax()]


def _euler(triangles: np.ndarray) -> int:
    """Euler's number of a manifold."""
    return euler_characteristic(len(np.unique(triangles)), len(triangles), len(boundary_edges(triangles)))


def _without_chords(triangles: np.ndarray, plane: np.ndarray) -> np.ndarray | None:
    """A half (t,3) whose inner edges with both ends in the plane (c,) bool are flipped; None where one cannot be: with
    the image of the half, four triangles would meet there."""
    twin = twins(triangles)
    tail, head = halfedges(triangles)
    chords = np.flatnonzero((twin > np.arange(len(twin))) & plane[tail] & plane[head])
    if not len(chords):
        return triangles
    other = np.stack([tail[previous_halfedge(chords)], tail[previous_halfedge(twin[chords])]], axis=1)
    keys = pair_keys(*other.T)
    beside = np.concatenate([chords // 3, twin[chords] // 3])
    known = np.isin(keys, pair_keys(tail, head)) | plane[other].all(axis=1) | (other[:, 0] == other[:, 1])
    if known.any() or len(np.unique(keys)) < len(keys) or len(np.unique(beside)) < len(beside):
        return None
    flipped = triangles.copy()
    flip_in_place(flipped, twin, chords)
    return flipped


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
