"""Find pairs of triangles of a mesh in space that pass through one another.

Candidates come from a tree of the triangles' centres, class by class of size. Two triangles intersect where an edge of
one passes through the other (Guigue, Devillers 2003 decide it by the same signed volumes); with a vertex in common,
where the side opposite to it does. Triangles with an edge in common, and those in one plane, are let pass.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

# Candidate pairs that are looked at together.
BLOCK = 400_000
# Signed volumes below this share of the sixth of a cube of the pair's size are zero.
FLAT = 1e-14


def intersecting_pairs(vertices: np.ndarray, triangles: np.ndarray, concerned: np.ndarray | None = None) -> np.ndarray:
    """Pairs (k,2) of triangles (m,3) of vertices (n,3) that intersect, sorted; only pairs with one that is `concerned`
    (m,) bool where this is given."""
    corner = np.asarray(vertices, float)[triangles]
    pairs = _candidates(corner, concerned)
    found = [
        pairs[k : k + BLOCK][_intersect(corner, triangles, pairs[k : k + BLOCK])] for k in range(0, len(pairs), BLOCK)
    ]
    result = np.concatenate(found) if found else np.zeros((0, 2), np.int64)
    return result[np.lexsort((result[:, 1], result[:, 0]))]


def _candidates(corner: np.ndarray, concerned: np.ndarray | None = None) -> np.ndarray:
    """Pairs (k,2), the smaller number first, of triangles (m,3,3) whose boxes overlap; see `intersecting_pairs`."""
    low, high = corner.min(axis=1), corner.max(axis=1)
    centre, radius = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2
    least = float(np.median(radius)) or 1.0
    level = np.maximum(np.ceil(np.log2(np.maximum(radius / least, 1e-9))), 0).astype(int)
    classes = [np.flatnonzero(level == k) for k in np.unique(level)]
    trees = [cKDTree(centre[c]) for c in classes]

    def between(mine: np.ndarray, other: np.ndarray, tree: cKDTree) -> np.ndarray:
        around = tree.query_ball_point(centre[mine], radius[mine] + radius[other].max())
        counts = np.array([len(a) for a in around], int)
        flat = np.concatenate([np.asarray(a, np.int64) for a in around]) if counts.sum() else np.zeros(0, np.int64)
        return _overlapping(np.stack([np.repeat(mine, counts), other[flat]], axis=1), low, high)

    if concerned is not None:
        mine = np.flatnonzero(concerned)
        found = [between(mine, other, tree) for other, tree in zip(classes, trees, strict=True)] if len(mine) else []
        pairs = np.sort(np.concatenate([np.zeros((0, 2), np.int64), *found]), axis=1)
        # Twice where both are concerned.
        return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    found = []
    for k, mine in enumerate(classes):
        near = trees[k].query_pairs(2 * radius[mine].max(), output_type="ndarray")
        found.append(_overlapping(mine[near], low, high))
        # Queries go out from the larger, which are the fewer.
        found += [between(mine, other, tree) for other, tree in zip(classes[:k], trees[:k], strict=True)]
    return np.sort(np.concatenate(found), axis=1)


def _overlapping(pairs: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Those of pairs (k,2) whose boxes, from low to high (m,3), overlap."""
    a, b = pairs[:, 0], pairs[:, 1]
    apart = np.zeros(len(pairs), bool)
    for k in range(3):
        apart |= (low[a, k] > high[b, k]) | (low[b, k] > high[a, k])
    return pairs[~apart]


def _intersect(corner: np.ndarray, triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Which of pairs (k,2) of triangles intersect, (k,) bool."""
    same = triangles[pairs[:, 0]][:, :, None] == triangles[pairs[:, 1]][:, None, :]
    common = same.sum(axis=(1, 2))
    result = np.zeros(len(pairs), bool)
    apart = np.flatnonzero(common == 0)
    result[apart] = _apart(corner[pairs[apart, 0]], corner[pairs[apart, 1]])
    touching = np.flatnonzero(common == 1)
    if len(touching):
        where = same[touching]
        a, b = corner[pairs[touching, 0]], corner[pairs[touching, 1]]
        # The common vertex first: then the side opposite to it is from 1 to 2.
        a, b = _turned(a, where.any(axis=2).argmax(axis=1)), _turned(b, where.any(axis=1).argmax(axis=1))
        result[touching] = _pierces(a[:, 1], a[:, 2], b) | _pierces(b[:, 1], b[:, 2], a)
    return result


def _turned(corner: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Corners (k,3,3) in cyclic order from number `first` (k,) on."""
    return np.take_along_axis(corner, ((first[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether triangles a and b (k,3,3) without a common vertex intersect."""
    result = np.zeros(len(a), bool)
    # Most pairs are told apart by the plane of one of the two.
    row = np.arange(len(a))
    for p, q in ((a, b), (b, a)):
        normal = np.cross(p[row, 1] - p[row, 0], p[row, 2] - p[row, 0])
        side = np.einsum("ki,kci->kc", normal, q[row] - p[row, :1])
        row = row[(side.min(axis=1) <= 0) & (side.max(axis=1) >= 0)]
    a, b = a[row], b[row]
    hit = np.zeros(len(row), bool)
    for k in range(3):
        hit |= _pierces(a[:, k], a[:, (k + 1) % 3], b) | _pierces(b[:, k], b[:, (k + 1) % 3], a)
    result[row] = hit
    return result


def _pierces(start: np.ndarray, end: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Whether segments from start to end (k,3) pass through triangles (k,3,3)."""
    size = np.abs(triangle - start[:, None]).max(axis=(1, 2)) + np.abs(end - start).max(axis=1)
    flat = FLAT * size**3
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    one = np.einsum("ki,ki->k", normal, start - triangle[:, 0])
    other = np.einsum("ki,ki->k", normal, end - triangle[:, 0])
    hit = ((one > flat) & (other < -flat)) | ((one < -flat) & (other > flat))
    # Few cross the plane, and where they do is asked of these alone.
    row = np.flatnonzero(hit)
    d, corner, flat = (end - start)[row], triangle[row] - start[row, None], flat[row, None]
    sides = np.stack([_volume(d, corner[:, k], corner[:, (k + 1) % 3]) for k in range(3)], axis=1)
    hit[row] = (sides > flat).all(axis=1) | (sides < -flat).all(axis=1)
    return hit


def _volume(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Signed volume (k,), six times, of the tetrahedra that vectors a, b, c (k,3) span."""
    return np.einsum("ki,ki->k", np.cross(a, b), c)
