"""A closed triangle mesh made coarser, down to a tetrahedron, by collapsing edges, many at once.

A vertex i that is removed moves into its neighbour j; the hole is filled by a fan from j. That keeps a sphere a sphere
exactly when i and j have just two common neighbours (Dey, Edelsbrunner, Guha, Nekhayev 1999). Vertices are removed in
rounds whose neighbourhoods do not meet, so that they can be put back in any order (Praun, Hoppe 2003).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..errors import MeshError
from ..mesh.geometry import face_areas
from ..mesh.topology import halfedges, next_halfedge

# A level ends when this share of its vertices is left.
SHRINK = 0.45
# Of the vertices that could go, those above this quantile of the cost wait for a later round.
QUANTILE = 0.6
# Passes that look for more vertices whose neighbourhoods do not meet those already chosen.
PASSES = 3
# Degree that a collapse makes only at a price.
HIGH_DEGREE = 9
MAX_ROUNDS = 1000


@dataclass(frozen=True)
class Round:
    """Vertices (r,) removed together, the neighbours (r,) that they moved into, and the triangles that surrounded them.

    star (k,3): triangles, the removed vertex first; owner (k,): which of the r; mass (k,) of the triangles.
    """

    removed: np.ndarray
    parent: np.ndarray
    star: np.ndarray
    owner: np.ndarray
    mass: np.ndarray


@dataclass(frozen=True)
class Level:
    """A mesh (n,3), (m,3) with the mass (m,) of its faces, the rounds that coarsen it, and the vertices left (k,)."""

    vertices: np.ndarray
    triangles: np.ndarray
    mass: np.ndarray
    rounds: tuple[Round, ...]
    kept: np.ndarray


def coarsened(vertices: np.ndarray, triangles: np.ndarray, mass: np.ndarray, seed: int = 0) -> list[Level]:
    """Levels of a closed surface of genus 0 (n,3), (m,3) with face masses (m,), the finest first.

    The last level is a tetrahedron, without rounds. Masses move to the faces that fill a hole; their sum is kept.
    Another seed removes vertices in another order.
    """
    rng = np.random.default_rng(seed)
    levels = []
    while len(vertices) > 4:
        level, triangles, mass = _level(vertices, triangles, mass, rng)
        levels.append(level)
        vertices = vertices[level.kept]
    levels.append(Level(vertices, triangles, mass, (), np.arange(len(vertices))))
    return levels


def _level(vertices, triangles, mass, rng) -> tuple[Level, np.ndarray, np.ndarray]:
    """A level, and the triangles and masses of the next in its numbering."""
    n = left = len(vertices)
    now, weight, rounds = triangles, mass, []
    alive = np.ones(n, dtype=bool)
    for _ in range(MAX_ROUNDS):
        removed, parent = _choose(vertices, now, rng)
        if len(removed) == 0:
            raise MeshError("The mesh cannot be made coarser", "Check it with Mesh > Clean Up")
        # At the coarse end no more may go than a tetrahedron can spare.
        removed, parent = removed[: left - 4], parent[: left - 4]
        step, now, weight = _collapse(vertices, now, weight, removed, parent)
        rounds.append(step)
        alive[removed] = False
        left -= len(removed)
        if left <= max(4, SHRINK * n):
            break
    kept = np.flatnonzero(alive)
    number = np.full(n, -1, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    return Level(vertices, triangles, mass, tuple(rounds), kept), number[now], weight


def _choose(vertices, triangles, rng) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (r,) to remove and the neighbours (r,) they move into; closed neighbourhoods are disjoint."""
    n = len(vertices)
    tail, head = halfedges(triangles)
    adjacent = csr_matrix((np.ones(len(tail), np.int32), (tail, head)), shape=(n, n))
    common = (adjacent @ adjacent).multiply(adjacent).tocsr()
    allowed = np.asarray(common[tail, head]).ravel() == 2
    degree = np.bincount(tail, minlength=n)
    length = np.linalg.norm(vertices[tail] - vertices[head], axis=1)
    price = length * (1 + np.maximum(degree[tail] + degree[head] - 4 - HIGH_DEGREE, 0))
    order = np.lexsort((head, price, ~allowed, tail))
    first = order[np.searchsorted(tail[order], np.flatnonzero(degree > 0))]
    first = first[allowed[first]]
    if len(first) == 0:
        return first, first
    parent = np.full(n, -1, dtype=np.int64)
    parent[tail[first]] = head[first]
    cost = np.full(n, np.inf)
    cost[tail[first]] = price[first] / np.sqrt(_worst_shape(vertices, triangles, parent)[tail[first]])
    cheap = cost <= np.quantile(cost[tail[first]], QUANTILE)
    turn = np.where(cheap, rng.permutation(n), n).astype(np.int64)
    chosen = np.zeros(n, dtype=bool)
    for _ in range(PASSES):
        least = _around(_around(turn, tail, head), tail, head)
        more = (turn < n) & (turn == least)
        chosen |= more
        near = _around(_around(np.where(more, -1, 0), tail, head), tail, head) < 0
        turn[near] = n
    removed = np.flatnonzero(chosen)
    return removed, parent[removed]


def _around(value: np.ndarray, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """The least value (n,) of each vertex and its neighbours."""
    least = value.copy()
    np.minimum.at(least, tail, value[head])
    return least


def _worst_shape(vertices, triangles, parent) -> np.ndarray:
    """Shape (n,) of the worst triangle that moving a vertex into its parent makes: 1 equilateral, at least 1e-4."""
    corner = np.arange(3 * len(triangles))
    i, a, b = (triangles.ravel()[x] for x in (corner, next_halfedge(corner), next_halfedge(next_halfedge(corner))))
    j = parent[i]
    stays = (j >= 0) & (j != a) & (j != b)
    worst = np.ones(len(vertices))
    np.minimum.at(worst, i[stays], _shape(vertices[j[stays]], vertices[a[stays]], vertices[b[stays]]))
    return np.maximum(worst, 1e-4)


def _shape(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    area = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    squares = ((q - p) ** 2).sum(axis=1) + ((r - q) ** 2).sum(axis=1) + ((p - r) ** 2).sum(axis=1)
    return 2 * np.sqrt(3) * area / np.maximum(squares, 1e-300)


def _collapse(vertices, triangles, mass, removed, parent):
    """The round, and the triangles and masses after it."""
    number = np.full(len(vertices), -1, dtype=np.int64)
    number[removed] = np.arange(len(removed))
    which = number[triangles]
    inside = (which >= 0).any(axis=1)
    rows, place = triangles[inside], which[inside].argmax(axis=1)
    star = np.take_along_axis(rows, (place[:, None] + np.arange(3)) % 3, axis=1)
    owner = number[star[:, 0]]
    step = Round(removed, parent, star, owner, mass[inside])
    target = parent[owner]
    fan = (star[:, 1] != target) & (star[:, 2] != target)
    new = np.column_stack([target[fan], star[fan, 1], star[fan, 2]])
    area, group, r = face_areas(vertices, new), owner[fan], len(removed)
    total = np.bincount(owner, step.mass, r)
    share = area / np.maximum(np.bincount(group, area, r), 1e-300)[group]
    # Half by area, half evenly: no face shall be left with nothing.
    share = 0.5 * share + 0.5 / np.bincount(group, minlength=r)[group]
    share = share / np.bincount(group, share, r)[group]
    return step, np.concatenate([triangles[~inside], new]), np.concatenate([mass[~inside], total[group] * share])
