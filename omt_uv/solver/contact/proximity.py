"""Find what is close on a mesh in space: vertices to triangles, and edges to edges, that have no vertex in common.

Two triangles are as far apart as the nearest of these (Moller 1997; Ericson 2005, sections 5.1.5 and 5.1.9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.closest_point import closest_on_triangles
from ..mesh.topology import pair_keys, paired
from .box_pairs import box_pairs

# Edges whose squared sine is less are parallel: every place along them is as close.
PARALLEL = 1e-12


@dataclass(frozen=True)
class ClosePairs:
    """Four vertices (k,4) of each pair: first a vertex and the triangle that it is close to, `points` times, then two
    and two of edges."""

    corners: np.ndarray
    points: int

    def among(self, chosen: np.ndarray) -> ClosePairs:
        """Those that are `chosen` (k,) bool."""
        return ClosePairs(self.corners[chosen], int(chosen[: self.points].sum()))

    def joined(self, others: ClosePairs) -> ClosePairs:
        """These and others."""
        parts = [
            self.corners[: self.points],
            others.corners[: others.points],
            self.corners[self.points :],
            others.corners[others.points :],
        ]
        return ClosePairs(np.concatenate(parts), self.points + others.points)

    def offsets(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ways (k,3) between the closest points of each pair at vertices (n,3), and the weights (k,4) of its corners
        in them."""
        corner = vertices[self.corners]
        face, edge = corner[: self.points], corner[self.points :]
        within = closest_on_triangles(face[:, 0], face[:, 1], face[:, 2], face[:, 3])
        one, other = _along(edge[:, 0], edge[:, 1], edge[:, 2], edge[:, 3])
        weights = np.concatenate(
            [
                np.column_stack([np.ones(self.points), -within]),
                np.stack([1 - one, one, other - 1, -other], axis=1),
            ]
        )
        return np.einsum("kc,kci->ki", weights, corner), weights


def close_pairs(
    vertices: np.ndarray, triangles: np.ndarray, reach: float, moved: np.ndarray | None = None
) -> ClosePairs:
    """Pairs among triangles (m,3) of vertices (n,3): all that are closer than `reach`, and some that are farther; only
    those with a vertex that has `moved` (n,) bool where this is given."""
    moved = np.ones(len(vertices), bool) if moved is None else moved
    corner = vertices[triangles]
    used = np.unique(triangles)
    low = np.concatenate([vertices[used], corner.min(axis=1) - reach])
    high = np.concatenate([vertices[used], corner.max(axis=1) + reach])
    first = np.arange(len(low)) < len(used)
    everything = moved[used].all()
    asked = first if everything else np.concatenate([moved[used], moved[triangles].any(axis=1)])
    found = box_pairs(low, high, asked)
    found = found[first[found[:, 0]] & ~first[found[:, 1]]]
    vertex, face = used[found[:, 0]], triangles[found[:, 1] - len(used)]
    apart = (face != vertex[:, None]).all(axis=1)
    faces = np.column_stack([vertex, face])[apart]
    ends, _ = _edges(triangles)
    start, end = vertices[ends[:, 0]], vertices[ends[:, 1]]
    asked = None if everything else moved[ends].any(axis=1)
    crossed = box_pairs(np.minimum(start, end) - reach / 2, np.maximum(start, end) + reach / 2, asked)
    one, other = ends[crossed[:, 0]], ends[crossed[:, 1]]
    apart = (one[:, :, None] != other[:, None, :]).all(axis=(1, 2))
    return ClosePairs(np.concatenate([faces, np.concatenate([one, other], axis=1)[apart]]), len(faces))


def triangle_distances(vertices: np.ndarray, triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """How far apart (k,) pairs (k,2) of triangles (m,3) of vertices (n,3) are that do not intersect; with a common
    vertex, what of them is without it."""
    if not len(pairs):
        return np.zeros(0)
    one, other = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    count, corner = len(pairs), np.arange(3)
    faces = [np.column_stack([a[:, c], b]) for a, b in ((one, other), (other, one)) for c in corner]
    sides = [
        np.stack([one[:, a], one[:, (a + 1) % 3], other[:, b], other[:, (b + 1) % 3]], axis=1)
        for a in corner
        for b in corner
    ]
    every, points = np.concatenate(faces + sides), len(faces) * count
    length = np.linalg.norm(ClosePairs(every, points).offsets(vertices)[0], axis=1)
    mine, theirs = every[:, :2].copy(), every[:, 1:].copy()
    mine[:points, 1], theirs[points:, 0] = mine[:points, 0], theirs[points:, 1]
    common = (mine[:, :, None] == theirs[:, None, :]).any(axis=(1, 2))
    return np.where(common, np.inf, length).reshape(-1, count).min(axis=0)


def _edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends (e,2) of edges of triangles (m,3), and the edge (m,3) from each corner to the next."""
    keys = pair_keys(triangles.ravel(), np.roll(triangles, -1, axis=1).ravel())
    used, edge = np.unique(keys, return_inverse=True)
    return paired(used), edge.reshape(triangles.shape)


def _along(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far (k,) from 0 to 1 along edges from a to b and from c to d (k,3) their closest points are."""
    u, v, way = b - a, d - c, a - c
    uu, vv, uv = (np.einsum("ki,ki->k", x, y) for x, y in ((u, u), (v, v), (u, v)))
    uw, vw = np.einsum("ki,ki->k", u, way), np.einsum("ki,ki->k", v, way)
    sine = uu * vv - uv * uv
    tiny = np.finfo(float).tiny
    one = np.where(sine > PARALLEL * uu * vv, (uv * vw - uw * vv) / np.maximum(sine, tiny), 0.5).clip(0, 1)
    free = (uv * one + vw) / np.maximum(vv, tiny)
    other = free.clip(0, 1)
    return np.where(free == other, one, ((uv * other - uw) / np.maximum(uu, tiny)).clip(0, 1)), other
