"""Solve the linear least squares problem of a fit: distances vanish along the lines between pairs of closest points.

Vertices stay near the centroids of their cells meanwhile, and triangles in shape (Hoppe, DeRose, Duchamp, McDonald,
Stuetzle 1993; distances along lines, as in Chen, Medioni 1992).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...linalg.sparse import conjugate_gradients
from ...mesh.geometry import face_normals, vertex_normals
from ...mesh.topology import halfedges
from .closest_pairs import ClosestPairs
from .shape_terms import Fairness, equilateral, smallness

# Weight of even displacements next to the distances,
FAIRNESS = 0.02
# of the centroids along the surface,
CENTROID = 0.35
# and of no displacement at all.
STILLNESS = 1e-3
# Distances of this many times the root of their mean square count double,
FAR = 3.0
# and farther ones up to 1 + this squared times.
FARTHEST = 3.0
# Factor by which the centroid's weight rises, besides 1, where angles are small.
SMALL_ANGLES = 3.0
# It falls by half where a point around is so many times the usual distance away: to come closer to a crest, vertices
# have to slide onto it;
EASY = 6.0
# and down to this share.
EASIEST = 0.05
# Relative residual of the moves.
TOLERANCE = 1e-4
# Where the entries of a symmetric matrix (3,3) are in a list of the six that differ.
SYMMETRIC = ((0, 1, 2), (1, 3, 4), (2, 4, 5))


@dataclass(frozen=True)
class DistanceWeighting:
    """How distances count: below `close` they have no direction but the normal's, many times `rms` they weigh more, and
    centroids less, unless `keep_centroids`."""

    close: float
    rms: float
    keep_centroids: bool = False


def displacements(
    points: np.ndarray,
    triangles: np.ndarray,
    twin: np.ndarray,
    fixed: np.ndarray,
    pairs: ClosestPairs,
    to_centroid: np.ndarray,
    weighting: DistanceWeighting,
) -> np.ndarray:
    """Moves (n,3) of the vertices of a mesh (n,3), (m,3), but for the `fixed` (n,) bool, that bring pairs together.

    twin (3m,): opposite halfedges; to_centroid (n,3): from every vertex to the centroid of its cell
    """
    n, normals = len(points), vertex_normals(points, triangles)
    along = np.eye(3) - normals[:, :, None] * normals[:, None]
    bad = smallness(points, triangles)
    centroid_weight = CENTROID * (1 + SMALL_ANGLES * _largest_around(triangles, bad, n))
    if not weighting.keep_centroids:
        centroid_weight *= _eased(triangles, pairs, weighting.rms, n)
    diagonal, between, right = _distances(triangles, n, pairs, face_normals(points, triangles), weighting)
    forces = equilateral(points, triangles, bad)
    # Shapes change along the surface alone.
    tail, head = halfedges(triangles)
    tense = np.flatnonzero(forces.between)
    between = np.stack([between, between])
    there = forces.between[tense, None, None] * (along[tail[tense]] @ along[head[tense]])
    between[:, tense] += np.stack([there, there.transpose(0, 2, 1)])
    diagonal += (centroid_weight + forces.diagonal)[:, None, None] * along + STILLNESS * np.eye(3)
    right += np.einsum("nij,nj->ni", along, centroid_weight[:, None] * to_centroid + forces.force)
    system = _matrix(triangles, twin, diagonal, between)
    even, free = Fairness(triangles, twin, n), np.repeat(~fixed, 3)

    def times(x):
        return free * (system @ x + FAIRNESS * even(x.reshape(n, 3)).ravel())

    near = np.linalg.inv(diagonal + FAIRNESS * even.diagonal[:, None, None] * np.eye(3))
    inverse = sp.bsr_matrix((near, np.arange(n), np.arange(n + 1)))
    return conjugate_gradients(times, free * right.ravel(), inverse, TOLERANCE).reshape(n, 3)


def _distances(
    triangles: np.ndarray, n: int, pairs: ClosestPairs, normals: np.ndarray, weighting: DistanceWeighting
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the pairs' squared distances, the blocks (n,3,3) of their matrix on the diagonal and (3m,3,3) at halfedges,
    and the right side (n,3)."""
    direction = pairs.offset / np.maximum(pairs.distance, 1e-300)[:, None]
    near = np.flatnonzero(pairs.distance < weighting.close)
    direction[near] = normals[pairs.faces[near]]
    weight = pairs.weight * (1 + np.minimum(pairs.distance / (FAR * weighting.rms), FARTHEST) ** 2)
    off = weight * np.einsum("ki,ki->k", direction, pairs.offset)
    u = np.ascontiguousarray(direction.T)
    # Of every pair the entries of its square, and its pull.
    entries = [weight * u[i] * u[j] for i in range(3) for j in range(i, 3)]
    square = _sums_by_triangle(len(triangles), pairs, entries, _corner_products)
    pull = _sums_by_triangle(len(triangles), pairs, off * u, np.ascontiguousarray)
    flat, own = triangles.ravel(), slice(pairs.sample_count + pairs.place_count, None)
    # A vertex pulls at itself alone, and has one pair, in the order of vertices.
    corners = [np.bincount(flat, a[:3].T.ravel(), n) + entry[own] for a, entry in zip(square, entries, strict=True)]
    right = [np.bincount(flat, a.T.ravel(), n) + entry[own] for a, entry in zip(pull, off * u, strict=True)]
    between = np.stack([a[3:].T.ravel() for a in square], axis=1)
    return np.stack(corners, axis=1)[:, SYMMETRIC], between[:, SYMMETRIC], np.stack(right, axis=1)


def _corner_products(b: np.ndarray) -> np.ndarray:
    """Products (6,k) of barycentric coordinates (3,k): of each corner's with itself, and with the next one's."""
    return np.concatenate([b * b, b * b[[1, 2, 0]]])


def _sums_by_triangle(
    m: int, pairs: ClosestPairs, entries: Iterable[np.ndarray], factors: Callable[[np.ndarray], np.ndarray]
) -> list[np.ndarray]:
    """Of every one of the entries (k,) of the pairs, but for those of vertices, sums (p,m) over each of m triangles,
    times p `factors` that are made of barycentric coordinates (3,k)."""
    s, q = pairs.sample_count, pairs.place_count
    face, weights = pairs.faces[:s], factors(pairs.barycentric[:s].T)
    # All triangles have pairs at the same places.
    places = factors(pairs.barycentric[s : s + q // m].T)
    found = []
    for entry in entries:
        sums = places @ entry[s : s + q].reshape(m, -1).T
        for k, weight in enumerate(weights):
            sums[k] += np.bincount(face, weight * entry[:s], m)
        found.append(sums)
    return found


def _matrix(triangles: np.ndarray, twin: np.ndarray, diagonal: np.ndarray, between: np.ndarray) -> sp.bsr_matrix:
    """The matrix (3n,3n) with blocks (n,3,3) on the diagonal, and between the ends of the edges the sums of those of
    their halfedges, from tail to head and back (2,3m,3,3)."""
    n, (tail, head) = len(diagonal), halfedges(triangles)
    inner, boundary = np.flatnonzero(twin >= 0), np.flatnonzero(twin < 0)
    there = between[0]
    there[inner] += between[1, twin[inner]]
    rows = np.concatenate([np.arange(n), tail, head[boundary]])
    columns = np.concatenate([np.arange(n), head, tail[boundary]])
    # Numbers of two bytes are sorted by their digits, in a tenth of the time.
    order = np.argsort(rows.astype(np.min_scalar_type(n)), kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))])
    blocks = np.concatenate([diagonal, there, between[1, boundary]])
    return sp.bsr_matrix((blocks[order], columns[order], first), shape=(3 * n, 3 * n))


def _eased(triangles: np.ndarray, pairs: ClosestPairs, rms: float, n: int) -> np.ndarray:
    """Share of the centroid's weight that is left at every vertex, (n,)."""
    farthest = _largest_around(triangles, pairs.largest_distance(len(triangles)), n) / rms
    return np.maximum(1 / (1 + (farthest / EASY) ** 2), EASIEST)


def _largest_around(triangles: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """The largest of the values (m,) of the triangles around every vertex, (n,)."""
    largest = np.zeros(n)
    np.maximum.at(largest, triangles.ravel(), np.repeat(values, 3))
    return largest
