"""Find the mirror image of a mesh in itself, by matching polygons across candidate planes.

Vertices of a chart that was cut open lie on one another along its seams, so positions alone do not tell a vertex from
its neighbour across the seam. Polygons do: the centre of each has one place, and of two in one place their neighbours
tell. A plane is kept if it takes every polygon to a polygon and, corner by corner, every vertex to one vertex.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from .geometry import bounds, extents, lengths, of_corners
from .topology import distinct, halfedges, pair_keys, pair_up, row_labels

# Distance between a vertex and the image of its partner, over the extent of the mesh, up to which they are a pair.
MIRROR_TOLERANCE = 1e-4
# Polygons whose images are looked up before those of all others.
PROBES = 200
# Planes across the axes and the principal directions, which come first.
FIRST_PLANES = 6
# Planes that are tried of those between a vertex and the others that are as far from the centre.
MOST_PLANES = 40
# Vertices are as far from the centre if their distances differ by less than this share of the extent.
SAME_DISTANCE = 1e-3
# Distances from the centre, over the greatest, below which a vertex says nothing about a plane.
NEAR_CENTRE = 0.1
# Share of the triangles whose images may be cut along the other diagonal.
FEW = 0.2
# Polygons with more sides are matched corner by corner in a tree.
FEW_SIDES = 8
# Pairs of corners that are compared at once.
AT_ONCE = 2**19


@dataclass(frozen=True)
class Mirror:
    """A reflection that takes a mesh to itself: image (n,) of every vertex, and the normal (3,) of the plane."""

    image: np.ndarray
    normal: np.ndarray


def find_mirror(
    positions: np.ndarray,
    triangles: np.ndarray,
    faces: np.ndarray | None = None,
    across: Mirror | None = None,
    accepted: Callable[[np.ndarray], bool] | None = None,
) -> Mirror | None:
    """The first mirror plane of a mesh (n,3), (m,3), those across x, y and z before others; None if it has none.

    faces (m,): polygon of every triangle, by default each its own; a polygon may be cut into triangles either way.
    across: a mirror that the plane is to be at right angles to; accepted: of the images (n,), for what else has to be
    symmetric. Every vertex belongs to a triangle. Mirror images agree to `MIRROR_TOLERANCE` of the extent. The plane in
    which a flat mesh lies is none.
    """
    box = _boxed(positions)
    if box is None:
        return None
    positions = box[0]
    polygons = _Polygons(positions, triangles, faces)
    for normal in _candidates(positions, triangles):
        if across is not None and abs(normal @ across.normal) > MIRROR_TOLERANCE:
            continue
        image = polygons.image(normal)
        if image is None or not (accepted is None or accepted(image)):
            continue
        if across is None or (image[across.image] == across.image[image]).all():
            return Mirror(image, normal)
    return None


@dataclass(frozen=True)
class PartialMirror:
    """A reflection that takes every polygon of a mesh to one, and most of them corner by corner.

    image (n,) : of every vertex, -1 for those that only polygons across the plane have; own (m,) bool : triangles of
    polygons that it takes to themselves; reflected (n,3) : the mirror images of the positions
    """

    image: np.ndarray
    own: np.ndarray
    reflected: np.ndarray


def partial_mirror(positions: np.ndarray, triangles: np.ndarray, faces: np.ndarray) -> PartialMirror | None:
    """The first mirror of a mesh (n,3), (m,3), with polygons faces (m,), but for what lies across its plane; or None.

    Polygons across a plane are their own images in space. Where a cut goes around them, they hang on one side, and on
    the other side there is none. See `find_mirror`, which finds a mirror of all.
    """
    box = _boxed(positions)
    if box is None:
        return None
    boxed, low, extent = box
    polygons = _Polygons(boxed, triangles, faces)
    # Vertices along the cut are not symmetric; the centres of polygons are.
    for normal in _candidates(polygons.centres, np.arange(len(polygons.centres))):
        other = polygons.images_of_polygons(normal)
        if other is None:
            continue
        own = other == np.arange(len(other))
        image = polygons.images_of_corners(other, normal, ~own) if own.sum() <= FEW * len(own) else None
        if image is not None:
            points = _reflected(polygons.points, normal) + polygons.middle
            return PartialMirror(image, own[polygons.number], 2 * (points * extent + low))
    return None


def _boxed(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Positions (n,3) in a box of extent 1, and half of its lowest corner (3,) and of its extent before; None where
    that is nothing or infinite."""
    # Halves first: the difference of two huge numbers may be infinite.
    low, high = (corner / 2 for corner in bounds(positions))
    extent = float((high - low).max())
    return ((positions / 2 - low) / extent, low, extent) if extent > 0 and np.isfinite(extent) else None


class _Polygons:
    """Corners (c,) of polygons, by polygon, and trees to find polygons and their corners by place.

    number (m,) : of the polygon of every triangle, from 0 on
    """

    def __init__(self, positions: np.ndarray, triangles: np.ndarray, faces: np.ndarray | None):
        faces = np.arange(len(triangles)) if faces is None else distinct(faces)[1]
        self.number = faces
        self.polygon, self.vertex = _corners(triangles, faces, len(positions))
        self.sides = np.bincount(self.polygon)
        self.first = np.cumsum(self.sides) - self.sides
        self.extent = float(extents(positions).max())
        sums = [np.bincount(self.polygon, positions[self.vertex, k]) for k in range(3)]
        centres = np.stack(sums, axis=1) / self.sides[:, None]
        self.middle = centres.mean(axis=0)
        self.points, self.centres = positions - self.middle, centres - self.middle
        self.probes = np.random.default_rng(0).permutation(len(self.sides))[:PROBES]

    @cached_property
    def centre_tree(self) -> cKDTree:
        """Of all centres: most meshes have no mirror, which their extents tell."""
        return cKDTree(self.centres)

    @cached_property
    def corner_tree(self) -> cKDTree:
        """Of all corners: most of the others have no mirror, which their centres tell."""
        # A polygon's number, scaled beyond all distances, keeps its corners apart from those of others.
        return cKDTree(np.column_stack([self.points[self.vertex], 2 * self.extent * self.polygon]))

    @cached_property
    def twins(self) -> np.ndarray:
        """The polygon (p,) in the place of each, -1 for most."""
        own = np.arange(len(self.sides))
        if len(own) < 2:
            return np.full(len(own), -1)
        far, two = self.centre_tree.query(self.centres, k=2)
        twin = np.where(two[:, 0] == own, two[:, 1], two[:, 0])
        there = (far[:, 1] <= MIRROR_TOLERANCE * self.extent) & (twin[twin] == own)
        return np.where(there, twin, -1)

    def image(self, normal: np.ndarray) -> np.ndarray | None:
        """The image (n,) of every vertex in the plane through the mean with this normal (3,); None if there is none."""
        other = self.images_of_polygons(normal)
        if other is None:
            return None
        image = self.images_of_corners(other, normal, np.ones(len(other), bool))
        if image is None or (image < 0).any() or (image == np.arange(len(image))).all():
            return None  # the plane of a flat mesh: it moves nothing
        return image

    def images_of_polygons(self, normal: np.ndarray) -> np.ndarray | None:
        """The image (p,) of every polygon in the plane through the mean with this normal (3,); None if one has none."""
        # What a plane takes to itself reaches as far to either side of it.
        height = self.centres @ normal
        if abs(height.max() + height.min()) > 2 * MIRROR_TOLERANCE * self.extent:
            return None
        if self._matched(self.probes, normal) is None:
            return None
        other = self._matched(np.arange(len(self.sides)), normal)
        if other is None:
            return None
        unsure = self.twins[other] >= 0
        if unsure.any():
            other = self._told_apart(other, unsure, normal)
        return None if (other[other] != np.arange(len(other))).any() else other

    def _told_apart(self, other: np.ndarray, unsure: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The images (p,) of polygons, of those `unsure` (p,) bool, two in one place, by what is around them."""
        corner, to = self._nearest_corners(other, normal, ~unsure)
        image = np.full(len(self.points), -1)
        image[self.vertex[corner]] = to
        corner = unsure[self.polygon] & (image[self.vertex] >= 0)
        polygon, to = self.polygon[corner], image[self.vertex[corner]]
        shared = []
        for candidate in (other, self.twins[other]):
            there = np.isin(candidate[polygon] * len(image) + to, self.polygon * len(image) + self.vertex)
            shared.append(np.bincount(polygon, there, len(other)))
        return np.where(unsure & (shared[1] > shared[0]), self.twins[other], other)

    def images_of_corners(self, other: np.ndarray, normal: np.ndarray, used: np.ndarray) -> np.ndarray | None:
        """The image (n,) of every vertex of the polygons `used` (p,) bool, whose images are `other` (p,), -1 for the
        rest; None where there is no such image."""
        corner, to = self._nearest_corners(other, normal, used)
        image, vertex = np.full(len(self.points), -1), self.vertex[corner]
        image[vertex] = to
        if (to < 0).any() or (image[vertex] != to).any():
            return None
        known = np.flatnonzero(image >= 0)
        return None if (image[image[known]] != known).any() else image

    def _nearest_corners(
        self, other: np.ndarray, normal: np.ndarray, used: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Corners (k,) of the polygons `used` (p,) bool, and the vertex (k,) of the polygon that is their image, where
        the image of each lies; -1 where none does."""
        found = np.full(len(self.vertex), -1)
        sides = np.stack([self.sides, self.sides[other]])
        few = used & (sides.max(axis=0) <= FEW_SIDES)
        both = distinct((sides[0] * (FEW_SIDES + 1) + sides[1])[few])[0]
        # Pairs of all their corners are compared faster than a tree of these is built.
        for own, theirs in zip(*np.divmod(both, FEW_SIDES + 1), strict=True):
            rows = np.flatnonzero(few & (sides[0] == own) & (sides[1] == theirs))
            for some in np.array_split(rows, len(rows) * own * theirs // AT_ONCE + 1):
                corners = self.first[some][:, None] + np.arange(own)
                among = self.vertex[self.first[other[some]][:, None] + np.arange(theirs)]
                place = _reflected(self.points[self.vertex[corners]], normal)
                far = lengths(place[:, :, None] - self.points[among][:, None])
                near = np.take_along_axis(among, far.argmin(axis=2), axis=1)
                found[corners] = np.where(far.min(axis=2) <= MIRROR_TOLERANCE * self.extent, near, -1)
        corner = np.flatnonzero((used & ~few)[self.polygon])
        if len(corner):
            place = _reflected(self.points[self.vertex[corner]], normal)
            polygon = other[self.polygon[corner]]
            far, at = self.corner_tree.query(np.column_stack([place, 2 * self.extent * polygon]))
            found[corner] = np.where(far <= MIRROR_TOLERANCE * self.extent, self.vertex[at], -1)
        if used.all():
            return np.arange(len(found)), found
        corner = np.flatnonzero(used[self.polygon])
        return corner, found[corner]

    def _matched(self, polygons: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
        """The polygons (p,) where the images of `polygons` (p,) lie, None unless each has one of as many sides."""
        near = MIRROR_TOLERANCE * self.extent
        # Where nothing is near, what is nearest takes long to find.
        far, other = self.centre_tree.query(_reflected(self.centres[polygons], normal), distance_upper_bound=2 * near)
        return other if far.max() <= near and (self.sides[other] == self.sides[polygons]).all() else None


def _corners(triangles: np.ndarray, faces: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """The polygon and the vertex of every corner (c,) of polygons faces (m,), counted from 0, of triangles (m,3) of n
    vertices: by polygon, and then by vertex."""
    low, high = of_corners(np.minimum, triangles), of_corners(np.maximum, triangles)
    corners = np.column_stack([low, of_corners(np.add, triangles) - low - high, high])
    if int(faces.max(initial=-1)) + 1 == len(faces) and (np.diff(corners, axis=1) > 0).all():
        # What is in order already, but for that of the triangles, takes longest to sort.
        ordered = np.empty(corners.shape, np.int64)
        ordered[faces] = corners
        return np.repeat(np.arange(len(faces)), 3), ordered.ravel()
    pairs = np.unique(np.repeat(faces, 3).astype(np.int64) * n + triangles.ravel())
    return pairs // n, pairs % n


def mirrored_quads(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Pairs (k,2) of triangles that are a quad whose mirror image is cut along the other diagonal.

    positions (n,3), triangles (m,3): a mesh all of whose vertices have an image. Quads that a program has cut into
    triangles are symmetric, their diagonals are not. Where many triangles have no image there are no such pairs.
    """
    none = np.zeros((0, 2), np.int64)
    used, compact = distinct(triangles)
    if not len(used):
        return none
    triangles, points = compact.reshape(-1, 3), positions.take(used, axis=0) / 2
    low, high = bounds(points)
    extent = float((high - low).max())
    if not (extent > 0 and np.isfinite(extent)):
        return none
    points = (points - low) / extent
    centred = points - points.mean(axis=0)
    tree, probes = None, np.random.default_rng(0).permutation(len(points))[:PROBES]
    for number, normal in enumerate(_candidates(points, triangles)):
        # What a plane takes to itself reaches as far to either side of it.
        height = centred @ normal
        if abs(height.max() + height.min()) > 2 * MIRROR_TOLERANCE:
            continue
        tree = tree or cKDTree(centred)
        if tree.query(_reflected(centred[probes], normal))[0].max() > MIRROR_TOLERANCE:
            continue
        far, image = tree.query(_reflected(centred, normal))
        if far.max() <= MIRROR_TOLERANCE and (image[image] == np.arange(len(image))).all():
            rest = np.flatnonzero(~_among(image[triangles], triangles))
            pairs = _recut(triangles, image, rest)
            if len(pairs):
                return pairs
            # A body that many planes take to itself is cut alike all around.
            if number >= FIRST_PLANES and not len(rest):
                break
    return none


def _recut(triangles: np.ndarray, image: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Pairs (k,2) of the triangles `rest` (r,), of (m,3), without an image whose quads have one, for the image (n,) of
    every vertex."""
    if not 0 < len(rest) <= FEW * len(triangles):
        return np.zeros((0, 2), np.int64)
    tail, head = halfedges(triangles[rest])
    first, second = pair_up(pair_keys(tail, head))
    opposite = triangles[rest][second // 3, (second + 2) % 3]
    quads = np.column_stack([triangles[rest][first // 3], opposite])
    kept = _among(image[quads], quads)
    pairs = np.column_stack([first // 3, second // 3])[kept]
    single = np.bincount(pairs.ravel(), minlength=len(rest)) == 1
    return rest[pairs[single[pairs].all(axis=1)]]


def _among(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Which rows (k,q) of vertices are some other's (l,q), in any order, (k,) bool."""
    both = np.sort(np.concatenate([others, rows]), axis=1)
    label = row_labels(both)
    return np.isin(label[len(others) :], label[: len(others)])


def _reflected(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Points (...,3) reflected in the plane through 0 with a unit normal (3,)."""
    return points - 2 * (points @ normal)[..., None] * normal


def _candidates(positions: np.ndarray, triangles: np.ndarray) -> Iterator[np.ndarray]:
    """Unit normals (3,) of planes through the mean: across the axes, the principal directions, and between vertices.

    A plane that is none of the first ones belongs to a turning symmetry, and takes a vertex to another that is as far
    from the mean. The vertex with fewest of these has the fewest planes to try.
    """
    yield from np.eye(3)
    points = positions - positions.mean(axis=0)
    principal = np.linalg.eigh(points.T @ points)[1].T
    yield from principal
    distance = lengths(points)
    extent = float(extents(positions).max())
    step = SAME_DISTANCE * max(extent, float(np.finfo(float).tiny))
    ring = np.round(distance / step).astype(np.int64)
    used = np.zeros(len(points), bool)
    used[triangles] = True
    telling = np.flatnonzero(used & (distance > NEAR_CENTRE * distance.max()))
    place = distinct(ring[telling])
    rings, count = place[0], np.bincount(place[1])
    if not (count > 1).any():
        return
    chosen = telling[np.abs(ring[telling] - rings[np.where(count > 1, count, len(points) + 1).argmin()]) <= 1]
    for other in chosen[1 : MOST_PLANES + 1]:
        between = points[other] - points[chosen[0]]
        length = np.linalg.norm(between)
        if length > step:
            yield between / length
