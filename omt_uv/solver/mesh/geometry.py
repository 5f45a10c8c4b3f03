"""Measure triangle meshes: lengths, angles, areas, normals, and the cotangent Laplacian (Pinkall, Polthier 1993)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.sparse import csr_matrix

# Least share of a triangle in the stiffness of an edge, for estimates: across obtuse corners edges would repel.
LEAST_STIFFNESS = 1e-3
# Rows of arrays that are worked on at a time, so few that what is computed from them stays in the cache.
CHUNK = 1 << 14
# Triangles whose gradients are kept: of more, the sides that make them, which take half of the memory.
KEPT_HATS = 1_200_000
FOURTH_POWERS = -260  # those of what is below two to this power are none: the squares of areas


def cross2(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """z component of the cross product of plane vectors (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def complex_cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The same of plane vectors (...) as complex numbers."""
    return a.real * b.imag - a.imag * b.real


def dot2(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar product of plane vectors (..., 2); several times faster than a sum along an axis of two."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def dot3(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar product of vectors in space (..., 3): the sum along the last axis to the bit, several times faster."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross3(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of vectors in space (..., 3) of one shape: `np.cross` to the bit, up to ten times as fast."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    (ax, ay, az), (bx, by, bz) = (tuple(x[..., k] for k in range(3)) for x in (a, b))
    np.subtract(ay * bz, az * by, out=found[..., 0])
    np.subtract(az * bx, ax * bz, out=found[..., 1])
    np.subtract(ax * by, ay * bx, out=found[..., 2])
    return found


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Euclidean lengths (...) of vectors (..., 2) or (..., 3): `np.linalg.norm` to the bit, several times faster."""
    return np.sqrt((dot2 if vectors.shape[-1] == 2 else dot3)(vectors, vectors))


def as_complex(points: np.ndarray) -> np.ndarray:
    """Points of the plane (n,2) as complex numbers (n,), gathered four times as fast: conj(a) b = a . b + i a x b."""
    return np.ascontiguousarray(points, dtype=float).view(complex)[:, 0]


def as_points(z: np.ndarray) -> np.ndarray:
    """Complex numbers (n,) as points of the plane (n,2)."""
    return z.view(float).reshape(-1, 2)


def in_parts(*arrays: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
    """Parts of arrays (k, ...), so small that what is computed from one of them stays in the cache."""
    count = len(arrays[0]) // CHUNK + 1
    return zip(*(np.array_split(a, count) for a in arrays), strict=True)


def part_by_part(function: Callable[..., np.ndarray], *arrays: np.ndarray) -> np.ndarray:
    """What a function makes of the rows of arrays (k, ...), a row (k, ...) each, some after the others: what it needs
    on the way stays in the cache, where that of all of them would take several times the memory of a large mesh.

    >>> part_by_part(lambda a, b: a + b, np.arange(3), np.ones(3))
    array([1., 2., 3.])
    """
    count = len(arrays[0])
    if count <= CHUNK:
        return function(*arrays)
    first = function(*(a[:CHUNK] for a in arrays))
    found = np.empty((count, *first.shape[1:]), first.dtype)
    found[:CHUNK] = first
    for begin in range(CHUNK, count, CHUNK):
        found[begin : begin + CHUNK] = function(*(a[begin : begin + CHUNK] for a in arrays))
    return found


def halfedge_lengths(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Length of every halfedge, (3m,), of positions (n,2) or (n,3)."""

    def sides(some):
        p = np.take(positions, some, axis=0)
        return lengths(np.roll(p, -1, axis=1) - p)

    return part_by_part(sides, triangles).ravel()


def places(points: np.ndarray) -> np.ndarray:
    """A number (n,), from 0 on, for each of points (n,d): the same where they lie on one another."""
    return np.unique(points + 0.0, axis=0, return_inverse=True)[1].ravel()  # -0.0 + 0.0 is 0.0


def bounds(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least and the greatest coordinates (d,) of points (n,d), one after the other: in a tenth of the time of all.

    >>> bounds(np.array([[0.0, 5.0], [2.0, 4.0]]))
    (array([0., 4.]), array([2., 5.]))
    """
    low, high = (np.array([of(column) for column in points.T]) for of in (np.min, np.max))
    return low, high


def extents(points: np.ndarray) -> np.ndarray:
    """How far points (n,d) reach along each axis, (d,): `np.ptp` along the first axis, in a tenth of its time."""
    low, high = bounds(points)
    return high - low


def bounding_box(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle (3,) and greatest extent of the bounding box of points (n,3).

    >>> bounding_box(np.array([[0.0, 0.0, 0.0], [2.0, 4.0, 1.0]]))
    (array([1. , 2. , 0.5]), 4.0)
    """
    low, high = bounds(points)
    # Halves first: the difference of two huge numbers may be infinite.
    return low / 2 + high / 2, 2 * float((high / 2 - low / 2).max())


def edge_lengths(positions: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Length (k,) of every edge (k,2) between positions (n,2) or (n,3)."""
    return lengths(np.take(positions, edges[:, 0], axis=0) - np.take(positions, edges[:, 1], axis=0))


def face_areas(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unsigned area of every triangle, (m,), of positions (n,3)."""

    def areas(some):
        x, y, z = _double_areas(positions, some)
        return 0.5 * np.sqrt(x * x + y * y + z * z)

    found = part_by_part(areas, triangles)
    points, exponent = below_one(positions) if found.max(initial=0.0) == 0 else (positions, 0)
    return np.ldexp(face_areas(points, triangles), 2 * exponent) if exponent < FOURTH_POWERS else found


def below_one(points: np.ndarray) -> tuple[np.ndarray, int]:
    """Points (n,d) divided by a power of two, which is exact, so that none has a coordinate of 1 or more, and the
    exponent: sums of what is near the greatest number would be beyond it."""
    exponent = int(np.frexp(np.abs(points).max(initial=0.0))[1])
    return np.ldexp(points, -exponent), exponent


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) of length one; 0 stays 0."""
    length = np.sqrt(np.einsum("...i,...i->...", v, v))[..., None]
    return v / np.where(length > 0, length, 1)


def turned_by(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Points (n,3) times axes (3,3); what is in one place stays so, as it would not in products of matrices, and what
    is nowhere does, too."""
    with np.errstate(invalid="ignore"):
        return points[:, :1] * axes[0] + points[:, 1:2] * axes[1] + points[:, 2:] * axes[2]


def plane_axes(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (m,3) in the planes of triangles of corners (m,3,3): along the first side, and across it."""
    side, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    first = unit(side)
    return first, unit(other - np.einsum("md,md->m", other, first)[:, None] * first)


def nearest_rotations(matrices: np.ndarray, mirrored: bool = False) -> np.ndarray:
    """The rotations (..., d, d) nearest to matrices (..., d, d), or the nearest of determinant -1 (Kabsch 1976).

    The one nearest to a sum of q p^T takes points p nearest to places q in the squares.
    """
    left, _, right = np.linalg.svd(matrices)
    sign = np.ones(left.shape[:-1])
    sign[..., -1] = np.sign(np.linalg.det(left @ right)) * (-1 if mirrored else 1)
    return (left * sign[..., None, :]) @ right


def affine_images(before: np.ndarray, after: np.ndarray, owner: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Images (k,3) of points (k,3) by the affine map of their cluster `owner` (k,) nearest to points `after` (k,3), by
    weights (k,); what lies in a plane, whose normal no point says anything about, turns along."""
    count = int(owner.max()) + 1
    total = np.bincount(owner, weight, count)

    def means(x):
        return np.stack([np.bincount(owner, weight * x[:, k], count) for k in range(3)], axis=1) / total[:, None]

    low, high = means(before), means(after)
    x, y = before - low[owner], after - high[owner]
    scale = np.sqrt(np.bincount(owner, weight * np.square(x).sum(axis=1), count) / total)
    products = [np.einsum("ki,kj->kij", weight[:, None] * z, x) for z in (x, y)]
    square, cross = (
        np.stack([np.bincount(owner, p[:, i, j], count) for i in range(3) for j in range(3)], axis=1).reshape(-1, 3, 3)
        for p in products
    )
    # A cluster of one place is only shifted.
    least = 1e-12 * float(np.square(before - before.mean(axis=0)).sum(axis=1).max()) or 1.0
    soft = (1e-3 * np.maximum(scale**2, least) * total)[:, None, None] * np.eye(3)
    rotation = nearest_rotations(cross)
    matrix = (cross + soft @ rotation) @ np.linalg.inv(square + soft)
    return high[owner] + np.einsum("kij,kj->ki", matrix[owner], x)


def face_normals(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (m,3) of triangles (m,3) of positions (n,3), 0 for a triangle without area."""
    return unit(np.stack(_double_areas(positions, triangles), axis=1))


def vertex_normals(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (n,3), the mean of those of the adjacent faces by area, 0 where they cancel."""
    flat, n = triangles.ravel(), len(positions)
    total = [np.bincount(flat, np.repeat(k, 3), n) for k in _double_areas(positions, triangles)]
    return unit(np.stack(total, axis=1))


def _double_areas(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates (m,) of normals as long as twice the areas."""
    x, y, z = np.take(positions.T, triangles.T, axis=1)
    a, b, c = x[1] - x[0], y[1] - y[0], z[1] - z[0]
    d, e, f = x[2] - x[0], y[2] - y[0], z[2] - z[0]
    return b * f - c * e, c * d - a * f, a * e - b * d


def signed_areas(uv: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Area of every triangle in the plane, (m,), positive when counter-clockwise, of uv (n,2)."""

    def areas(some):
        x, y = np.take(uv.T, some.T, axis=1)
        return 0.5 * ((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]))

    return part_by_part(areas, triangles)


def vertex_areas(positions: np.ndarray, triangles: np.ndarray, density: np.ndarray | None = None) -> np.ndarray:
    """A third of the adjacent face areas, times their density (m,) if given, per vertex, (n,)."""
    area = face_areas(positions, triangles)
    if density is not None:
        area = area * density
    return np.bincount(triangles.ravel(), np.repeat(area / 3, 3), len(positions))


def angles_from_lengths(length: np.ndarray) -> np.ndarray:
    """Angle opposite to halfedge k of every triangle, (m,3), of side lengths (m,3).

    Half-angle formula; where the triangle inequality fails the angles are extended by pi opposite
    to the too long side and 0 elsewhere (Springborn, Schroeder, Pinkall 2008, section 3.2), which keeps
    the Yamabe energy convex and differentiable.
    """
    a, b, c = length.T
    d = np.stack([b + c - a, c + a - b, a + b - c], axis=1)
    total = (a + b + c)[:, None]
    d = np.maximum(d, 0)
    numerator = np.sqrt(d[:, [1, 2, 0]] * d[:, [2, 0, 1]])
    return 2 * np.arctan2(numerator, np.sqrt(total * d))


def least_angles(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The least angle of every triangle, (m,) in radians, of positions (n,2) or (n,3)."""
    return angles_from_lengths(halfedge_lengths(positions, triangles).reshape(-1, 3)).min(axis=1)


def cotangents_from_lengths(length: np.ndarray) -> np.ndarray:
    """Cotangent of the angle opposite to halfedge k, (m,3); zero where the triangle is degenerate."""
    a, b, c = length.T
    squared = length**2
    product = (a + b + c) * np.maximum(b + c - a, 0) * np.maximum(c + a - b, 0) * np.maximum(a + b - c, 0)
    four_area = np.sqrt(product)
    numerator = squared.sum(axis=1)[:, None] - 2 * squared
    safe = four_area > 1e-14 * of_corners(np.maximum, squared)
    return np.where(safe[:, None], numerator / np.where(safe, four_area, 1)[:, None], 0)


def laplacian_from_weights(tail: np.ndarray, head: np.ndarray, stiffness: np.ndarray, n: int) -> csr_matrix:
    """Positive semidefinite graph Laplacian (n,n) of edges tail, head (e,) of this stiffness (e,); pairs may repeat."""
    degree = np.bincount(tail, stiffness, n) + np.bincount(head, stiffness, n)
    rows, columns = np.concatenate([tail, head, np.arange(n)]), np.concatenate([head, tail, np.arange(n)])
    return csr_matrix((np.concatenate([-stiffness, -stiffness, degree]), (rows, columns)), shape=(n, n))


def cotangent_laplacian(positions: np.ndarray, triangles: np.ndarray) -> csr_matrix:
    """Positive semidefinite cotangent Laplacian (n,n), entries -(cot + cot) / 2 (Pinkall, Polthier 1993)."""
    return laplacian_from_lengths(halfedge_lengths(positions, triangles).reshape(-1, 3), triangles, len(positions))


def laplacian_from_lengths(
    length: np.ndarray, triangles: np.ndarray, n: int, least: float = -np.inf, most: float = np.inf
) -> csr_matrix:
    """The same (n,n) of side lengths (m,3) of triangles (m,3), what each adds to a stiffness kept in bounds."""
    # The angle opposite to halfedge k is the one at vertex k + 2.
    stiffness = np.clip(0.5 * cotangents_from_lengths(length), least, most)
    return laplacian_from_weights(triangles.ravel(), triangles[:, [1, 2, 0]].ravel(), stiffness.ravel(), n)


def angle_defects(triangles: np.ndarray, angles: np.ndarray, boundary: np.ndarray, n: int) -> np.ndarray:
    """Curvature per vertex, (n,) in radians: 2 pi (pi on the boundary (b,)) minus the angles around it.

    `angles` (m,3) holds the angle *opposite* to halfedge k, which lies at vertex k + 2.
    """
    around = np.bincount(triangles[:, [2, 0, 1]].ravel(), angles.ravel(), n)
    flat = np.full(n, 2 * np.pi)
    flat[boundary] = np.pi
    return flat - around


def of_corners(of: np.ufunc, rows: np.ndarray) -> np.ndarray:
    """What `of.reduce` makes of the three entries (m,3,...) of each row: that takes six times as long.

    >>> of_corners(np.maximum, np.array([[1, 3, 2], [6, 4, 5]]))
    array([3, 6])
    """
    return of(of(rows[:, 0], rows[:, 1]), rows[:, 2])


def hat_gradients(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Areas (m,) of triangles (m,3) and the gradients (m,3) complex of their hat functions, in their own planes."""
    sides = _sides_of(positions, triangles)
    return _areas_of(sides), part_by_part(gradients_of, sides)


def hat_areas(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The areas (m,) that `hat_gradients` has."""
    return _areas_of(_sides_of(positions, triangles))


class Sides:
    """What `gradients_of` makes the gradients of hat functions of, sides (m,3) of triangles (m,3) with corners at
    (n,3). They are let go while other things take all memory there is, and found again, to the bit, when asked for."""

    def __init__(self, positions: np.ndarray, triangles: np.ndarray, sides: np.ndarray):
        self._mesh = positions, triangles
        self._sides: np.ndarray | None = sides

    def __len__(self) -> int:
        """How many triangles these are of."""
        return len(self._mesh[1])

    def gradient(self, here: slice | np.ndarray) -> np.ndarray:
        """The gradients (k,3) complex of some triangles."""
        return gradients_of(self._found()[here])

    def areas(self, here: slice | np.ndarray) -> np.ndarray:
        """The areas (k,) of some triangles."""
        return _areas_of(self._found()[here])

    def let_go(self) -> None:
        """Hold nothing until it is asked for."""
        self._sides = None

    def _found(self) -> np.ndarray:
        if self._sides is None:
            self._sides = _sides_of(*self._mesh)
        return self._sides


class Sizes:
    """Of the last triangles of some sides, four to each of q quads: their areas over those of the quads, whole (q,),
    found when asked for."""

    def __init__(self, sides: Sides, whole: np.ndarray):
        self._sides, self._whole = sides, whole

    def __getitem__(self, some: slice | np.ndarray) -> np.ndarray:
        """Of some quads, a slice or (q,) bool, (k,4)."""
        first, quads = len(self._sides) - 4 * len(self._whole), np.arange(len(self._whole))[some]
        rows: slice | np.ndarray = (first + 4 * quads[:, None] + np.arange(4)).ravel()
        if isinstance(some, slice) and len(quads) and some.step in (None, 1):
            # Those that follow each other are not copied.
            rows = slice(first + 4 * quads[0], first + 4 * quads[-1] + 4)
        return self._sides.areas(rows).reshape(-1, 4) / self._whole[some, None]


class LastAnswer:
    """What was found of the last map (n,) that somebody asked about: what comes after a step asks for it five times."""

    def __init__(self) -> None:
        self._about: tuple[object, ...] = ()
        self._map, self._found = np.zeros(0), (np.zeros(0), np.zeros(0))

    def of(
        self, find: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], w: np.ndarray, *about: object
    ) -> tuple[np.ndarray, np.ndarray]:
        """find(w), not to be written to, which hangs on these objects besides.

        >>> last = LastAnswer()
        >>> last.of(lambda w: (w, 2 * w), np.ones(1))[1] is last.of(lambda w: (w, w), np.ones(1))[1]
        True
        """
        same = len(about) == len(self._about) and all(a is b for a, b in zip(about, self._about, strict=True))
        if not (same and np.array_equal(self._map, w)):
            self._about, self._map, self._found = about, w.copy(), find(w)
            for part in self._found:
                part.flags.writeable = False
        return self._found


def kept_sizes(hats: np.ndarray | Sides, area: np.ndarray, whole: np.ndarray) -> np.ndarray | Sizes:
    """Areas (q,4) over whole ones (q,), or what makes these where the triangles are many."""
    return Sizes(hats, whole) if isinstance(hats, Sides) else area / whole[:, None]


def kept_hats(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray | Sides]:
    """Areas (m,) of triangles (m,3), and their gradients (m,3), or what makes these where they are many."""
    if len(triangles) <= KEPT_HATS:
        return hat_gradients(positions, triangles)
    sides = _sides_of(positions, triangles)
    return _areas_of(sides), Sides(positions, triangles, sides)


def _sides_of(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """`_sides` of triangles (m,3)."""
    return part_by_part(lambda some: _sides(positions[some]), triangles)


def _areas_of(sides: np.ndarray) -> np.ndarray:
    """Areas (m,) of triangles with these sides (m,3), see `_sides`."""
    return 0.5 * sides[:, 0] * sides[:, 2]


def _sides(p: np.ndarray) -> np.ndarray:
    """How long the first side of triangles with corners (m,3,3) is, and where the third corner is seen along it and
    across, (m,3)."""
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    side = lengths(e1)
    # Where its ends lie on one another the first side is as short as the third corner is low where that lies on it.
    lost = side == 0
    if lost.any():
        far = lengths(e2[lost])
        side[lost] = 1e-9 * np.where(far > 0, far, 1)
    x = np.einsum("md,md->m", e2, e1) / side
    y = lengths(cross3(e1, e2)) / side
    y = np.maximum(y, 1e-9 * np.maximum(side, np.abs(x)))
    if lost.any():
        y[lost] = np.maximum(far, y[lost])
    return np.stack([side, x, y], axis=1)


def gradients_of(sides: np.ndarray) -> np.ndarray:
    """Gradients (m,3) complex of the hat functions of triangles with these sides (m,3), see `_sides`: the opposite
    side, turned by a quarter, over twice the area."""
    side, x, y = sides.T
    per, found = 1 / (2 * _areas_of(sides)), np.empty(sides.shape, complex)
    for k, (across, along) in enumerate(((-y, x - side), (y, -x), (0.0, side))):
        found.real[:, k], found.imag[:, k] = across * per, along * per
    return found
