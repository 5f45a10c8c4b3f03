"""Keep faces of a mesh that flowed from passing through one another where it is creased more finely than it is divided.

A flow takes no two points to one, but flat faces between vertices may meet where the surface nearly touches itself
within an edge. Pairs of faces are taken apart again along the planes that were between them (`separation`). Where that
does not suffice, the flow is replaced by its best affine map, which takes faces apart to faces apart, and blended with
the flow over a few rings of vertices.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..mesh.geometry import nearest_rotations
from ..mesh.topology import graph_components, halfedges
from .self_intersections import FaceCrossings
from .separation import separated

# Rings of vertices around faces that intersect, in the rounds of mending; beyond them the blend takes as many again.
RINGS = (1, 2, 3, 4, 6, 8)
# Times that pairs which others have been moved into are taken apart with those.
SEPARATIONS = 8
# Mending moves nothing farther than this share of the diagonal or, on a coarse mesh, than an edge is long; and is for
# creases, not for more than this share of all faces, unless they are so few that it costs nothing to try.
FARTHEST = 0.02
MOST_FACES = 0.05
FEW_FACES = 1000


def new_intersections(
    before: np.ndarray, after: np.ndarray, faces: FaceCrossings, concerned: np.ndarray | None = None
) -> np.ndarray:
    """Pairs (k,2) of triangles (m,3) that intersect at positions `after` (n,3), and neither did at `before` (n,3) nor
    had neighbours that did: a line along which parts meet moves on from face to face. Only pairs with a triangle that
    is `concerned` (m,) bool where this is given."""
    triangles = faces.triangles
    pairs = faces.pairs(after, concerned)
    if not len(pairs):
        return pairs
    near = np.zeros(len(before), bool)
    near[triangles[pairs]] = True
    old = faces.pairs(before, near[triangles].any(axis=1))
    old = np.concatenate([old, old[:, ::-1]])
    return pairs[~np.isin(_vertex_pairs(triangles, pairs), _vertex_pairs(triangles, old)).any(axis=1)]


def _vertex_pairs(triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Keys (k,9) of a vertex of one and a vertex of the other of pairs (k,2) of triangles (m,3)."""
    count = np.int64(triangles.max(initial=0) + 1)
    one, other = triangles[pairs[:, 0]].astype(np.int64), triangles[pairs[:, 1]]
    return (one[:, :, None] * count + other[:, None, :]).reshape(len(pairs), 9)


def without_new_intersections(
    before: np.ndarray, after: np.ndarray, faces: FaceCrossings, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) close to `after` (n,3), and the pairs (k,2) of triangles (m,3) that still intersect and did not
    at `before` (n,3). Only vertices `free` (n,) bool move."""
    triangles = faces.triangles
    pairs = new_intersections(before, after, faces, _touched(before, after, triangles))
    if not len(pairs) or _too_many(pairs, triangles):
        return after, pairs
    best, fewest = _separated_all(before, after, faces, free, pairs)
    if len(fewest):
        best, fewest = _blended_all(before, after, faces, free, (best, fewest))
    return best, fewest


def _touched(before: np.ndarray, after: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which triangles (m,) bool have a vertex that is elsewhere."""
    return (before != after).any(axis=1)[triangles].any(axis=1)


def _too_many(pairs: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether pairs (k,2) have more of the triangles (m,3) than are mended."""
    return len(np.unique(pairs)) > max(MOST_FACES * len(triangles), FEW_FACES)


def _farthest(before: np.ndarray, triangles: np.ndarray) -> float:
    """How far mending may move a vertex of triangles (m,3)."""
    tail, head = halfedges(triangles)
    edge = float(np.linalg.norm(before[tail] - before[head], axis=1).mean())
    return max(FARTHEST * float(np.linalg.norm(np.ptp(before, axis=0))), edge)


def _separated_all(before, after, faces: FaceCrossings, free, pairs) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) and pairs that are left, with pairs (k,2) moved behind the planes that were between them, and
    those that come to intersect by that, too."""
    triangles = faces.triangles
    farthest = _farthest(before, triangles)
    best, fewest = after, pairs
    for _ in range(SEPARATIONS):
        position = separated(before, after, triangles, pairs, free)
        if np.abs(position - after).max() > farthest:
            break
        near = _touched(after, position, triangles)
        near[fewest] = True
        left = new_intersections(before, position, faces, near)
        if len(left) < len(fewest):
            best, fewest = position, left
        both = np.unique(np.concatenate([pairs, left]), axis=0)
        if not len(left) or len(both) == len(pairs):
            break
        pairs = both
    return best, fewest


def _blended_all(before, after, faces: FaceCrossings, free, found) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) and pairs that are left, of those `found`, with affine maps of more and more rings around."""
    triangles, n = faces.triangles, len(before)
    best, fewest = found
    position, pairs = found
    farthest = _farthest(before, triangles)
    tail, head = halfedges(triangles)
    graph = sp.csr_matrix((np.ones(2 * len(tail)), (np.r_[tail, head], np.r_[head, tail])), shape=(n, n))
    graph = graph + sp.identity(n, format="csr")
    for rings in RINGS:
        if not len(pairs) or _too_many(pairs, triangles):
            break
        position = _blended(before, after, position, graph, triangles[pairs].reshape(len(pairs), -1), free, rings)
        if np.abs(position - after).max() > farthest:
            break
        near = _touched(best, position, triangles)
        near[fewest] = True
        pairs = new_intersections(before, position, faces, near)
        if len(pairs) < len(fewest):
            best, fewest = position, pairs
    return best, fewest


def _blended(before, after, position, graph, seeds: np.ndarray, free, rings: int) -> np.ndarray:
    """Positions (n,3) with every cluster of vertices `seeds` (k,6) and of rings around them moved by an affine map."""
    n = len(before)
    weight = np.zeros(n)
    weight[seeds] = 1.0
    for _ in range(rings):
        weight = np.minimum(graph @ weight, 1.0)
    core = weight > 0
    tail, head = seeds[:, :1].repeat(5, 1).ravel(), seeds[:, 1:].ravel()
    inner = sp.csr_matrix(graph[core][:, core])
    place = np.cumsum(core) - 1
    rows, columns = inner.nonzero()
    _, label = graph_components(np.r_[rows, place[tail]], np.r_[columns, place[head]], int(core.sum()))
    fade = core.astype(float)
    reach = core.copy()
    owner = np.full(n, -1)
    owner[core] = label
    for k in range(rings):
        ring = (graph @ reach > 0) & ~reach
        near = sp.csr_matrix(graph[ring].multiply(reach.astype(float)))
        near.eliminate_zeros()
        owner[ring] = owner[near.indices[near.indptr[:-1]]]
        fade[ring] = 1 - (k + 1) / (rings + 1)
        reach |= ring
    moved = position.copy()
    used = np.flatnonzero(reach)
    target = _affine_images(before[used], after[used], owner[used], fade[used])
    share = (fade[used] * free[used])[:, None]
    moved[used] = (1 - share) * after[used] + share * target
    return moved


def _affine_images(before: np.ndarray, after: np.ndarray, owner: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Images (k,3) of points (k,3) by the affine map of their cluster `owner` (k,) nearest to points `after` (k,3)."""
    count = int(owner.max()) + 1
    total = np.bincount(owner, weight, count)

    def means(x):
        return np.stack([np.bincount(owner, weight * x[:, k], count) for k in range(3)], axis=1) / total[:, None]

    low, high = means(before), means(after)
    x, y = before - low[owner], after - high[owner]
    scale = np.sqrt(np.bincount(owner, weight * np.square(x).sum(axis=1), count) / total)
    products = [np.einsum("ki,kj->kij", weight[:, None] * z, x) for z in (x, y)]
    square, cross = (
        np.stack([np.bincount(owner, p[:, i, j], count) for i in range(3) for j in range(3)], axis=1).reshape(-1, 3, 3)
        for p in products
    )
    # Towards the identity across flat patches, whose normal no point says anything about.
    soft = (1e-3 * scale**2 * total)[:, None, None] * np.eye(3)
    rotation = nearest_rotations(cross)
    matrix = (cross + soft @ rotation) @ np.linalg.inv(square + soft)
    return high[owner] + np.einsum("kij,kj->ki", matrix[owner], x)
