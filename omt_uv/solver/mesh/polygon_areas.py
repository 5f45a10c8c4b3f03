"""Measure the areas of polygons that come as triangles, whichever way they are cut.

In space the corners of a polygon need not lie in a plane, so that its area depends on the triangles. A quad has the
mean area of both its triangulations, any other polygon that of a fan around the mean of its corners, which knows no
diagonal either. Where the fan turns back on itself, as in deep concave polygons, its triangles count. Of a flat dart
one triangulation lies partly outside of it: what is turned there is taken off.
"""

from __future__ import annotations

import numpy as np

from .geometry import cross3, face_areas, lengths, part_by_part
from .topology import distinct

# Corners of a quad's four triangles: those of the diagonal given, then the others.
BOTH = np.array([[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]])
# Cosine between the normals of a quad and of a triangle of it, from which on the triangle counts less, and less than
# nothing where they are opposite: 26 degrees from there the quad is not flat, and no triangulation is outside of it.
TURNED = -0.9
# The largest triangle of what is so flat over all others: more than this.
FLAT = 0.7
# Sine, squared, of the angle by which a corner of a fan may turn inwards and count as straight.
STRAIGHT = -1e-9


def polygon_areas(positions: np.ndarray, triangles: np.ndarray, polygons: np.ndarray | None = None) -> np.ndarray:
    """Areas (m,) of triangles (m,3) of a surface (n,3), scaled so that those of every polygon sum to its area.

    polygons : (m,) the polygon of every triangle, any numbers; None where each is its own
    """
    area = face_areas(positions, triangles)
    if polygons is None:
        return area
    owner = distinct(polygons)[1]
    given = np.bincount(owner, area)
    if len(given) == len(owner):
        return area
    whole = given.copy()
    corners = quads(triangles, owner)
    whole[owner[corners[:, 0] // 3]] = quad_areas(positions, triangles.ravel()[corners])
    several = np.flatnonzero(np.bincount(owner)[owner] > 2)
    if len(several):
        fan, looks_out = _fans(positions, triangles[several], owner[several], len(whole))
        whole[looks_out] = fan[looks_out]
    return area * np.divide(whole, given, out=np.ones(len(whole)), where=(given > 0) & np.isfinite(given))[owner]


def quad_areas(positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Areas (q,) of quads (q,4) of a surface (n,3): the mean of both triangulations, flat darts as they are."""
    return part_by_part(lambda some: _quad_areas(positions, some), corners)


def _quad_areas(positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """`quad_areas` of all at once."""
    area = face_areas(positions, corners[:, BOTH].reshape(-1, 3)).reshape(-1, 4)
    total, largest = area.sum(axis=1), area.max(axis=1)
    # In a plane the largest triangle of a dart is as large as the others, of which one is turned, together.
    darts = np.flatnonzero(largest > FLAT * (total - largest))
    if len(darts):
        turned = _alignment(positions[corners[darts]])
        counted = np.where(turned < TURNED, 1 - 2 * (TURNED - turned) / (1 + TURNED), 1)
        total[darts] = (area[darts] * counted).sum(axis=1)
    return total / 2


def _alignment(points: np.ndarray) -> np.ndarray:
    """Cosines (q,4) between the normals of quads (q,4,3) and those of their triangles, as in BOTH."""
    # Halves first, so that nothing overflows; the extent, so that nothing vanishes.
    p = points / 2 - points[:, :1] / 2
    p /= np.maximum(np.abs(p).max(axis=(1, 2), keepdims=True), np.finfo(float).tiny)
    one, two, three = (p[:, BOTH[:, k]] for k in range(3))
    normal = cross3(two - one, three - one)
    own = normal[:, :2].sum(axis=1)
    size = lengths(normal) * lengths(own)[:, None]
    along = np.einsum("qtd,qd->qt", normal, own)
    return np.divide(along, size, out=np.ones_like(size), where=size > 0)


def quads(triangles: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Quads among the polygons (m,), counted from 0, of triangles (m,3): their corners (q,4), places in the m x 3 ones.

    The given diagonal goes from the first corner to the third. Quads come in the order of the polygons.
    """
    first, second = triangle_pairs(polygons)
    corners, joined = quad_corners(triangles, first, second)
    return corners[joined]


def triangle_pairs(polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (k,), (k,) of the triangles of polygons (m,), counted from 0, that have two."""
    size = np.bincount(polygons)
    order = np.argsort(polygons, kind="stable")
    start = (np.cumsum(size) - size)[size == 2]
    return order[start], order[start + 1]


def quad_corners(triangles: np.ndarray, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (k,4) of what pairs of triangles, rows (k,) and (k,), make; which (k,) bool have a side in common.

    Corners are places in the m x 3 of `triangles` (m,3); the common side goes from the first to the third.
    """
    found = part_by_part(lambda one, two: _corners_of_quads(triangles, one, two), first, second)
    return found[:, :4], found[:, 4] > 0


def _corners_of_quads(triangles: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Corners (k,4) and, in a fifth column, whether these have a side in common, of `quad_corners`."""
    one, two = triangles[first], triangles[second]
    shared = _among(one, two)
    # From the corner that the other triangle lacks.
    turn = ((~shared).argmax(axis=1)[:, None] + np.arange(3)) % 3
    one = np.take_along_axis(one, turn, axis=1)
    other = (~_among(two, one)).argmax(axis=1)
    two = np.take_along_axis(two, (other[:, None] + np.arange(3)) % 3, axis=1)
    joined = (shared.sum(axis=1) == 2) & (one[:, 1] == two[:, 2]) & (one[:, 2] == two[:, 1])
    # one = (a, b, d) and two = (c, d, b): the quad b, c, d, a.
    place = 3 * first[:, None] + turn
    return np.column_stack([place[:, 1], 3 * second + other, place[:, 2], place[:, 0], joined])


def _among(triangles: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Which corners (k,3) bool of triangles (k,3) are corners of the others (k,3), each of its own."""
    a, b, c = others.T
    return np.stack([(corner == a) | (corner == b) | (corner == c) for corner in triangles.T], axis=1)


def polygon_fans(
    vertices: np.ndarray, triangles: np.ndarray, owner: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fans in place of convex polygons of at least three triangles (m,3) of a surface (n,3).

    owner (m,): polygon of every triangle, counted from 0. Centres (k,3), the vertices from n on; triangles (t,3) of the
    fans, and the polygon (t,) of each.
    """
    several = np.bincount(owner, minlength=1)[owner] > 2
    triangles, owner, n = triangles[several], owner[several], len(vertices)
    tail, head = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    of_edge = np.repeat(owner, 3)
    key = (of_edge * n + np.minimum(tail, head)) * n + np.maximum(tail, head)
    _, where, count = np.unique(key, return_index=True, return_counts=True)
    sides = where[count == 1]
    # By polygon and tail: the side after the one that ends there.
    sides = sides[np.lexsort((tail[sides], of_edge[sides]))]
    tail, head, of_side = tail[sides], head[sides], of_edge[sides]
    start = of_side * n + tail
    after = np.searchsorted(start, of_side * n + head)
    sound = np.bincount(of_side, minlength=1) == np.bincount(owner, minlength=1) + 2
    after = np.minimum(after, len(start) - 1)
    broken = (start[after] != of_side * n + head) | (np.diff(start, prepend=-1) == 0)
    sound[of_side[broken]] = False
    label, index = np.unique(of_side, return_inverse=True)
    centre = np.stack([np.bincount(index, vertices[tail, k]) for k in range(3)], axis=1) / np.bincount(index)[:, None]
    p, q, r, c = vertices[tail], vertices[head], vertices[head[after]], centre[index]
    fan = cross3(q - c, p - c) * -1
    normal = np.stack([np.bincount(index, fan[:, k]) for k in range(3)], axis=1)[index]
    size = lengths(normal)
    ear = np.einsum("sd,sd->s", cross3(q - p, r - q), normal)
    flat = ear < STRAIGHT * size * lengths(q - p) * lengths(r - q)
    sound[of_side[flat | (np.einsum("sd,sd->s", fan, normal) <= 0)]] = False
    kept = sound[of_side]
    chosen = np.unique(index[kept])
    place = np.full(len(label), -1)
    place[chosen] = n + np.arange(len(chosen))
    return centre[chosen], np.column_stack([tail, head, place[index]])[kept], of_side[kept]


def _fans(positions, triangles, polygons, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Areas (p,) of fans around the centres of `count` polygons (m,); where (p,) bool all of a fan looks to one side.

    The fan goes along the sides that only one triangle of the polygon has.
    """
    of, tail, head = np.repeat(polygons, 3), triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    place = np.unique(of * np.int64(len(positions)) + tail, return_inverse=True)[1].reshape(-1, 3)
    ends = np.sort([place.ravel(), place[:, [1, 2, 0]].ravel()], axis=0)
    _, first, uses = np.unique(ends[0] * place.size + ends[1], return_index=True, return_counts=True)
    outline = first[uses == 1]
    of, tail, head = of[outline], tail[outline], head[outline]
    sides = np.bincount(of, minlength=count)
    centre = _sums(of, positions[tail], count) / np.maximum(sides, 1)[:, None]
    double = cross3(positions[tail] - centre[of], positions[head] - centre[of])
    normal = _sums(of, double, count)
    backward = np.bincount(of, np.einsum("ij,ij->i", double, normal[of]) < 0, count)
    return np.bincount(of, lengths(double) / 2, count), (sides > 2) & (backward == 0)


def _sums(rows: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sums (count,3) of values (k,3) by their rows (k,)."""
    return np.column_stack([np.bincount(rows, column, count) for column in values.T])
