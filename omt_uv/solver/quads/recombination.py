"""Pair triangles that were one quad: recombination, J.-F. Remacle et al., Blossom-Quad (2012), section 3.

What a pair is worth is the quality of its quad, 1 - max |pi/2 - angle| / (pi/2) over its corners (there equation 2),
and how little it bends. Pairs that are the best of both of their triangles are taken, in rounds, where that article
finds the best of all: of bodies that were made of quads and triangulated 90 to 100 % of the quads come back.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import cross3, dot3, face_areas, lengths, unit
from ..mesh.topology import halfedges, next_halfedge, previous_halfedge, row_labels
from .diagonals import longer_diagonals

# Quads bend along their diagonal, but not by more than this, in radians, and have no corner that is nearly straight.
BENT = np.radians(60)
STRAIGHT = np.radians(170)
# A bend counts for as much as a corner that is off by that share of it.
BEND = 0.5
# What was made of quads has that share of its area, at least, in good ones, with corners that are off by no more than
# this. Scans and remeshed surfaces have up to 0.3, by chance, and bodies of games from 0.37 on.
GOOD = np.radians(20)
MADE_OF_QUADS = 0.35


def quad_diagonals(positions: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> np.ndarray:
    """Which edges are diagonals of quads that triangles were made from, (e,) bool; none where few of them were.

    Parameters
    ----------
    positions : (n,3) in units in which neither areas nor their squares under- or overflow
    triangles : (m,3)
    pair : (e,2) the two halfedges of every edge that may be one

    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> quad_diagonals(square, np.array([[0, 1, 2], [0, 2, 3]]), np.array([[2, 3]]))
    array([ True])
    """
    quads, (tail, head) = _quads(triangles, pair), halfedges(triangles)
    off, bend = _shape(positions, quads)
    may = (tail[pair[:, 0]] == head[pair[:, 1]]) & (bend <= BENT) & (off.max(axis=1) <= STRAIGHT - np.pi / 2)
    may &= (np.diff(np.sort(quads, axis=1), axis=1) > 0).all(axis=1)
    off, chosen = np.abs(off).max(axis=1), np.zeros(len(pair), bool)
    chosen[may] = _best_of_both(pair[may] // 3, (off + BEND * bend)[may], len(triangles))
    # Two quads on the same four vertices would be one face twice.
    rows = np.flatnonzero(chosen)
    label = row_labels(np.sort(quads[rows], axis=1))
    chosen[rows[np.bincount(label)[label] > 1]] = False
    area = face_areas(positions, triangles)
    good = area[pair[chosen & (off <= GOOD)] // 3].sum()
    return chosen if good >= MADE_OF_QUADS * area.sum() else np.zeros(len(pair), bool)


def with_shorter_diagonals(
    positions: np.ndarray, triangles: np.ndarray, diagonal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The triangles (m,3) with quads cut as `diagonals.cut_along_shorter` cuts them, and which halfedge each of the
    given ones is now (3m,), a diagonal one of the other diagonal.

    positions : (n,3), see `quad_diagonals`; diagonal : (q,2) halfedges of the diagonals
    """
    quads = _quads(triangles, diagonal)
    longer = longer_diagonals(positions, quads, triangles)
    turned, quads = diagonal[longer], quads[longer]
    now, place = triangles.copy(), np.arange(triangles.size)
    own, beyond = (np.stack([h, next_halfedge(h), previous_halfedge(h)]) for h in turned.T)
    one, other = 3 * (turned // 3).T
    now[one // 3], now[other // 3] = quads[:, [3, 0, 1]], quads[:, [1, 2, 3]]
    place[own[2]], place[beyond[1]], place[own[0]] = one, one + 1, one + 2
    place[beyond[2]], place[own[1]], place[beyond[0]] = other, other + 1, other + 2
    return now, place


def _quads(triangles: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
    """Vertices (e,4) around diagonals (e,2): where the first halfedge begins, beyond it, where it ends, on its side."""
    flat, (h, g) = triangles.ravel(), diagonal.T
    return flat[np.stack([h, previous_halfedge(g), next_halfedge(h), previous_halfedge(h)], axis=1)]


def _shape(positions: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By how much the corners (e,4) of quads (e,4) are off a right angle, and how these bend (e,), in radians, along
    the line from their first to their third corner."""
    p = positions[quads]
    side = unit((np.roll(p, -1, axis=1) - p).reshape(-1, 3)).reshape(p.shape)
    cosine = -np.einsum("ekd,ekd->ek", side, np.roll(side, 1, axis=1))
    across = p[:, 2] - p[:, 0]
    one, other = cross3(across, p[:, 3] - p[:, 0]), cross3(p[:, 1] - p[:, 0], across)
    norm = np.maximum(lengths(one) * lengths(other), 1e-300)
    return np.arccos(np.clip(cosine, -1, 1)) - np.pi / 2, np.arccos(np.clip(dot3(one, other) / norm, -1, 1))


def _best_of_both(pair: np.ndarray, cost: np.ndarray, count: int) -> np.ndarray:
    """Pairs (e,2) that are taken, (e,) bool, each of `count` things in one at most: those that are the cheapest of
    both, then those of what is left."""
    rank, taken = np.empty(len(cost), np.int64), np.zeros(len(cost), bool)
    rank[np.argsort(cost, kind="stable")] = np.arange(len(cost))
    free, left, least = np.ones(count, bool), np.arange(len(cost)), np.full(count, len(cost))
    while len(left):
        np.minimum.at(least, pair[left].ravel(), np.repeat(rank[left], 2))
        first = left[(least[pair[left]] == rank[left, None]).all(axis=1)]
        least[pair[left]] = len(cost)
        taken[first], free[pair[first]] = True, False
        left = left[free[pair[left]].all(axis=1)]
    return taken
