"""Flip edges of triangle meshes in space, towards Delaunay, and never to a mesh that folds or touches itself.

An edge is Delaunay where the angles opposite to it sum up to pi at most (Bobenko, Springborn 2007), measured on the
triangles in space.
"""

from __future__ import annotations

import numpy as np

from ...mesh.edge_flips import flip_in_place, flip_until_none
from ...mesh.geometry import face_normals
from ...mesh.topology import halfedges, pair_keys, previous_halfedge, twins

# Cosine by which the new faces of a flip may lean against the old ones at most.
MIN_COSINE = 0.5
# The same between the two new faces.
MIN_COSINE_BETWEEN = 0.0
# Rounds of independent flips.
MAX_ROUNDS = 30
# Sum of cotangents below which an edge counts as Delaunay: rounding must not flip for ever.
TOLERANCE = 1e-9


def make_delaunay_embedded(
    points: np.ndarray,
    triangles: np.ndarray,
    twin: np.ndarray,
    locked: np.ndarray,
    max_rounds: int = MAX_ROUNDS,
    outer: np.ndarray | None = None,
) -> int:
    """Flip edges whose opposite angles exceed pi together, overwriting triangles (m,3) and twin (3m,); count the flips.

    points (n,3); locked: sorted keys (`topology.pair_keys`) of edges to keep. An edge also stays where its flip would
    join two vertices twice, or two of the `outer` ones (n,) bool, or lean a face over.
    """
    flat = triangles.reshape(-1)
    cotangent = _cotangents(points, triangles)

    def violation(h):
        value = cotangent.take(h) + cotangent.take(twin[h]) + TOLERANCE
        bad = np.flatnonzero(value < 0)
        e, g = h[bad], twin[h[bad]]
        i, j, k, far = flat[e], flat[g], flat[previous_halfedge(e)], flat[previous_halfedge(g)]
        ok = _unfolded(points, i, j, k, far) & ~_already_joined(triangles, k, far) & ~_is_in(pair_keys(i, j), locked)
        if outer is not None:
            ok &= ~(outer[k] & outer[far])
        value[bad[~ok]] = 0.0
        return value

    def flip(h):
        new = pair_keys(flat[previous_halfedge(h)], flat[previous_halfedge(twin[h])])
        # Two flips at once could make the same edge.
        h = h[np.unique(new, return_index=True)[1]]
        changed = np.concatenate([h, twin[h]]) // 3
        flip_in_place(triangles, twin, h)
        cotangent[changed] = _cotangents(points, triangles[changed])

    flips, _ = flip_until_none(twin, violation, flip, max_rounds)
    return flips


def flip_if_valid(
    points: np.ndarray, triangles: np.ndarray, h: np.ndarray, keep: np.ndarray, outer: np.ndarray
) -> np.ndarray:
    """Flip interior halfedges h (k,), no two of which share a triangle, in place in triangles (m,3); keys of new edges.

    Not those of `keep` (3m,) bool, nor where a face would fold, or vertices be joined that are so already, or that both
    are `outer` (n,) bool. The keys are sorted.
    """
    twin, flat = twins(triangles), triangles.reshape(-1)
    h = h[(twin[h] >= 0) & ~keep[h]]
    i, j, k, far = flat[h], flat[twin[h]], flat[previous_halfedge(h)], flat[previous_halfedge(twin[h])]
    ok = _unfolded(points, i, j, k, far) & ~_already_joined(triangles, k, far) & ~(outer[k] & outer[far])
    flip_in_place(triangles, twin, h[ok])
    return np.sort(pair_keys(k[ok], far[ok]))


def _already_joined(triangles: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether edges of triangles (m,3) join the vertices a (k,) and b (k,), (k,) bool."""
    if len(a) == 0:
        return np.zeros(0, dtype=bool)
    ends = np.zeros(int(triangles.max()) + 1, dtype=bool)
    ends[a] = ends[b] = True
    at = ends.take(triangles)
    tail, head = halfedges(triangles)
    both = np.flatnonzero((at & at[:, [1, 2, 0]]).ravel())
    return _is_in(pair_keys(a, b), np.sort(pair_keys(tail[both], head[both])))


def _is_in(keys: np.ndarray, ordered: np.ndarray) -> np.ndarray:
    """As np.isin, for keys in ascending order: a fifth of its time."""
    if len(ordered) == 0:
        return np.zeros(len(keys), dtype=bool)
    return ordered[np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)] == keys


def _cotangents(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Cotangents (m,3) of the angles opposite to the halfedges."""
    p = np.take(points.T, triangles.T, axis=1)
    # Coordinates first.
    sides = a, b, _ = p[:, 1] - p[:, 0], p[:, 2] - p[:, 1], p[:, 0] - p[:, 2]
    x, y, z = (a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1)))
    double = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-300)
    squares = [x * x + y * y + z * z for x, y, z in sides]
    # The law of cosines: the two other sides meet opposite to each.
    half = (squares[0] + squares[1] + squares[2]) / 2
    return np.stack([(half - square) / double for square in squares], axis=1)


def _unfolded(points, i, j, k, far) -> np.ndarray:
    """Whether the faces i, far, k and j, k, far look the same way as i, j, k and j, i, far, (e,) bool."""
    given, other, first, second = (
        face_normals(points, np.column_stack(corners)) for corners in ((i, j, k), (j, i, far), (i, far, k), (j, k, far))
    )
    old = given + other
    reach = MIN_COSINE * np.sqrt(np.einsum("ij,ij->i", old, old))
    ahead = (np.einsum("ij,ij->i", old, first) > reach) & (np.einsum("ij,ij->i", old, second) > reach)
    return ahead & (np.einsum("ij,ij->i", first, second) > MIN_COSINE_BETWEEN)
