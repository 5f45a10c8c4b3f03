"""Put vertices in an order that their places alone decide, along a Morton curve (Morton 1966).

Neighbours are near in memory, and what is solved in that order is the same to the last bit, in whatever order a file
has its vertices and faces.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import bounds, cross3, extents, of_corners

# Bits of each coordinate along a Morton curve, and the masks that spread them.
BITS = 21
MASKS = (0x1F00000000FFFF, 0x1F0000FF0000FF, 0x100F00F00F00F00F, 0x10C30C30C30C30C3, 0x1249249249249249)
OFF_BORDER = 0.123
# Relative difference of principal axes, and lopsidedness along them, by which they are told apart.
DISTINCT = 1e-3
# Extents of points from which on they are not summed as they are.
FAR = 2.0**26
# Steps in the extent of a chart by which places of triangles around vertices in one place are told apart.
SAME_MIDDLE = 1e9


def order_of_places(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The order (n,) of points (n,3); those in one place, as along a cut, go by where their triangles (m,3) are."""
    p, n = _in_own_frame(points), len(points)
    low, high = bounds(p)
    extent = max(float((high / 2 - low / 2).max()), float(np.finfo(float).tiny))
    # Off the borders of cells, where rounding would decide about vertices of a regular grid.
    cell = np.clip((p / 2 - low / 2) / extent * (2**BITS - 2) + OFF_BORDER, 0, 2**BITS - 1).astype(np.uint64)
    code = _spread(cell[:, 0]) | _spread(cell[:, 1]) << np.uint64(1) | _spread(cell[:, 2]) << np.uint64(2)
    order = np.argsort(code, kind="stable")
    same = code[order][1:] == code[order][:-1]
    tied = np.flatnonzero(np.append(same, False) | np.append(False, same))
    if len(tied):
        middle = of_corners(np.add, p.take(triangles, axis=0)) / 3 / 2 - low / 2
        flat = triangles.ravel()
        count = np.maximum(np.bincount(flat, minlength=n), 1)
        around = [np.bincount(flat, np.repeat(x, 3), n) / count for x in middle.T]
        # Sums in another order differ by rounding.
        keys = [np.round(x / extent * SAME_MIDDLE) for x in around]
        some = order[tied]
        order[tied] = some[np.lexsort((*(x[some] for x in keys), *p[some].T, code[some]))]
    return order


def own_axes(points: np.ndarray) -> np.ndarray | None:
    """The principal axes of points (n,3), the columns of a rotation (3,3); None where these are not told apart.

    They turn with the points: of two axes the sign is that of the third moments, the last one is across them.
    """
    centred = _centred(points)
    return None if centred is None else _axes(centred)


def _in_own_frame(points: np.ndarray) -> np.ndarray:
    """Points (n,3) along their principal axes, as they are where these are not told apart: a pose plays no part."""
    centred = _centred(points)
    axes = None if centred is None else _axes(centred)
    return points if centred is None or axes is None else centred @ axes


def _centred(points: np.ndarray) -> np.ndarray | None:
    """Points (n,3) about their mean, in units of their extent; None where they are in one place."""
    extent = float(extents(points / 2).max())
    if not extent > 0:
        return None
    # By a power of two, which rounds nothing: sums of huge coordinates are infinite.
    power = np.frexp(extent)[1]
    with np.errstate(over="ignore"):
        p = np.ldexp(points, -power)
        mean = p.mean(axis=0)
    if not np.abs(mean).max() < FAR:
        # The sum of what is so far away has lost the digits by which points differ, or is none.
        p = np.ldexp(points / 2 - points.min(axis=0) / 2, 1 - power)
        mean = p.mean(axis=0)
    return np.asarray((p - mean) / (2 * np.ldexp(extent, -power)))


def _axes(p: np.ndarray) -> np.ndarray | None:
    """`own_axes` of centred points (n,3)."""
    values, axes = np.linalg.eigh(p.T @ p / len(p))
    along = p @ axes
    skew = (along * along * along).mean(axis=0)
    if np.diff(values).min() < DISTINCT * values[-1] or np.sort(np.abs(skew))[1] < DISTINCT * values[-1] ** 1.5:
        return None
    axes = axes * np.where(skew < 0, -1, 1)
    # The least lopsided one is across the others: a mirror image of the points is no pose of them.
    k = int(np.abs(skew).argmin())
    axes[:, k] = cross3(axes[:, (k + 1) % 3], axes[:, (k + 2) % 3])
    return np.asarray(axes)


def _spread(x: np.ndarray) -> np.ndarray:
    """The bits of numbers (n,) below 2^21 with two zeros after each."""
    for shift, mask in zip((32, 16, 8, 4, 2), MASKS, strict=True):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x


def lowest_first(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m,3) from their lowest vertex on, and which corners (m,3) these were."""
    turn = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3 if len(triangles) else np.zeros((0, 3), np.int64)
    return np.take_along_axis(triangles, turn, axis=1), turn


def order_of_rows(*keys: np.ndarray) -> np.ndarray:
    """The stable ascending order (k,) of rows of integers >= 0, column (k,) by column, the first one first; what fits
    into one integer is compared at once.

    >>> order_of_rows(np.array([1, 0, 1]), np.array([2, 3, 1]))
    array([1, 2, 0])
    """
    packed, room = list[np.ndarray](), -1
    for key in keys:
        bits = int(key.max(initial=0)).bit_length()
        if bits > room:
            packed, room = [*packed, key.astype(np.int64)], 63 - bits
        else:
            packed[-1], room = packed[-1] << bits | key.astype(np.int64), room - bits
    return np.lexsort(packed[::-1])
