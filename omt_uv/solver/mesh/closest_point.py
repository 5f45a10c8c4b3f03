"""Find closest points on a triangle mesh, many at once, on the side of the surface that looks the right way.

Candidates come from a k-d tree of points spread over the faces, each with its normal, so that a query on one side of
a thin part is not answered from the other side; the exact distance to the candidates decides, and the answer walks
on across edges while that brings it nearer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from .geometry import face_normals, lengths, of_corners
from .topology import twins

# Samples whose faces are tried for a query,
CANDIDATES = 4
# and where walks go on from time to time, so that few that begin at the wrong one do not matter.
FEW_CANDIDATES = 1
# Squared share of the spacing within which a point is on a surface.
ON_SURFACE = 1e-12
# Cosine between the normals from which on it is on the right side of a thin part.
SAME_SIDE = 0.5
# So many pitches of samples from the nearest, half of the samples in each direction tell about where it is as well.
FAR = 12.0
# Samples so few are searched for any point.
FEW_SAMPLES = 1000
# Samples that are tried whichever way the surface looks there,
MORE_CANDIDATES = 8
# but for those that look the opposite way: cosine between the normals.
OPPOSITE = -0.5
# Points on the faces are this share of the spacing of queries apart.
PITCH = 0.7
# Points on the faces at most, for memory.
MOST_SAMPLES = 600_000
# Edges that a walk crosses at most,
WALK_ROUNDS = 20
# from where the coordinate of the corner that is opposite is no greater than this.
ON_EDGE = 1e-12


@dataclass(frozen=True)
class SurfacePoints:
    """Points (k,3) on the surface, the triangle (k,) of each and its barycentric coordinates (k,3)."""

    points: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray


def closest_on_triangles(q: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (..., 3) of the points of triangles a, b, c (..., 3) that are closest to q (..., 3).

    By regions of the triangle's plane (Ericson 2005, section 5.1.5).
    """
    ab, ac, ap = (np.moveaxis(x, -1, 0) for x in np.broadcast_arrays(b - a, c - a, q - a))
    v, w = _in_frame(_product(ab, ap), _product(ac, ap), *_frame(ab, ac))
    return np.stack([np.maximum(1 - v - w, 0), v, w], axis=-1)


def _frame(ab: np.ndarray, ac: np.ndarray) -> np.ndarray:
    """Products (6, ...) of the sides ab, ac (3, ...): of ab with itself, with ac, of ac with itself, and these three
    over the square of twice the area, 0 where there is none."""
    products = np.stack([_product(ab, ab), _product(ab, ac), _product(ac, ac)])
    square = products[0] * products[2] - products[1] ** 2
    over = np.zeros_like(square)
    np.divide(1.0, square, out=over, where=square > 0)
    return np.concatenate([products, products * over])


def _in_frame(d1, d2, e, f, g, e1, f1, g1) -> tuple[np.ndarray, np.ndarray]:
    """Second and third coordinate of the closest points, from the products of the sides ab, ac with the way to the
    point, and their `_frame`."""
    v, w = g1 * d1 - f1 * d2, e1 * d2 - f1 * d1
    # So is what is no number.
    beside = np.nonzero(~((v > 0) & (w > 0) & (v + w < 1)))
    v[beside], w[beside] = _on_triangle_boundary(d1[beside], d2[beside], e[beside], f[beside], g[beside])
    return v, w


def _on_triangle_boundary(d1, d2, e, f, g) -> tuple[np.ndarray, np.ndarray]:
    """As `_in_frame`, on the nearest of the sides: for points whose nearest point of the plane is outside of the
    triangle."""
    tiny = np.finfo(float).tiny
    on_ab, on_ac = d1 / np.maximum(e, tiny), d2 / np.maximum(g, tiny)
    on_bc = (d2 - d1 + e - f) / np.maximum(e + g - 2 * f, tiny)
    # No number, as in a triangle whose squares overflow, is 0.
    on_ab, on_ac, on_bc = (np.fmin(np.fmax(x, 0.0), 1.0) for x in (on_ab, on_ac, on_bc))
    # Squared distances, less that from the first corner.
    from_ab, from_ac = on_ab * (on_ab * e - 2 * d1), on_ac * (on_ac * g - 2 * d2)
    left = 1 - on_bc
    from_bc = left * (left * e - 2 * d1 + 2 * on_bc * f) + on_bc * (on_bc * g - 2 * d2)
    by_ab, by_bc = from_ab <= from_ac, from_bc < np.minimum(from_ab, from_ac)
    v, w = np.where(by_ab, on_ab, 0.0), np.where(by_ab, 0.0, on_ac)
    return np.where(by_bc, left, v), np.where(by_bc, on_bc, w)


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (...) of vectors (3, ...), coordinates apart from each other."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _square(a: np.ndarray) -> np.ndarray:
    """Squared lengths (...) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, a)


class ClosestPoint:
    """Closest points on a mesh (n,3), (m,3); queries are expected about `spacing` apart."""

    def __init__(
        self,
        vertices: np.ndarray,
        triangles: np.ndarray,
        spacing: float,
        twin: np.ndarray | None = None,
        even: bool = False,
    ):
        """With the `twins` (3m,) of the triangles where they are known; where these are `even`, with sides of about the
        spacing, their middles tell where they are."""
        self.vertices, self.triangles, self.even = vertices, triangles, even
        self.normals = face_normals(vertices, triangles)
        a, b, c = (vertices.T.take(corner, axis=1) for corner in triangles.T)
        self._a, self._ab, self._ac = a, b - a, c - a
        self._frames = _frame(self._ab, self._ac)
        twin = twins(triangles) if twin is None else twin
        # Opposite to corner k is the edge from corner k + 1, where the coordinate k is zero.
        self.opposite = np.where(twin >= 0, twin // 3, -1).reshape(-1, 3).take((1, 2, 0), axis=1)
        # A normal to the opposite side counts as far as one spacing.
        self.normal_scale = 0.5 * spacing
        self.spacing = spacing

    def __call__(self, points: np.ndarray, normals: np.ndarray, candidates: int = CANDIDATES) -> SurfacePoints:
        """Closest points to points (k,3) where the surface looks about the way of normals (k,3)."""
        owner, _ = self._spread
        k = min(candidates, len(owner))
        _, index = self._tree.query(np.column_stack([points, self.normal_scale * normals]), k=k)
        faces = owner[index.reshape(len(points), k)]
        if k == 1:
            return self.walk(points, faces[:, 0])
        _, distance = self.distance(points, faces)
        # The right side first, then the distance.
        back = np.einsum("kcj,kj->kc", self.normals.take(faces, axis=0), normals) < 0
        distance = distance + np.where(back, 4 * distance.max(initial=1e-300), 0)
        return self.walk(points, faces[np.arange(len(faces)), distance.argmin(axis=1)])

    # Walks need no trees, so these come when they are first asked for.
    @cached_property
    def _spread(self) -> tuple[np.ndarray, np.ndarray]:
        if self.even:
            return np.arange(len(self.triangles)), (self._a + (self._ab + self._ac) / 3).T
        return spread_points(self.vertices, self.triangles, PITCH * self.spacing)

    @cached_property
    def _tree(self) -> cKDTree:
        owner, samples = self._spread
        return cKDTree(np.column_stack([samples, self.normal_scale * self.normals.take(owner, axis=0)]))

    @cached_property
    def _plain(self) -> cKDTree:
        """The samples without their normals."""
        return cKDTree(self._spread[1])

    @cached_property
    def _levels(self) -> list[tuple[np.ndarray, cKDTree, float]]:
        """Triangles (s,) of samples, these, and how far apart they are: all, then one of each cube twice as large."""
        (owner, samples), pitch = self._spread, max(PITCH * self.spacing, 1e-300)
        levels = [(owner, self._plain, pitch)]
        while len(owner) > FEW_SAMPLES:
            pitch *= 2
            first = _one_of_each(np.floor((samples - samples.min(axis=0)) / pitch).astype(np.int64))
            owner, samples = owner[first], samples[first]
            levels.append((owner, cKDTree(samples), pitch))
        return levels

    def at_or_near(self, points: np.ndarray, normals: np.ndarray, near: np.ndarray | None) -> SurfacePoints:
        """As a call, for points most of which lie on the surface, about at triangles `near` (k,) where these are given:
        only the others are searched for, and those on what may be the wrong side."""
        if near is None:
            return self(points, normals)
        found = self.walk(points, near)
        side = np.einsum("kj,kj->k", self.normals.take(found.faces, axis=0), normals)
        off = np.flatnonzero((_square(found.points - points) > ON_SURFACE * self.spacing**2) | (side < SAME_SIDE))
        _put(found, off, self(points[off], normals[off]))
        return found

    def closer(self, points: np.ndarray, normals: np.ndarray, found: SurfacePoints) -> SurfacePoints:
        """What was found for points (k,3) with normals (k,3), or the nearest by position where that is nearer, and does
        not look the opposite way."""
        owner = self._spread[0]
        k = min(MORE_CANDIDATES, len(owner))
        faces = owner[self._plain.query(points, k=k)[1].reshape(len(points), k)]
        _, distance = self.distance(points, faces)
        back = np.einsum("kcj,kj->kc", self.normals.take(faces, axis=0), normals) < OPPOSITE
        distance = np.where(back, np.inf, distance)
        best = distance.argmin(axis=1)
        other = self.walk(points, faces[np.arange(len(faces)), best])
        nearer = np.isfinite(distance.min(axis=1)) & (_square(other.points - points) < _square(found.points - points))
        parts = zip(vars(found).values(), vars(other).values(), strict=True)
        return SurfacePoints(*(np.where(nearer.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in parts))

    def near_by_position(self, points: np.ndarray) -> np.ndarray:
        """The nearest triangle (k,) of those of the samples nearest to points (k,3), whichever way it looks.

        A tree tells the nearest of many that are about as far only by visiting them all, as from the middle of a ball:
        the farther a point, the fewer samples tell where to look, and from there more and more tell where it is.
        """
        left, level, found = np.arange(len(points)), np.zeros(len(points), np.int64), np.zeros(len(points), np.int64)
        for k, (owner, tree, pitch) in enumerate(self._levels):
            reach = FAR * pitch if k + 1 < len(self._levels) else np.inf
            near, faces = self._candidates(owner, tree, points[left], reach)
            rows = left[near]
            found[rows], level[rows] = self._best(points[rows], faces), k
            left = left[~near]
        for k in range(int(level.max(initial=0)) - 1, -1, -1):
            rows = np.flatnonzero(level > k)
            here = self.at(found[rows], self.distance(points[rows], found[rows])[0])
            around = self._candidates(*self._levels[k][:2], here, np.inf)[1]
            found[rows] = self._best(points[rows], np.column_stack([found[rows], around]))
        return found

    def _best(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """The triangle (k,) of candidates (k,c) that is nearest to each of points (k,3)."""
        return faces[np.arange(len(faces)), self.distance(points, faces)[1].argmin(axis=1)]

    @staticmethod
    def _candidates(
        owner: np.ndarray, tree: cKDTree, points: np.ndarray, reach: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Which points (k,3) have samples within reach, (k,) bool, and triangles of theirs, (j,c)."""
        count = min(MORE_CANDIDATES, len(owner))
        off, at = (x.reshape(-1, count) for x in tree.query(points, k=count, distance_upper_bound=reach))
        near = np.isfinite(off[:, 0])
        # Where fewer are as near, the nearest stands for the others.
        return near, owner[np.where(np.isfinite(off), at, at[:, :1])[near]]

    def nearest_face(self, points: np.ndarray) -> np.ndarray:
        """The triangle (k,) of the sample nearest to each of points (k,3): where it is about, for smooth quantities."""
        return self._spread[0][self._plain.query(points)[1]]

    def walk(self, points: np.ndarray, faces: np.ndarray) -> SurfacePoints:
        """From starting faces (k,) across edges for as long as that brings nearer to the points (k,3)."""
        faces = faces.copy()
        barycentric, distance = self.distance(points, faces)
        active = np.flatnonzero(of_corners(np.logical_or, barycentric <= ON_EDGE))
        for _ in range(WALK_ROUNDS):
            beyond = self.opposite.take(faces[active], axis=0)
            row, corner = np.nonzero((barycentric.take(active, axis=0) <= ON_EDGE) & (beyond >= 0))
            if len(row) == 0:
                break
            face, mine = beyond[row, corner], active[row]
            b, d = self.distance(points.take(mine, axis=0), face)
            nearer = np.flatnonzero(d < distance[mine] * (1 - 1e-12))
            mine = mine[nearer]
            active = mine[np.flatnonzero(np.diff(mine, prepend=-1))]
            # Where two are nearer, that which comes last is kept.
            last = np.argsort(-d[nearer], kind="stable")
            mine, nearer = mine[last], nearer[last]
            faces[mine], barycentric[mine], distance[mine] = face[nearer], b[nearer], d[nearer]
        return SurfacePoints(self.at(faces, barycentric), faces, barycentric)

    def at(self, faces: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Positions (k,3) of points given by face and barycentric coordinates."""
        v, w = barycentric[:, 1], barycentric[:, 2]
        a, ab, ac = (x.take(faces, axis=1, mode="clip") for x in (self._a, self._ab, self._ac))
        return (a + v * ab + w * ac).T

    def distance(self, points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Barycentric coordinates (k,3), or (k,c,3), of the closest points to points (k,3) on faces (k,) or (k,c), and
        squared distances."""
        p = points.T if faces.ndim == 1 else points.T[:, :, None]
        # To clip numbers that are in range takes half of the time of looking whether they are.
        a, ab, ac, frames = (x.take(faces, axis=1, mode="clip") for x in (self._a, self._ab, self._ac, self._frames))
        ap = p - a
        v, w = _in_frame(_product(ab, ap), _product(ac, ap), *frames)
        off = ap - v * ab - w * ac
        return np.stack([np.maximum(1 - v - w, 0), v, w], axis=-1), _product(off, off)


class ClosestPointTracker:
    """Closest points for the same points again and again, while they or the mesh move little by little: from the last
    answer on it is a few steps, but these may end in a nearest point that is not the nearest of all, so that every few
    calls there is a search, for those farther than `far` times the root of the mean square."""

    def __init__(
        self, search_every: int, far: float = 0.0, start: np.ndarray | None = None, candidates: int = CANDIDATES
    ):
        """With the triangles (k,) of a `start` there is no search at first."""
        self.search_every, self.far, self.candidates = search_every, far, candidates
        self.faces = start
        self._calls = 0 if start is None else 1

    def __call__(self, index: ClosestPoint, points: np.ndarray, normals: np.ndarray) -> SurfacePoints:
        """As `ClosestPoint.__call__` of an index, whose triangles have the numbers of the last one's."""
        again = self._calls % self.search_every == 0
        if self.faces is None or (again and self.far == 0):
            found = index(points, normals, self.candidates)
        else:
            found = index.walk(points, self.faces)
            if again:
                _search_again(index, points, normals, found, self.far)
        self.faces, self._calls = found.faces, self._calls + 1
        return found


def _search_again(
    index: ClosestPoint, points: np.ndarray, normals: np.ndarray, found: SurfacePoints, far: float
) -> None:
    """Overwrite what was found for points (k,3) that are far from it, where something is nearer."""
    square = _square(found.points - points)
    mine = np.flatnonzero(square > far**2 * square.sum() / max(len(square), 1))
    other = index.closer(points[mine], normals[mine], SurfacePoints(*(part[mine] for part in vars(found).values())))
    _put(found, mine, other)


def _put(found: SurfacePoints, rows: np.ndarray, other: SurfacePoints) -> None:
    """Overwrite rows (k,) of what was found by what else was."""
    for whole, part in zip(vars(found).values(), vars(other).values(), strict=True):
        whole[rows] = part


def spread_points(vertices: np.ndarray, triangles: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (s,3) over the faces, no farther apart than about `spacing`, and the face (s,) of each.

    A face is cut into k^2 similar ones, and their centroids are the points.
    """
    p = vertices.take(triangles.T, axis=0)
    longest = lengths(p - p[[1, 2, 0]]).max(axis=0)
    level = np.maximum(np.ceil(longest / max(spacing, 1e-300)), 1)
    excess = np.sqrt((level**2).sum() / MOST_SAMPLES)
    if excess > 1:
        level = np.maximum(np.floor(level / excess), 1)
    level = np.minimum(level, 1000).astype(np.int64)
    owners, points = [], []
    for k in np.unique(level):
        faces = np.flatnonzero(level == k)
        pattern = subdivision_centroids(int(k))
        owners.append(np.repeat(faces, len(pattern)))
        points.append(points_in(p.take(faces, axis=1), pattern))
    return np.concatenate(owners), np.concatenate(points)


def points_in(corners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Points (m r,3), one triangle after the other, at these barycentric coordinates (r,3) of each, by corners (3,m,3).

    As an einsum has them to the bit, in a quarter of the time.
    """
    a, b, c = corners
    if len(places) > len(a):
        # Of a few large triangles: place by place takes seconds.
        x, y, z = places.T[:, :, None]
        return (x * a[:, None] + y * b[:, None] + z * c[:, None]).reshape(-1, 3)
    points = np.empty((len(a), len(places), 3))
    for k, (x, y, z) in enumerate(places):
        points[:, k] = x * a + y * b + z * c
    return points.reshape(-1, 3)


def _one_of_each(cubes: np.ndarray) -> np.ndarray:
    """The first of the rows (s,3), whole numbers from 0 on, that are alike, in lexicographic order of what they are."""
    x, y, z = (int(n) + 1 for n in cubes.max(axis=0))
    if x * y * z > np.iinfo(np.int64).max:
        return np.unique(cubes, axis=0, return_index=True)[1]
    # One number for a row is in the same order, and sorted in a tenth of the time.
    return np.unique((cubes[:, 0] * y + cubes[:, 1]) * z + cubes[:, 2], return_index=True)[1]


def random_points(mass: np.ndarray, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (count,) and barycentric coordinates (count,3) of random points, spread by the mass (m,)."""
    total = np.cumsum(mass)
    # One in each of as many equal stretches: as random, but more even.
    at = (np.arange(count) + rng.random(count)) / count * total[-1]
    face = np.minimum(np.searchsorted(total, at, side="right"), len(mass) - 1)
    root, along = np.sqrt(rng.random(count)), rng.random(count)
    return face, np.stack([1 - root, root * (1 - along), root * along], axis=1)


def subdivision_centroids(k: int) -> np.ndarray:
    """Barycentric coordinates (k^2,3) of the centroids of a triangle cut into k^2 similar ones."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(k), np.arange(k), indexing="ij"))
    up, down = i + j < k, i + j < k - 1
    u = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / k
    v = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / k
    return np.stack([1 - u - v, u, v], axis=1)
