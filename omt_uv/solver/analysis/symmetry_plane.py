"""Find the plane in which a surface is its own mirror image, exactly or nearly, as scans and sculpted bodies are.

Exact mirrors are those of `mesh/mirror.py`. Near ones: planes in all directions through the middle are compared by how
far the images of a few points lie from the surface, and the best are refined by pairing every image with its nearest
point again and again (iterated closest points; trimmed, so that an arm that is raised does not turn the plane).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.geometry import below_one, face_areas, face_normals
from ..mesh.mirror import find_mirror
from ..mesh.topology import expand
from .occlusion import half_sphere
from .order_of_places import order_of_places, own_axes
from .saliency import unit_size

# Surfaces whose images lie this far from them, over the size, are still their own mirror images.
NEAR = 0.01
# Directions that are tried, spread over half of the sphere, beside the axes of space and of inertia.
DIRECTIONS = 200
# Candidates that are refined; they differ by more than a tenth of a right angle.
REFINED = 4
APART = np.cos(np.pi / 20)
# Points of the surface that nearest ones are looked up among, about and at most, and those that are looked up: to
# compare, and at last.
SAMPLES = 12_000
MOST_SAMPLES = 48_000
COMPARED = 250
PAIRED = 4000
# Images that lie farther from the surface, over its size, are not looked for any nearer where planes are compared:
# those of the best planes never do, and looking takes twice as long.
FAR = 0.08
# Points at a leaf of the tree that is asked for distances alone, which it is asked most often.
AT_LEAF = 30
# Samples near an image that are remembered: as long as it moves by little, its nearest one is among these.
REMEMBERED = 8
# Share of a distance that rounding leaves of it in any case.
SURE = 1 - 1e-9
# Sides of triangles are divided to the nearest number of cells, ties apart.
EVENLY = 0.5 - 1e-6
# Planes whose residuals differ by less are as good as each other.
EVEN = 0.1 * NEAR
# Share of the pairs that count.
KEPT = 0.85
# Rounds of pairing at most, for each candidate and for the best one, and the turn and shift that end them.
ROUNDS = 6
LAST_ROUNDS = 40
CONVERGED = 1e-7
# Against planes of bodies of revolution, of which any will do.
DAMPING = 1e-6
# Vertices this close to images of others, over the size, are pairs, and so many of all make a mirror of vertices.
PAIR = 1e-3
MOST_PAIRS = 0.9
# Where fewer than that have such a pair, vertices within this distance of the plane, over the extent, are in it.
IN_PLANE = 0.02
# What is flat is nearly its own image in the plane in which it lies: residuals are to be less than this share of the
# distances of the surface from the plane.
FLAT = 0.1


@dataclass(frozen=True)
class MirrorImages:
    """Mirror images of the vertices of a surface.

    Attributes
    ----------
    exact (n,) : the vertex on which the image of each lies, -1 where there is none
    nearest (n,) : the vertex nearest to the image of each
    in_plane (n,) bool : vertices that are their own images, or about
    are_exact : most have exact ones
    """

    exact: np.ndarray
    nearest: np.ndarray
    in_plane: np.ndarray
    are_exact: bool

    @staticmethod
    def of(image: np.ndarray) -> MirrorImages:
        """Those of vertices with exact images (n,), -1 where there is none."""
        own = np.arange(len(image))
        return MirrorImages(image, np.where(image >= 0, image, own), image == own, True)


@dataclass(frozen=True)
class SymmetryPlane:
    """A plane `normal @ x == offset` in which a surface is its own mirror image, exactly or nearly.

    Attributes
    ----------
    normal (3,), offset : of the plane, in the units of the surface
    residual : root mean square of the distances of the images from the surface, over its size (the diagonal of the box
        about a round body of the same spread); the farthest 15 % of the images do not count
    image (n,) : the vertex where the mirror image of a vertex lies, polygon by polygon; None where the mirror is not
        exact
    """

    normal: np.ndarray
    offset: float
    residual: float
    image: np.ndarray | None

    @property
    def is_exact(self) -> bool:
        """Whether every polygon is the image of one."""
        return self.image is not None

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (k,) of points (k,3) from the plane."""
        return points @ self.normal - self.offset

    def reflected(self, points: np.ndarray) -> np.ndarray:
        """Mirror images (k,3) of points (k,3)."""
        return points - 2 * self.distance(points)[:, None] * self.normal

    def carried(self, old: np.ndarray, new: np.ndarray) -> SymmetryPlane:
        """The plane where the same vertices (n,3), (n,3) are scaled and moved."""
        new, exponent = below_one(new)
        span = [2 * (p.max(axis=0) / 2 - p.min(axis=0) / 2) for p in (old, new)]
        k = int(span[0].argmax())
        scale = float(span[1][k] / span[0][k])
        offset = scale * self.offset + (new[0] - scale * old[0]) @ self.normal
        return replace(self, offset=float(np.ldexp(offset, exponent)))

    def nearest_images(self, positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For every vertex of a surface (n,3), (m,3) the one (n,) nearest to its image, and how far (n,) it lies.

        Vertices of no triangle are their own images, infinitely far.
        """
        image, far = np.arange(len(positions)), np.full(len(positions), np.inf)
        used = np.unique(triangles)
        # Squares of distances in a unit that is far too small or large are no numbers.
        places, exponent = below_one(positions[used])
        seen = np.ldexp(self.reflected(positions[used]), -exponent)
        if self.image is not None:
            image[used] = self.image[used]
            distance = np.linalg.norm(seen - np.ldexp(positions[image[used]], -exponent), axis=1)
        else:
            distance, found = cKDTree(places).query(seen)
            image[used] = used[found]
        far[used] = np.ldexp(distance, exponent)
        return image, far

    def images(self, positions: np.ndarray, triangles: np.ndarray) -> MirrorImages:
        """The images of the vertices of a surface (n,3), (m,3), as exact as they are."""
        image, far = self.nearest_images(positions, triangles)
        extent, used = float(np.ptp(positions[np.unique(triangles)], axis=0).max()), np.isfinite(far)
        is_exact = far <= PAIR * extent
        exact = np.where(is_exact, image, -1)
        if is_exact[used].mean() >= MOST_PAIRS:
            return replace(MirrorImages.of(exact), nearest=image)
        return MirrorImages(exact, image, np.abs(self.distance(positions)) <= IN_PLANE * extent, False)


def symmetry_plane(
    positions: np.ndarray,
    triangles: np.ndarray,
    faces: np.ndarray | None = None,
    near: float = NEAR,
    side: np.ndarray | None = None,
) -> SymmetryPlane | None:
    """The mirror plane of a surface (n,3), (m,3), an exact one before near ones; None if there is none.

    faces (m,): polygon of every triangle. near: greatest residual of the images over the size of the surface.
    side (3,): of near planes that are as good, the one most across it is taken, that of left and right.
    """
    used, compact = np.unique(triangles, return_inverse=True)
    compact = compact.reshape(-1, 3)
    corners = positions[used]
    mirror = find_mirror(corners, compact, faces)
    if mirror is not None:
        image = np.arange(len(positions))
        image[used] = used[mirror.image]
        return SymmetryPlane(mirror.normal, float(mirror.normal @ corners.mean(axis=0)), 0.0, image)
    return _near_plane(corners, compact, near, np.zeros(3) if side is None else side)


class _Samples:
    """Points (s,3) spread evenly over a surface, with the normals (s,3) of their faces.

    Places alone decide which they are: of a scan, samples drawn by chance turn the plane by half a degree.
    """

    def __init__(self, positions: np.ndarray, triangles: np.ndarray):
        areas = face_areas(positions, triangles)
        face, corners, area = _cells(areas)
        points = (corners[:, :, None] * positions[triangles[face]]).sum(axis=1)
        order = order_of_places(points, np.zeros((0, 3), np.int64))
        order = order[_evenly(area[order], MOST_SAMPLES)] if len(order) > MOST_SAMPLES else order
        self.points, self.normals = points[order], face_normals(positions, triangles)[face[order]]
        self.few, self.many = (self.points[_evenly(area[order], count)] for count in (COMPARED, PAIRED))
        self.spacing = float(np.sqrt(areas.sum() / SAMPLES))
        self.tree = cKDTree(self.points)
        self.quick = cKDTree(self.points, leafsize=AT_LEAF, compact_nodes=False)

    def distances(self, normal: np.ndarray, offset: float, near: _Nearest) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the images of the points (p,3) of `near`: distances (p,) from the surface, signed distances (p,) from the
        planes of the nearest samples, and the normals (p,3) of these planes.

        Samples lie apart, the surface does not: beside its plane an image may be as far from a sample as these are.
        """
        image = near.p - 2 * (near.p @ normal - offset)[:, None] * normal
        far, found = near.query(image)
        facing = self.normals[found]
        off = ((image - self.points[found]) * facing).sum(axis=1)
        beside = np.sqrt(np.maximum(far**2 - off**2, 0))
        return np.hypot(off, np.maximum(beside - self.spacing, 0)), off, facing

    def compared(
        self, normals: np.ndarray, offsets: np.ndarray, beyond: float = np.inf
    ) -> tuple[np.ndarray, np.ndarray]:
        """Trimmed root mean square (k,) of the distances of a few images in planes (k,3), (k,), where what is farther
        than `beyond` counts as that, and whether (k,) bool nothing of it was."""
        p = self.few
        image = p - 2 * (p @ normals.T - offsets).T[:, :, None] * normals[:, None]
        found = self.quick.query(image.reshape(-1, 3), distance_upper_bound=beyond)[0].reshape(len(normals), -1)
        worth, farthest = _trimmed(np.minimum(found, beyond))
        return worth, farthest < beyond

    def is_flat(self, normal: np.ndarray, offset: float, residual: float) -> bool:
        """Whether the samples lie in a plane, more or less, so that a small residual says nothing."""
        depth = float(np.sqrt(((self.points @ normal - offset) ** 2).mean()))
        return residual >= FLAT * depth


class _Nearest:
    """The samples nearest to images of points (p,3) that move from one round to the next, less and less.

    A few samples near each image are remembered, and how far off the last of them was: while the image has moved by
    less than what another one would have to, none but these can be the nearest.
    """

    def __init__(self, samples: _Samples, p: np.ndarray):
        self.p, self._tree, self._points = p, samples.tree, samples.points
        self._ranks = np.arange(1, min(REMEMBERED, len(self._points)) + 1)
        self._at, self._beyond = p.copy(), np.full(len(p), -np.inf)
        self._found = np.zeros((len(p), len(self._ranks)), np.int64)
        self._near = np.zeros((*self._found.shape, 3))

    def query(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance (p,) and number (p,) of the sample nearest to each image (p,3)."""
        x, y, z = ((image[:, None] - self._near) ** 2).transpose(2, 0, 1)
        squares = x + y + z
        best = squares.argmin(axis=1)
        of_each = np.arange(len(image)), best
        far, found = np.sqrt(squares[of_each]), self._found[of_each]
        away = np.flatnonzero(far + np.linalg.norm(image - self._at, axis=1) >= SURE * self._beyond)
        if len(away):
            distance, number = self._tree.query(image[away], self._ranks)
            self._at[away], self._beyond[away] = image[away], distance[:, -1]
            self._found[away], self._near[away] = number, self._points[number]
            far[away], found[away] = distance[:, 0], number[:, 0]
        return far, found


def _cells(areas: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles with areas (m,) divided into about `SAMPLES` like cells, and at least one each: the triangle (s,) of
    each, the weights (s,3) of its corners at the middle, and its area (s,)."""
    side = np.maximum((np.sqrt(areas * SAMPLES / areas.sum()) + EVENLY).astype(np.int64), 1)
    face, place = expand(side**2)
    k = side[face]
    # Row by row: 2 r + 1 cells in row r, every other of which stands on its head.
    row = np.sqrt(place).astype(np.int64)
    column = place - row**2
    turned = column % 2
    b = (column // 2 + (1 + turned) / 3) / k
    a = 1 - (row + (2 - turned) / 3) / k
    return face, np.column_stack([a, b, 1 - a - b]), areas[face] / k**2


def _evenly(areas: np.ndarray, count: int) -> np.ndarray:
    """Numbers (c,) of at most `count` cells with areas (s,), one for every like share of all."""
    below = np.cumsum(areas)
    return np.unique(np.searchsorted(below, below[-1] * (np.arange(count) + 0.5) / count).clip(max=len(areas) - 1))


def _trimmed(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root mean square (k,) of the least of the distances (k,c), and the greatest (k,) of these."""
    kept = np.sort(distance, axis=1)[:, : int(KEPT * distance.shape[1])]
    return np.sqrt((kept**2).mean(axis=1)), kept[:, -1]


def _near_plane(positions: np.ndarray, triangles: np.ndarray, near: float, side: np.ndarray) -> SymmetryPlane | None:
    """The best plane of a surface without an exact one; None if it is not good enough."""
    scaled = unit_size(positions, triangles)
    # In the frame of the body, so that its pose does not choose between planes that are as good.
    axes = own_axes(scaled)
    axes = np.eye(3) if axes is None else axes
    samples = _Samples(scaled @ axes, triangles)
    normals = np.concatenate([np.eye(3), _principal(samples.points), half_sphere(DIRECTIONS)])
    offsets = normals @ samples.points.mean(axis=0)
    side = side @ axes
    chosen = _chosen_among(samples, normals, offsets, side)
    found = [_refined(samples, normals[k], offsets[k], samples.few, ROUNDS) for k in chosen]
    found = [plane for plane in found if not samples.is_flat(*plane)]
    if not found:
        return None
    even = min(residual for *_, residual in found) + EVEN
    best = min(found, key=lambda plane: (plane[2] > even, -round(abs(plane[0] @ side), 2), plane[2]))
    normal, offset, residual = _refined(samples, *best[:2], samples.many, LAST_ROUNDS)
    if residual > near or samples.is_flat(normal, offset, residual):
        return None
    normal = axes @ normal
    sign = np.sign(normal[np.abs(normal).argmax()])
    normal, offset = sign * normal, sign * offset
    plane = _between_pairs(scaled, SymmetryPlane(normal, offset, residual, None))
    return plane.carried(scaled, positions)


def _between_pairs(positions: np.ndarray, plane: SymmetryPlane) -> SymmetryPlane:
    """The plane of a body of unit size, to the last digit if most vertices (n,3) have others as images.

    Polygons may be cut one-sidedly, so that these are no images of one another.
    """
    image, far = plane.nearest_images(positions, np.arange(len(positions))[:, None])
    pairs = (far <= PAIR) & (image[image] == np.arange(len(image)))
    if pairs.mean() < MOST_PAIRS:
        return plane
    a, b = positions[pairs], positions[image[pairs]]
    middle = (a + b).mean(axis=0) / 2
    # Of all planes through the middle, the one that takes a nearest to b.
    both = (a - middle).T @ (b - middle)
    normal = np.linalg.eigh(both + both.T)[1][:, 0]
    normal *= np.sign(normal @ plane.normal)
    return replace(plane, normal=normal, offset=float(normal @ middle))


def _principal(points: np.ndarray) -> np.ndarray:
    """Principal axes (3,3) of points (s,3), as rows."""
    moved = points - points.mean(axis=0)
    return np.linalg.eigh(moved.T @ moved)[1].T


def _chosen_among(samples: _Samples, normals: np.ndarray, offsets: np.ndarray, side: np.ndarray) -> list[int]:
    """The candidates `_chosen` by what all planes (k,3), (k,) are worth."""
    worth, is_known = samples.compared(normals, offsets, FAR)
    chosen = list(_chosen(normals, worth, side))
    if not is_known[chosen].all():
        # A better one may be among them: others are worth no less than what is known of them.
        rest = ~is_known
        worth[rest], _ = samples.compared(normals[rest], offsets[rest])
        chosen = list(_chosen(normals, worth, side))
    return chosen


def _chosen(normals: np.ndarray, worth: np.ndarray, side: np.ndarray) -> Iterator[int]:
    """The best candidates that are not close to a better one; of even ones, those most across `side` (3,) first."""
    left = np.lexsort((-np.abs(normals @ side), np.round(worth / EVEN)))
    for _ in range(REFINED):
        if not len(left):
            return
        yield int(left[0])
        left = left[np.abs(normals[left] @ normals[left[0]]) < APART]


def _refined(
    samples: _Samples, normal: np.ndarray, offset: float, p: np.ndarray, rounds: int
) -> tuple[np.ndarray, float, float]:
    """A plane after `rounds` of pairing the images of points (p,3) with the surface, and its residual.

    Gauss and Newton's steps on the distances of the images from the planes of their nearest points.
    """
    near = _Nearest(samples, p)
    for _ in range(rounds):
        far, off, facing = samples.distances(normal, offset, near)
        kept = far <= np.quantile(far, KEPT)
        depth = p @ normal - offset
        # An image moves by -2 (t @ p) n - 2 depth t when the normal turns by t, by 2 n per offset.
        tilt = np.linalg.svd(normal[None])[2][1:]
        across = (facing @ normal)[:, None]
        turning = -2 * across * (p @ tilt.T) - 2 * depth[:, None] * (facing @ tilt.T)
        slopes = np.column_stack([turning, 2 * across])[kept]
        squares = slopes.T @ slopes
        squares += (DAMPING * np.trace(squares) + np.finfo(float).tiny) * np.eye(3)
        step = -np.linalg.solve(squares, slopes.T @ off[kept])
        turned = normal + step[:2] @ tilt
        length = np.linalg.norm(turned)
        normal, offset = turned / length, float((offset + step[2]) / length)
        if np.abs(step).max() < CONVERGED:
            break
    return normal, offset, float(_trimmed(samples.distances(normal, offset, near)[0][None])[0][0])
