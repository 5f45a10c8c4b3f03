"""Split and collapse edges, many at once: another number of vertices, the same topology.

Collapses keep the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ...mesh.geometry import unit
from ...mesh.topology import halfedges, pair_keys, previous_halfedge, twins

# Cosine by which a face may turn at most when an edge at it collapses.
MIN_COSINE = 0.3
# Below every cosine: faces may turn as they will.
ANY_COSINE = -2.0
# Rounds of choosing collapses that are apart from each other; what they leave is for the next call.
PASSES = 8


@dataclass(frozen=True)
class Edit:
    """A mesh after an edit, points (n,3) and triangles (m,3).

    origin (n,): the vertex each one was, -1 for new ones; split_ends (k,2): the old ends of the edges at whose middles
    the new vertices are; new_number (old,): the vertex that each old one is now
    """

    points: np.ndarray
    triangles: np.ndarray
    origin: np.ndarray
    split_ends: np.ndarray
    new_number: np.ndarray


def split_edges(points: np.ndarray, triangles: np.ndarray, h: np.ndarray, twin: np.ndarray | None = None) -> Edit:
    """Put a vertex in the middle of the edges of halfedges h (k,), no two of which share a triangle.

    twin (3m,): opposite halfedges, where they are known, here and below
    """
    twin = twins(triangles) if twin is None else twin
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
    return Edit(
        points=np.concatenate([points, middle]),
        triangles=result,
        origin=origin,
        split_ends=np.stack([tail[h], head[h]], axis=1),
        new_number=np.arange(n),
    )


def independent_splits(triangles: np.ndarray, h: np.ndarray, twin: np.ndarray | None = None) -> np.ndarray:
    """Choose those of the halfedges h (k,), in order of preference, whose triangles none before them has."""
    twin = twins(triangles) if twin is None else twin
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
    min_cosine: float = MIN_COSINE,
    along: bool = False,
    twin: np.ndarray | None = None,
) -> Edit:
    """Collapse up to `most` of the edges of interior halfedges h (k,), in order, as far as the topology allows.

    The two ends meet in the middle, or where the one is that is `fixed` (n,) bool or on a boundary. No face turns by
    more than `least_cosine`. Edges `along` lines may be on boundaries, and their ends meet in one of them.
    """
    n, twin = len(points), twins(triangles) if twin is None else twin
    tail, head = halfedges(triangles)
    boundary = np.zeros(n, dtype=bool)
    boundary[tail[twin < 0]] = True
    fixed_ends = fixed if along else fixed | boundary
    h = h[~(fixed_ends[tail[h]] & fixed_ends[head[h]])]
    keep, gone = np.where(fixed_ends[tail[h]], tail[h], head[h]), np.where(fixed_ends[tail[h]], head[h], tail[h])
    neighbours = csr_matrix((np.ones(len(tail)), (tail, head)), shape=(n, n)) + csr_matrix(
        (np.ones(len(tail)), (head, tail)), shape=(n, n)
    )
    neighbours.data[:] = 1
    place = np.where(fixed_ends[keep][:, None] | along, points[keep], (points[keep] + points[gone]) / 2)
    ok = _keeps_topology(triangles, twin, h, neighbours, boundary)
    keep, gone, place = keep[ok], gone[ok], place[ok]
    chosen = _chosen(points, triangles, neighbours, keep, gone, place, most, min_cosine)
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
    return Edit(
        points=moved[stay],
        triangles=number[result],
        origin=np.flatnonzero(stay),
        split_ends=np.zeros((0, 2), np.int64),
        new_number=number[target],
    )


def _keeps_topology(triangles, twin, h, neighbours, boundary) -> np.ndarray:
    """Edges (k,) bool whose ends share two neighbours and no more (the link condition), none of valence three."""
    tail, head = halfedges(triangles)
    common = np.asarray(neighbours[tail[h]].multiply(neighbours[head[h]]).sum(axis=1)).ravel()
    valence = np.diff(neighbours.indptr)
    single = twin[h] < 0
    left = tail[previous_halfedge(h)]
    right = np.where(single, left, tail[previous_halfedge(twin[h])])
    thick = (valence[left] > 3 + ~boundary[left] - 1) & (valence[right] > 3 + ~boundary[right] - 1)
    # Between two boundaries, or two places of one, a collapse would pinch the surface.
    across = ~single & boundary[tail[h]] & boundary[head[h]]
    return (common == 2 - single) & thick & (single | (left != right)) & ~across


def _chosen(points, triangles, neighbours, keep, gone, place, most: int, min_cosine: float) -> np.ndarray:
    """Choose up to `most` of the collapses (k,), in order, none of which folds, or has neighbours of another one's.

    What folds only shows when it is chosen, and others that it kept away take its place in the next pass.
    """
    owner, member = _rings(neighbours, keep, gone)
    chosen = np.zeros(0, np.int64)
    undecided = np.ones(len(keep), dtype=bool)
    for _ in range(PASSES):
        free = undecided[owner]
        owner, member = owner[free], member[free]
        first = np.full(len(points), len(keep))
        np.minimum.at(first, member, owner)
        apart = undecided.copy()
        apart[owner[first[member] != owner]] = False
        mine = np.flatnonzero(apart)
        sound = _unfolded(points, triangles, keep[mine], gone[mine], place[mine], min_cosine)
        chosen = np.concatenate([chosen, mine[sound]])
        undecided[mine] = False
        busy = np.zeros(len(points), dtype=bool)
        taken = np.zeros(len(keep), dtype=bool)
        taken[mine[sound]] = True
        busy[member[taken[owner]]] = True
        undecided[owner[busy[member]]] = False
        if len(chosen) >= most or not undecided.any():
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


def _unfolded(points, triangles, keep, gone, place, min_cosine: float) -> np.ndarray:
    """Collapses (k,) bool that fold no face around them."""
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
    folded = stays & (np.einsum("ij,ij->i", before, after) < min_cosine)
    sound = np.ones(len(keep), dtype=bool)
    sound[mine[folded]] = False
    return sound


def interior_edges(triangles: np.ndarray, locked: np.ndarray, twin: np.ndarray | None = None) -> np.ndarray:
    """One halfedge (k,) of every edge that is neither on the boundary nor among the keys `locked`."""
    twin = twins(triangles) if twin is None else twin
    h = np.flatnonzero(twin > np.arange(len(twin)))
    tail, head = halfedges(triangles)
    return h[~np.isin(pair_keys(tail[h], head[h]), locked)] if len(locked) else h
