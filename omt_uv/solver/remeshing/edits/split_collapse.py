"""Edges split and collapsed, many at once: another number of vertices, the same topology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ...mesh.geometry import unit
from ...mesh.topology import halfedges, pair_keys, previous_halfedge, twins

# A face may turn by this cosine at most when an edge at it collapses.
LEAST_COSINE, ANY_COSINE = 0.3, -2.0
PASSES = 8


@dataclass(frozen=True)
class Edit:
    """A mesh after an edit, points (n,3) and triangles (m,3); origin (n,): the vertex each one was, -1 for new ones;
    between (k,2): the old ends of the edges at whose middles the new vertices are; became (old,): the vertex that each
    old one is now."""

    points: np.ndarray
    triangles: np.ndarray
    origin: np.ndarray
    between: np.ndarray
    became: np.ndarray


def split_edges(points: np.ndarray, triangles: np.ndarray, h: np.ndarray) -> Edit:
    """Put a vertex in the middle of the edges of halfedges h (k,), no two of which share a triangle."""
    twin = twins(triangles)
    tail, head = halfedges(triangles)
    n, k = len(points), len(h)
    new = n + np.arange(k)
    both, vertex = np.concatenate([h, twin[h]]), np.concatenate([new, new])
    both, vertex = both[both >= 0], vertex[both >= 0]
    flat = triangles.ravel()
    t = both // 3
    a, b, c = flat[both], head[both], flat[previous_halfedge(both)]
    result = np.concatenate([triangles, np.stack([vertex, b, c], axis=1)])
    result[t] = np.stack([a, vertex, c], axis=1)
    middle = (points[tail[h]] + points[head[h]]) / 2
    origin = np.concatenate([np.arange(n), np.full(k, -1)])
    return Edit(np.concatenate([points, middle]), result, origin, np.stack([tail[h], head[h]], axis=1), np.arange(n))


def independent_splits(triangles: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Those of the halfedges h (k,), most wanted first, whose triangles no more wanted one has."""
    twin = twins(triangles)
    rank = np.arange(len(h))
    t, s = h // 3, np.where(twin[h] >= 0, twin[h], h) // 3
    first = np.full(len(triangles), len(h))
    np.minimum.at(first, t, rank)
    np.minimum.at(first, s, rank)
    return h[(first[t] == rank) & (first[s] == rank)]


def collapse_edges(
    points: np.ndarray,
    triangles: np.ndarray,
    h: np.ndarray,
    fixed: np.ndarray,
    most: int,
    least_cosine: float = LEAST_COSINE,
    along: bool = False,
) -> Edit:
    """Collapse up to `most` of the edges of interior halfedges h (k,), most wanted first; see `_possible`.

    The two ends meet in the middle, or where the one is that is `fixed` (n,) bool or on a boundary. No face turns by
    more than `least_cosine`. Edges `along` lines may be on boundaries, and their ends meet in one of them.
    """
    n = len(points)
    tail, head = halfedges(triangles)
    rim = np.zeros(n, dtype=bool)
    rim[tail[twins(triangles) < 0]] = True
    held = fixed if along else fixed | rim
    h = h[~(held[tail[h]] & held[head[h]])]
    keep, gone = np.where(held[tail[h]], tail[h], head[h]), np.where(held[tail[h]], head[h], tail[h])
    neighbours = csr_matrix((np.ones(len(tail)), (tail, head)), shape=(n, n)) + csr_matrix(
        (np.ones(len(tail)), (head, tail)), shape=(n, n)
    )
    neighbours.data[:] = 1
    place = np.where(held[keep][:, None] | along, points[keep], (points[keep] + points[gone]) / 2)
    ok = _possible(points, triangles, h, neighbours, rim)
    keep, gone, place = keep[ok], gone[ok], place[ok]
    chosen = _chosen(points, triangles, neighbours, keep, gone, place, most, least_cosine)
    keep, gone, place = keep[chosen], gone[chosen], place[chosen]
    moved, target = points.copy(), np.arange(n)
    moved[keep] = place
    target[gone] = keep
    result = target[triangles]
    a, b, c = result.T
    result = result[(a != b) & (b != c) & (c != a)]
    stay = np.ones(n, dtype=bool)
    stay[gone] = False
    number = np.cumsum(stay) - 1
    return Edit(moved[stay], number[result], np.flatnonzero(stay), np.zeros((0, 2), np.int64), number[target])


def _possible(points, triangles, h, neighbours, rim) -> np.ndarray:
    """Edges (k,) bool whose ends share two neighbours and no more (the link condition), none of valence three."""
    tail, head = halfedges(triangles)
    common = np.asarray(neighbours[tail[h]].multiply(neighbours[head[h]]).sum(axis=1)).ravel()
    valence = np.diff(neighbours.indptr)
    twin = twins(triangles)
    open_ = twin[h] < 0
    left = tail[previous_halfedge(h)]
    right = np.where(open_, left, tail[previous_halfedge(twin[h])])
    thick = (valence[left] > 3 + ~rim[left] - 1) & (valence[right] > 3 + ~rim[right] - 1)
    # Between two boundaries, or two places of one, a collapse would pinch the surface.
    across = ~open_ & rim[tail[h]] & rim[head[h]]
    return (common == 2 - open_) & thick & (open_ | (left != right)) & ~across


def _chosen(points, triangles, neighbours, keep, gone, place, most: int, least_cosine: float) -> np.ndarray:
    """Up to `most` of the collapses (k,), most wanted first, none of which folds, or has neighbours of another one's.

    What folds only shows when it is chosen, and others that it kept away take its place in the next pass.
    """
    owner, member = _rings(neighbours, keep, gone)
    chosen = np.zeros(0, np.int64)
    open_ = np.ones(len(keep), dtype=bool)
    for _ in range(PASSES):
        free = open_[owner]
        owner, member = owner[free], member[free]
        first = np.full(len(points), len(keep))
        np.minimum.at(first, member, owner)
        apart = open_.copy()
        apart[owner[first[member] != owner]] = False
        mine = np.flatnonzero(apart)
        sound = _unfolded(points, triangles, keep[mine], gone[mine], place[mine], least_cosine)
        chosen = np.concatenate([chosen, mine[sound]])
        open_[mine] = False
        busy = np.zeros(len(points), dtype=bool)
        taken = np.zeros(len(keep), dtype=bool)
        taken[mine[sound]] = True
        busy[member[taken[owner]]] = True
        open_[owner[busy[member]]] = False
        if len(chosen) >= most or not open_.any():
            break
    return np.sort(chosen)[:most]


def _rings(neighbours: csr_matrix, keep: np.ndarray, gone: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All pairs (p,), (p,) of an edge (k,) by its number and a vertex around one of its ends."""
    owners, members = [], []
    for end in (keep, gone):
        rows = neighbours[end]
        owners.append(np.repeat(np.arange(len(end)), np.diff(rows.indptr)))
        members.append(rows.indices)
    return np.concatenate(owners), np.concatenate(members)


def _unfolded(points, triangles, keep, gone, place, least_cosine: float) -> np.ndarray:
    """Collapses (k,) bool that turn no face around them over."""
    n = len(points)
    moved, target, owner = points.copy(), np.arange(n), np.full(n, -1)
    moved[keep] = moved[gone] = place
    target[gone] = keep
    owner[keep] = owner[gone] = np.arange(len(keep))
    mine = owner[triangles].max(axis=1)
    touched = np.flatnonzero(mine >= 0)
    mine, t = mine[touched], triangles[touched]
    stays = (np.diff(np.sort(target[t], axis=1), axis=1) > 0).all(axis=1)
    old, new = points[t], moved[t]
    before = unit(np.cross(old[:, 1] - old[:, 0], old[:, 2] - old[:, 0]))
    after = unit(np.cross(new[:, 1] - new[:, 0], new[:, 2] - new[:, 0]))
    folded = stays & (np.einsum("ij,ij->i", before, after) < least_cosine)
    sound = np.ones(len(keep), dtype=bool)
    sound[mine[folded]] = False
    return sound


def interior_edges(triangles: np.ndarray, locked: np.ndarray) -> np.ndarray:
    """One halfedge (k,) of every edge that is neither on the boundary nor among the keys `locked`."""
    twin = twins(triangles)
    h = np.flatnonzero(twin > np.arange(len(twin)))
    tail, head = halfedges(triangles)
    return h[~np.isin(pair_keys(tail[h], head[h]), locked)] if len(locked) else h
