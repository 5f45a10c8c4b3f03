"""Split and collapse edges, many at once: another number of vertices, the same topology.

Collapses keep the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.geometry import cross3, of_corners
from ...mesh.topology import halfedges, next_halfedge, pair_keys, previous_halfedge, twins

# Cosine by which a face may turn at most when an edge at it collapses.
MIN_COSINE = 0.3
# Below every cosine: faces may turn as they will.
ANY_COSINE = -2.0
# Twice the area of a triangle without one, over the squares of its sides: lines of edges are straight up to rounding.
NO_AREA = 1e-9
# Lengths count as the same within a factor of two to the power of one over this.
BANDS = 4
# Rounds of choosing collapses that are apart from each other, but for more where none was found; what they leave is for
# the next call.
PASSES = 8


@dataclass(frozen=True)
class Edit:
    """A mesh after an edit, points (n,3) and triangles (m,3).

    origin (n,): the vertex each one was, -1 for new ones; split_ends (k,2): the old ends of the edges at whose middles
    the new vertices are; new_number (old,): the vertex that each old one is now; twin (3m,): opposite halfedges
    """

    points: np.ndarray
    triangles: np.ndarray
    origin: np.ndarray
    split_ends: np.ndarray
    new_number: np.ndarray
    twin: np.ndarray


def shortest_first(length: np.ndarray) -> np.ndarray:
    """An order (k,) of edges of lengths (k,), those of about the same length by chance, the same each time.

    Where lengths rise steadily across a mesh only the very shortest of a strict order has no shorter one beside it, and
    nearly none could collapse at once.
    """
    band = np.floor(BANDS * np.log2(np.maximum(length, np.finfo(float).tiny)))
    chance = np.random.default_rng(0).permutation(len(length))
    return chance[np.argsort(band[chance], kind="stable")]


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
        twin=_twin_after_splits(twin, both, np.where(twin[h] >= 0)[0], k),
    )


def _twin_after_splits(twin: np.ndarray, both: np.ndarray, inner: np.ndarray, k: int) -> np.ndarray:
    """Opposite halfedges of the triangles of `split_edges`, from those before (3m,).

    both (b,): the halfedges that were split, the first k of one side, then those of the other side of the `inner` ones
    """
    m, row = len(twin) // 3, np.arange(len(both))
    old, new = 3 * (both // 3), 3 * (m + row)
    # Where each halfedge is now, but for those that were split.
    place, whole = np.arange(len(twin)), np.ones(len(twin), dtype=bool)
    place[next_halfedge(both)], place[previous_halfedge(both)] = new + 1, old + 2
    whole[both] = False
    result = np.full(len(twin) + 3 * len(both), -1)
    result[place[whole]] = np.where(twin >= 0, place[twin], -1)[whole]
    result[old + 1], result[new + 2] = new + 2, old + 1
    result[old] = result[new] = -1
    here, there = inner, k + np.arange(len(inner))
    for a, b in ((here, there), (there, here)):
        result[old[a]], result[new[a]] = new[b], old[b]
    return result


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
    place = np.where(fixed_ends[keep][:, None] | along, points[keep], (points[keep] + points[gone]) / 2)
    ok = _leaves_edges(triangles, twin, h, boundary)
    keep, gone, place, single = keep[ok], gone[ok], place[ok], twin[h[ok]] < 0
    chosen = _chosen(points, triangles, twin, _Collapses(keep, gone, place, 2 - single), most, min_cosine)
    keep, gone, place = keep[chosen], gone[chosen], place[chosen]
    moved, target = points.copy(), np.arange(n)
    moved[keep] = place
    target[gone] = keep
    result = target[triangles]
    a, b, c = result.T
    left = (a != b) & (b != c) & (c != a)
    stay = np.ones(n, dtype=bool)
    stay[gone] = False
    number = np.cumsum(stay) - 1
    return Edit(
        points=moved[stay],
        triangles=number[result[left]],
        origin=np.flatnonzero(stay),
        split_ends=np.zeros((0, 2), np.int64),
        new_number=number[target],
        twin=_twin_after_collapses(result, twin, left),
    )


def _twin_after_collapses(collapsed: np.ndarray, twin: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Opposite halfedges of the triangles that are left, (m,) bool, from those of all (3m,); collapsed (m,3): these,
    with one vertex twice in those that are not."""
    gone = np.flatnonzero(~left)
    away = 3 * gone + np.argmax(collapsed[gone] == collapsed[gone][:, [1, 2, 0]], axis=1)
    first, second = twin[next_halfedge(away)], twin[previous_halfedge(away)]
    joined = twin.copy()
    for a, b in ((first, second), (second, first)):
        joined[a[a >= 0]] = b[a >= 0]
    place = np.repeat(3 * (np.cumsum(left) - 1), 3) + np.tile(np.arange(3), len(left))
    kept = joined.reshape(-1, 3)[left].ravel()
    return np.where(kept >= 0, place[kept], -1)


@dataclass(frozen=True)
class _Collapses:
    """Edges (k,) between vertices `keep` and `gone`, which meet in `place` (k,3), with 1 or 2 faces, `sides`."""

    keep: np.ndarray
    gone: np.ndarray
    place: np.ndarray
    sides: np.ndarray


def _leaves_edges(triangles: np.ndarray, twin: np.ndarray, h: np.ndarray, boundary: np.ndarray) -> np.ndarray:
    """Edges (k,) bool opposite to which no vertex has valence three, and that do not join two boundaries."""
    tail, head = halfedges(triangles)
    valence = np.bincount(tail, minlength=len(boundary)) + boundary
    single = twin[h] < 0
    left = tail[previous_halfedge(h)]
    right = np.where(single, left, tail[previous_halfedge(twin[h])])
    thick = (valence[left] > 3 + ~boundary[left] - 1) & (valence[right] > 3 + ~boundary[right] - 1)
    # Between two boundaries, or two places of one, a collapse would pinch the surface.
    across = ~single & boundary[tail[h]] & boundary[head[h]]
    return thick & (single | (left != right)) & ~across


def _chosen(
    points: np.ndarray, triangles: np.ndarray, twin: np.ndarray, edges: _Collapses, most: int, min_cosine: float
) -> np.ndarray:
    """Choose up to `most` of the collapses (k,), in order, that keep the topology, fold nothing, and share no triangle.

    An edge between two of them would have its triangles around both, so each leaves the other's neighbours as they are.
    What keeps no topology only shows when it is chosen, and others that it kept away take its place in the next pass.
    """
    n, k = len(points), len(edges.keep)
    left, chosen = np.arange(k), np.zeros(0, np.int64)
    around = np.bincount(triangles.ravel(), minlength=n)
    size = around[edges.keep] + around[edges.gone] - edges.sides
    busy = np.zeros(len(triangles), dtype=bool)
    passes = 0
    while len(left) and len(chosen) < most and (passes < PASSES or not len(chosen)):
        passes += 1
        first = np.full(n, k)
        # Of several the last one stays: the first in order.
        first[edges.keep[left[::-1]]] = left[::-1]
        other = np.full(n, k)
        other[edges.gone[left[::-1]]] = left[::-1]
        np.minimum(first, other, out=first)
        at = first.take(triangles.T)
        owner = np.minimum(np.minimum(at[0], at[1]), at[2])
        owner[busy] = k
        mine = left[np.bincount(owner, minlength=k + 1)[left] == size[left]]
        own = np.zeros(k + 1, dtype=bool)
        own[mine] = True
        touched = np.flatnonzero(own[owner])
        sound = _sound(points, triangles, twin, touched, owner[touched], edges, min_cosine)
        own[mine[~sound[mine]]] = False
        chosen = np.concatenate([chosen, mine[sound[mine]]])
        taken = np.flatnonzero(own[owner])
        busy[taken] = True
        near = np.zeros(n, dtype=bool)
        near[triangles[taken]] = True
        undecided = ~(near[edges.keep[left]] | near[edges.gone[left]])
        undecided[np.searchsorted(left, mine)] = False
        left = left[undecided]
    return np.sort(chosen)[:most]


def _sound(
    points: np.ndarray,
    triangles: np.ndarray,
    twin: np.ndarray,
    touched: np.ndarray,
    owner: np.ndarray,
    edges: _Collapses,
    min_cosine: float,
) -> np.ndarray:
    """Collapses (k,) bool that keep the link condition and turn no face too far, of those that own triangles.

    touched, owner (t,): these triangles, and whose they are
    """
    n, k, t = len(points), len(edges.keep), triangles[touched]
    keep, gone = edges.keep[owner], edges.gone[owner]
    at_end = (t == keep[:, None]) | (t == gone[:, None])
    # Neighbours of both ends: those that two halfedges lead to, or one from each on a boundary.
    row, corner = np.nonzero(at_end)
    h = 3 * touched[row] + corner
    ahead, back = t[row, (corner + 1) % 3], t[row, (corner + 2) % 3]
    last = twin[previous_halfedge(h)] < 0
    keys = np.concatenate([owner[row] * n + ahead, owner[row[last]] * n + back[last]])
    keys.sort()
    common = np.bincount(keys[1:][keys[1:] == keys[:-1]] // n, minlength=k)
    sound = common == edges.sides
    stays = np.flatnonzero(of_corners(np.add, at_end.view(np.int8)) == 1)
    old, mine = points.take(t.take(stays, axis=0), axis=0), owner[stays]
    new = np.where(at_end.take(stays, axis=0)[:, :, None], edges.place.take(mine, axis=0)[:, None], old)
    before, after = (cross3(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) for p in (old, new))
    length = np.sqrt(np.einsum("ij,ij->i", before, before) * np.einsum("ij,ij->i", after, after))
    turned = np.einsum("ij,ij->i", before, after)
    if min_cosine > ANY_COSINE:
        # What has no area, before or after, looks nowhere: its normal is rounding.
        sides = np.einsum("tkj,tkj->t", new - new[:, [1, 2, 0]], new - new[:, [1, 2, 0]])
        flat = np.einsum("ij,ij->i", after, after) <= (NO_AREA * sides) ** 2
        sound[mine[~(turned > min_cosine * length) | flat]] = False
    return sound


def interior_edges(triangles: np.ndarray, locked: np.ndarray, twin: np.ndarray | None = None) -> np.ndarray:
    """One halfedge (k,) of every edge that is neither on the boundary nor among the keys `locked`."""
    twin = twins(triangles) if twin is None else twin
    h = np.flatnonzero(twin > np.arange(len(twin)))
    tail, head = halfedges(triangles)
    return h[~np.isin(pair_keys(tail[h], head[h]), locked)] if len(locked) else h
