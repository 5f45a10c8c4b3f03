"""Tell triangles that newly pass through one another from those that did before."""

from __future__ import annotations

import numpy as np

from .proximity import triangle_distances
from .self_intersections import FaceCrossings

# Triangles that were closer than this share of their longest side touched: what has no distance is kept apart by
# nothing but luck of rounding, and an exact test calls it an intersection.
TOUCHING = 1e-9


class NewCrossings:
    """Tells pairs of triangles that newly intersect from those that did at `before` (n,3), of which it looks for no
    more than it is asked about."""

    def __init__(self, before: np.ndarray, faces: FaceCrossings) -> None:
        """Nothing is known yet about which triangles intersect at positions `before` (n,3)."""
        self.before, self.faces = before, faces
        self._asked = np.zeros(len(before), bool)
        self._old = np.zeros(0, np.int64)

    def pairs(self, after: np.ndarray, concerned: np.ndarray | None = None) -> np.ndarray:
        """Pairs (k,2) that intersect at positions `after` (n,3), and neither did before nor had neighbours that did: a
        line along which parts meet moves on from face to face. Only pairs with a triangle that is `concerned` (m,) bool
        where this is given."""
        triangles = self.faces.triangles
        found = self.faces.pairs(after, concerned)
        if not len(found):
            return found
        near = np.zeros(len(self.before), bool)
        near[triangles[found]] = True
        near &= ~self._asked
        if near.any():
            old = self.faces.pairs(self.before, near[triangles].any(axis=1))
            old = np.concatenate([old, old[:, ::-1]])
            self._old = np.union1d(self._old, _vertex_pairs(triangles, old))
            self._asked |= near
        return found[~np.isin(_vertex_pairs(triangles, found), self._old).any(axis=1)]

    def apart(self, pairs: np.ndarray) -> np.ndarray:
        """Those of pairs (k,2) of triangles that had a distance from one another before, and did not touch."""
        if not len(pairs):
            return pairs
        corner = self.before[self.faces.triangles[pairs]]
        size = np.linalg.norm(corner - corner[:, :, [1, 2, 0]], axis=3).max(axis=(1, 2))
        return pairs[triangle_distances(self.before, self.faces.triangles, pairs) > TOUCHING * size]


def new_intersections(before: np.ndarray, after: np.ndarray, faces: FaceCrossings) -> np.ndarray:
    """Pairs (k,2) of triangles (m,3) that intersect at positions `after` (n,3) and did not at `before` (n,3); see
    `NewCrossings`."""
    return NewCrossings(before, faces).pairs(after)


def _vertex_pairs(triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Keys (k,9) of a vertex of one and a vertex of the other of pairs (k,2) of triangles (m,3)."""
    count = np.int64(triangles.max(initial=0) + 1)
    one, other = triangles[pairs[:, 0]].astype(np.int64), triangles[pairs[:, 1]]
    return (one[:, :, None] * count + other[:, None, :]).reshape(len(pairs), 9)


def touched(before: np.ndarray, after: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which triangles (m,) bool have a vertex that is elsewhere."""
    return (before != after).any(axis=1)[triangles].any(axis=1)
