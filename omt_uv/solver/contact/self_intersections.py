"""Find pairs of triangles of a mesh in space that pass through one another.

Candidates are triangles whose boxes overlap (`box_pairs`). Two triangles intersect where an edge of one passes through
the other (Guigue, Devillers 2003 decide it by the same signed volumes); with a vertex in common, where the side
opposite to it does. That is asked only around vertices whose triangles do not lie side by side when one looks along the
mean of their normals. Triangles with an edge in common, and those in one plane, are let pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..mesh.geometry import cross3
from ..mesh.topology import halfedges, pair_keys, paired
from .box_pairs import box_pairs

# Candidate pairs that are looked at together: their arrays stay in the cache.
BLOCK = 1 << 14
# Signed volumes below this share of the sixth of a cube of the pair's size are zero.
FLAT = 1e-14
# A fan lies side by side if normals lean from their mean by a cosine of more than this, and turns by less than a full
# turn and this.
LEANING = 1e-3
TURN = 2 * np.pi + 1e-3


def intersecting_pairs(vertices: np.ndarray, triangles: np.ndarray, concerned: np.ndarray | None = None) -> np.ndarray:
    """Pairs (k,2) of triangles (m,3) of vertices (n,3) that intersect, sorted; only pairs with one that is `concerned`
    (m,) bool where this is given."""
    return FaceCrossings(triangles).pairs(vertices, concerned)


@dataclass(frozen=True)
class FaceCrossings:
    """Triangles (m,3), at whatever positions, and what only depends on how they are connected."""

    triangles: np.ndarray

    @cached_property
    def _plain(self) -> np.ndarray:
        """Which vertices (n,) bool have one fan of triangles around them, the same side up."""
        tail, head = halfedges(self.triangles)
        n = int(self.triangles.max(initial=-1)) + 1
        keys = pair_keys(tail, head)
        order = np.argsort(keys)
        ordered = keys[order]
        first = np.r_[True, ordered[1:] != ordered[:-1]] if len(keys) else np.zeros(0, bool)
        edge = np.cumsum(first) - 1
        uses = np.bincount(edge)
        turns = np.bincount(edge, np.where(tail < head, 1, -1)[order])
        wrong = (uses > 2) | ((uses == 2) & (turns != 0))
        one, other = paired(ordered[first]).T
        plain = np.ones(n, bool)
        plain[one[wrong]] = plain[other[wrong]] = False
        # A fan that is open has an edge more than triangles; two of them are no single one.
        edges = np.bincount(one, minlength=n) + np.bincount(other, minlength=n)
        return plain & (edges - np.bincount(self.triangles.ravel(), minlength=n) <= 1)

    def pairs(self, vertices: np.ndarray, concerned: np.ndarray | None = None) -> np.ndarray:
        """See `intersecting_pairs`."""
        corner = np.asarray(vertices, float)[self.triangles]
        one, two, three = corner[:, 0], corner[:, 1], corner[:, 2]
        low, high = (f(f(one, two), three) for f in (np.minimum, np.maximum))
        pairs = box_pairs(low, high, concerned)
        apart, touching = self._apart_or_touching(corner, pairs)
        blocks = [apart[k : k + BLOCK] for k in range(0, len(apart), BLOCK)]
        found = [pairs[:0], *(rows[_apart(corner[rows[:, 0]], corner[rows[:, 1]])] for rows in blocks)]
        if len(touching):
            found.append(touching[_touching(corner, self.triangles, touching)])
        result = np.concatenate(found)
        return result[np.lexsort((result[:, 1], result[:, 0]))]

    def _apart_or_touching(self, corner: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (k,2) without a common vertex, and those with one around which triangles may overlap."""
        common = np.zeros(len(pairs), np.int8)
        shared = np.zeros(len(pairs), np.int64)
        columns = [np.ascontiguousarray(c) for c in self.triangles.T]
        for start in range(0, len(pairs), BLOCK):
            here = slice(start, start + BLOCK)
            one, other = pairs[here].T
            others = [column[other] for column in columns]
            for column in columns:
                vertex = column[one]
                for far in others:
                    same = vertex == far
                    common[here] += same
                    shared[here][same] = vertex[same]
        touching = np.flatnonzero(common == 1)
        return pairs[common == 0], pairs[touching[~self._side_by_side(corner, shared[touching])[shared[touching]]]]

    def _side_by_side(self, corner: np.ndarray, asked: np.ndarray) -> np.ndarray:
        """Of vertices (n,), those `asked` whose triangles do not overlap when one looks along the mean of their
        normals, so that they do not in space."""
        n = len(self._plain)
        near = np.zeros(n, bool)
        near[asked] = True
        rows = np.flatnonzero(near[self.triangles].any(axis=1))
        corner, around = corner[rows], self.triangles[rows]
        normal = cross3(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1)
        normal = normal / np.maximum(length, np.finfo(float).tiny)[:, None]
        flat = around.ravel()
        mean = np.stack([np.bincount(flat, np.repeat(normal[:, k], 3), n) for k in range(3)], axis=1)
        mean = mean / np.maximum(np.linalg.norm(mean, axis=1), np.finfo(float).tiny)[:, None]
        sound = self._plain & near
        total = np.zeros(n)
        for k in range(3):
            vertex = around[:, k]
            axis = mean[vertex]
            ahead, back = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
            lean = np.einsum("mi,mi->m", normal, axis)
            sound[vertex[~(lean > LEANING)]] = False
            along = np.einsum("mi,mi->m", ahead, back)
            along -= np.einsum("mi,mi->m", ahead, axis) * np.einsum("mi,mi->m", back, axis)
            total += np.bincount(vertex, np.arctan2(lean * length, along), n)
        return sound & (total < TURN)


def _touching(corner: np.ndarray, triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Which of pairs (k,2) of triangles with one common vertex intersect elsewhere."""
    where = triangles[pairs[:, 0]][:, :, None] == triangles[pairs[:, 1]][:, None, :]
    a, b = corner[pairs[:, 0]], corner[pairs[:, 1]]
    # The common vertex first: then the side opposite to it is from 1 to 2.
    a, b = _turned(a, where.any(axis=2).argmax(axis=1)), _turned(b, where.any(axis=1).argmax(axis=1))
    return _pierces(a[:, 1], a[:, 2], b) | _pierces(b[:, 1], b[:, 2], a)


def _turned(corner: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Corners (k,3,3) in cyclic order from number `first` (k,) on."""
    return np.take_along_axis(corner, ((first[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether triangles a and b (k,3,3) without a common vertex intersect."""
    result = np.zeros(len(a), bool)
    # Most pairs are told apart by the plane of one of the two.
    row = np.arange(len(a))
    for p, q in ((a, b), (b, a)):
        normal = cross3(p[row, 1] - p[row, 0], p[row, 2] - p[row, 0])
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
    normal = cross3(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
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
    return np.einsum("ki,ki->k", cross3(a, b), c)
