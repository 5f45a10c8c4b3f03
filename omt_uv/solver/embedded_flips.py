"""Edge flips of triangle meshes in space: towards Delaunay, and never to a mesh that folds or touches itself."""

from __future__ import annotations

import numpy as np

from .closest import unit
from .flips import flip_in_place, flip_until_none
from .topology import halfedges, pair_keys, previous_halfedge

# The new faces of a flip may lean against the old ones by this cosine at most.
LEAST_COSINE = 0.5
MAX_ROUNDS = 30
TOLERANCE = 1e-9


def make_delaunay_embedded(
    points: np.ndarray, triangles: np.ndarray, twin: np.ndarray, locked: np.ndarray, max_rounds: int = MAX_ROUNDS
) -> int:
    """Flip edges whose opposite angles exceed pi together, overwriting triangles (m,3) and twin (3m,).

    points (n,3); locked: sorted keys (`topology.pair_keys`) of edges to keep. An edge also stays where its flip would
    join two vertices twice, or lean a face over. Returns the number of flips.
    """
    flat = triangles.reshape(-1)
    known = _Edges(triangles)

    def violation(h):
        g = twin[h]
        i, j, k, far = flat[h], flat[g], flat[previous_halfedge(h)], flat[previous_halfedge(g)]
        value = _cotangent(points, i, j, k) + _cotangent(points, i, j, far) + TOLERANCE
        bad = np.flatnonzero(value < 0)
        ok = _allowed(points, i[bad], j[bad], k[bad], far[bad])
        ok &= ~known.contain(pair_keys(k[bad], far[bad])) & ~_is_in(pair_keys(i[bad], j[bad]), locked)
        value[bad[~ok]] = 0.0
        return value

    def flip(h):
        new = pair_keys(flat[previous_halfedge(h)], flat[previous_halfedge(twin[h])])
        # Two flips at once could make the same edge.
        h = h[np.unique(new, return_index=True)[1]]
        flip_in_place(triangles, twin, h)
        known.update(triangles)

    flips, _ = flip_until_none(twin, violation, flip, max_rounds)
    return flips


class _Edges:
    """Which vertices are joined."""

    def __init__(self, triangles: np.ndarray):
        self.update(triangles)

    def update(self, triangles: np.ndarray) -> None:
        """Take the edges of triangles (m,3) for those that exist."""
        self.keys = np.sort(pair_keys(*halfedges(triangles)))

    def contain(self, keys: np.ndarray) -> np.ndarray:
        """Which keys (k,), see `topology.pair_keys`, are those of edges, (k,) bool."""
        return _is_in(keys, self.keys)


def _is_in(keys: np.ndarray, ordered: np.ndarray) -> np.ndarray:
    if len(ordered) == 0:
        return np.zeros(len(keys), dtype=bool)
    return ordered[np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)] == keys


def _cotangent(points, i, j, k) -> np.ndarray:
    """Cotangent of the angle at k of the triangles i, j, k."""
    a, b = points[i] - points[k], points[j] - points[k]
    cross = np.cross(a, b)
    sine = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    return np.einsum("ij,ij->i", a, b) / np.maximum(sine, 1e-300)


def _allowed(points, i, j, k, far) -> np.ndarray:
    """Whether the faces i, far, k and j, k, far look the same way as i, j, k and j, i, far."""
    a, b, c, d = points[i], points[j], points[k], points[far]
    old = unit(np.cross(b - a, c - a)) + unit(np.cross(a - b, d - b))
    first, second = unit(np.cross(d - a, c - a)), unit(np.cross(c - b, d - b))
    reach = LEAST_COSINE * np.sqrt(np.einsum("ij,ij->i", old, old))
    ahead = (np.einsum("ij,ij->i", old, first) > reach) & (np.einsum("ij,ij->i", old, second) > reach)
    return ahead & (np.einsum("ij,ij->i", first, second) > LEAST_COSINE - 0.5)
