"""Flip edges of flat arrays, many at once, in rounds of independent sets (Lawson 1977).

            k                            k
          /   \\                        / | \\
        /   t   \\                    /   |   \\
       i --h---> j      flip h      i  t  |  s  j
        \\   s   /     --------->     \\   |   /
          \\   /                        \\ | /
            l                            l
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .topology import next_halfedge, previous_halfedge


def flip_in_place(triangles: np.ndarray, twin: np.ndarray, h: np.ndarray, carried: np.ndarray | None = None) -> None:
    """Flip the interior halfedges h (k,), no two of which may share a triangle, overwriting the arrays.

    `carried` (3m,) goes with the outer halfedges; its entries for the new diagonals, halfedges 3t+1 and 3s+1, are
    left for the caller to set.
    """
    flat = triangles.reshape(-1)
    g = twin[h]
    jk, ki, il, lj = next_halfedge(h), previous_halfedge(h), next_halfedge(g), previous_halfedge(g)
    i, j, k, opposite = flat[h], flat[g], flat[ki], flat[lj]
    t, s = h // 3, g // 3
    old = np.concatenate([il, ki, jk, lj])
    new = np.concatenate([3 * t, 3 * t + 2, 3 * s, 3 * s + 2])
    moved_twin = twin[old]
    # An outer twin may itself lie in a triangle that is rebuilt in this round.
    order = np.argsort(old)
    place = order[np.minimum(np.searchsorted(old[order], moved_twin), len(old) - 1)]
    moved_twin = np.where(old[place] == moved_twin, new[place], moved_twin)
    if carried is not None:
        carried[new] = carried[old]
    triangles[t] = np.stack([i, opposite, k], axis=1)
    triangles[s] = np.stack([j, k, opposite], axis=1)
    twin[new] = moved_twin
    inner = moved_twin >= 0
    twin[moved_twin[inner]] = new[inner]
    twin[3 * t + 1], twin[3 * s + 1] = 3 * s + 1, 3 * t + 1


def flip_until_none(
    twin: np.ndarray,
    violation: Callable[[np.ndarray], np.ndarray],
    flip: Callable[[np.ndarray], None],
    max_rounds: int,
    edges: np.ndarray | None = None,
) -> tuple[int, bool]:
    """Flip edges in rounds until none wants to; the number of flips, and whether the rounds came to an end.

    `violation` gives of interior halfedges (e,) a number that is negative where the edge is to flip, the lower the
    sooner; `flip` flips an independent set (k,) in place. A round takes the edges that are the worst in both of their
    triangles; the next one looks only at triangles that were touched and at edges that had to wait. The first one looks
    at all edges, or at those given as one halfedge each (e,).
    """
    if edges is None:
        edges = np.flatnonzero(twin > np.arange(len(twin)))
    flips = 0
    worst = np.full(len(twin) // 3, len(twin), dtype=np.int64)
    for _ in range(max_rounds):
        score = violation(edges)
        t, s = edges // 3, twin[edges] // 3
        bad = (score < 0) & (t != s)
        edges, t, s = edges[bad], t[bad], s[bad]
        if len(edges) == 0:
            return flips, True
        rank = np.empty(len(edges), dtype=np.int64)
        rank[np.argsort(score[bad], kind="stable")] = np.arange(len(edges))
        np.minimum.at(worst, t, rank)
        np.minimum.at(worst, s, rank)
        first = (worst[t] == rank) & (worst[s] == rank)
        worst[t] = worst[s] = len(twin)
        touched = np.concatenate([t[first], s[first]])
        flip(edges[first])
        flips += int(first.sum())
        # Halfedges of touched triangles have new meanings; those that lost their turn elsewhere keep theirs.
        again = np.concatenate([(3 * touched[:, None] + np.arange(3)).ravel(), edges[~first]])
        again = again[twin[again] >= 0]
        edges = np.unique(np.minimum(again, twin[again]))
    return flips, False
