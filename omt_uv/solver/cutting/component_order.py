"""Put a component in an order that the places of its vertices alone decide, and find the motion from one to another.

Ties between cuts are broken by numbers; so the order in which a file has its vertices and faces moves no seam.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..analysis.order_of_places import lowest_first, order_of_places
from ..mesh.geometry import cross3, lengths
from ..mesh.topology import are_among, halfedges, pair_keys

# Distance over the size up to which vertices of what is equal but for a motion lie upon one another.
SAME_PLACE = 1e-5
# Most motions that are tried for a pair.
TRIALS = 32


@dataclass(frozen=True)
class ComponentOrder:
    """A component in its order.

    Attributes
    ----------
    vertices (n,), rows (m,), pairs (e,) : which of the given vertices, triangles and pairs comes at each place
    triangles (m,3) : of the vertices in their order
    pair (e,2) : the two halfedges of every inner edge
    """

    vertices: np.ndarray
    rows: np.ndarray
    pairs: np.ndarray
    triangles: np.ndarray
    pair: np.ndarray


def in_order(points: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> ComponentOrder:
    """The order of a component (n,3), (m,3) with inner edges between halfedges (e,2), which no two pairs share."""
    tail, head = halfedges(triangles)
    order = order_of_places(points, triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    keys = pair_keys(place[tail[pair[:, 0]]], place[head[pair[:, 0]]])
    triangles = lowest_first(place[triangles])[0]
    rows = np.lexsort(triangles.T[::-1])
    triangles = triangles[rows]
    every = pair_keys(*halfedges(triangles))
    inner = np.flatnonzero(are_among(every, keys))
    return ComponentOrder(
        vertices=order,
        rows=rows,
        pairs=np.argsort(keys),
        triangles=triangles,
        pair=inner[np.argsort(every[inner], kind="stable")].reshape(-1, 2),
    )


@dataclass(frozen=True)
class Outlined:
    """Vertices (n,3), and the sides (k,2) of polygons between them, one for each polygon."""

    vertices: np.ndarray
    sides: np.ndarray

    @cached_property
    def distances(self) -> np.ndarray:
        """How far vertices are from their mean (n,), in order: no motion changes it."""
        # Squares of huge coordinates would be infinite.
        unit = float(np.abs(self.vertices).max()) or 1.0
        at = self.vertices / unit
        return np.sort(lengths(at - at.mean(axis=0))) * unit


def polygon_sides(triangles: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The sides (k,2) of triangles (m,3) that are no diagonals of their polygons (m,)."""
    faces = np.concatenate([faces] * 3)
    tail, head = (triangles[:, k].T.ravel() for k in ((0, 1, 2), (1, 2, 0)))
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    _, place, count = np.unique(np.stack([low, high, faces]), axis=1, return_inverse=True, return_counts=True)
    side = count[place.ravel()] == 1
    return np.column_stack([tail[side], head[side]])


def motion(first: Outlined, other: Outlined) -> tuple[np.ndarray, float] | None:
    """The vertex (n,) of the first for each of the other one's, if a motion takes one to the other, and 1.0, or -1.0 if
    it is a mirrored one; None if there is none. Vertices that lie upon one another are told by their sides.
    """
    n, sides_a, sides_b = len(first.vertices), first.sides, other.sides
    if n != len(other.vertices) or len(sides_a) != len(sides_b):
        return None
    if np.array_equal(first.vertices, other.vertices) and np.array_equal(sides_a, sides_b):
        return np.arange(n), 1.0
    # Squares of huge coordinates would be infinite.
    unit = float(max(np.abs(first.vertices).max(), np.abs(other.vertices).max())) or 1.0
    a, b = ((x.vertices / unit) - (x.vertices / unit).mean(axis=0) for x in (first, other))
    size = lengths(a).max()
    if not size > 0:
        return None
    if np.abs(first.distances - other.distances).max() > SAME_PLACE * first.distances[-1]:
        return None
    a, b = _with_neighbours(a, sides_a), _with_neighbours(b, sides_b)
    there = cKDTree(b / size)
    keys = np.sort(sides_b[:, 0] * n + sides_b[:, 1])
    start, trials = _beginnings(a, sides_a, b, sides_b, size)
    for end, sign in trials:
        rotation = _frame(b[end, :3], sign) @ _frame(a[start, :3]).T
        moved = np.concatenate([a[:, :3] @ rotation.T, a[:, 3:] @ rotation.T], axis=1) / size
        if not np.isfinite(moved).all():
            # Places in a row have no frame.
            continue
        off, at = there.query(moved, distance_upper_bound=2 * SAME_PLACE)
        if not np.isfinite(off).all() or len(np.unique(at)) < n:
            continue
        sides = at[sides_a if sign > 0 else sides_a[:, ::-1]]
        if np.array_equal(np.sort(sides[:, 0] * n + sides[:, 1]), keys):
            return np.argsort(at), sign
    return None


def _with_neighbours(x: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Points (n,3) with the mean of their neighbours along sides (k,2), (n,6)."""
    n, (tail, head) = len(x), sides.T
    both, of = np.concatenate([tail, head]), np.concatenate([head, tail])
    number = np.maximum(np.bincount(both, minlength=n), 1)
    around = np.stack([np.bincount(both, x[of, k], n) for k in range(3)], axis=1) / number[:, None]
    return np.concatenate([x, around], axis=1)


def _beginnings(a, sides_a, b, sides_b, size: float) -> tuple[np.ndarray, list[tuple[np.ndarray, float]]]:
    """A side of the first one that few others are like, and those of the other one that are, with the sign."""

    def figures(x, sides):
        p, q = x[sides[:, 0], :3], x[sides[:, 1], :3]
        return np.column_stack([lengths(v) for v in (p, q, p - q, cross3(p, q) / size)]) / size

    mine, theirs = figures(a, sides_a), figures(b, sides_b)
    # A frame needs a side that does not point to the centre.
    kinds, inverse, count = np.unique(np.round(mine, 4), axis=0, return_inverse=True, return_counts=True)
    count = np.where(kinds[:, 3] > 1e-2, count, len(mine) + 1)
    start = int(count[inverse.ravel()].argmin())
    trials: list[tuple[np.ndarray, float]] = []
    for sign, order in ((1.0, [0, 1, 2, 3]), (-1.0, [1, 0, 2, 3])):
        like = np.flatnonzero((np.abs(theirs[:, order] - mine[start]) < 4 * SAME_PLACE).all(axis=1))
        trials += [(sides_b[k][:: int(sign)], sign) for k in like[: TRIALS // 2]]
    return sides_a[start], trials


def _frame(points: np.ndarray, sign: float = 1.0) -> np.ndarray:
    """Axes (3,3), in columns, of two points (2,3) and the origin; sign : of the third. No numbers where they lie in a
    row."""
    with np.errstate(invalid="ignore", divide="ignore"):
        first = points[0] / np.linalg.norm(points[0])
        second = points[1] - (points[1] @ first) * first
        second = second / np.linalg.norm(second)
    return np.column_stack([first, second, sign * cross3(first, second)])
