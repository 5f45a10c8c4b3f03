"""Coarsen a closed triangle mesh to a tetrahedron, by half-edge collapses, many at once (Praun, Hoppe 2003).

A vertex i that is removed moves into its neighbour j; the hole is filled by a fan from j. That keeps a sphere a sphere
exactly when i and j have just two common neighbours (Dey, Edelsbrunner, Guha, Nekhayev 1999). Vertices are removed in
rounds whose neighbourhoods do not meet, so that they can be put back in any order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..errors import CoarseningError
from ..mesh.geometry import cross3, face_areas, lengths
from ..mesh.topology import halfedges, next_halfedge

# A level ends when this share of its vertices is left.
SHRINK = 0.45
# Of the vertices that could go, those above this quantile of the cost wait for a later round.
QUANTILE = 0.6
# Passes that look for more vertices whose neighbourhoods do not meet those already chosen.
PASSES = 3
# Degree beyond which every edge more adds the length of the collapsed edge once more to its price.
HIGH_DEGREE = 9
# Least shape that the cost of a vertex is divided by; 1 is equilateral.
LEAST_SHAPE = 1e-4
# Rounds on one level, which no mesh needs.
MAX_ROUNDS = 1000


@dataclass(frozen=True)
class CollapseRound:
    """Vertices (r,) removed together, the neighbours (r,) that they moved into, and the triangles that surrounded them.

    star (k,3): triangles, the removed vertex first; owner (k,): which of the r; mass (k,) of the triangles.
    """

    removed: np.ndarray
    parent: np.ndarray
    star: np.ndarray
    owner: np.ndarray
    mass: np.ndarray


@dataclass(frozen=True)
class SphereLevel:
    """A mesh (n,3), (m,3) with the mass (m,) of its faces, the rounds that coarsen it, and the vertices left (k,)."""

    vertices: np.ndarray
    triangles: np.ndarray
    mass: np.ndarray
    rounds: tuple[CollapseRound, ...]
    kept: np.ndarray


def collapse_to_tetrahedron(
    vertices: np.ndarray, triangles: np.ndarray, mass: np.ndarray, seed: int = 0
) -> list[SphereLevel]:
    """Collapse a closed surface of genus 0 (n,3), (m,3) with face masses (m,) to a tetrahedron; levels, finest first.

    The last level is the tetrahedron, without rounds. Masses move to the faces that fill a hole; their sum is kept.
    Another seed removes vertices in another order.

    Raises
    ------
    MeshError : no edge can be collapsed, though more than four vertices are left
    """
    rng = np.random.default_rng(seed)
    levels = []
    while len(vertices) > 4:
        level, triangles, mass = _level(vertices, triangles, mass, rng)
        levels.append(level)
        vertices = vertices[level.kept]
    levels.append(
        SphereLevel(vertices=vertices, triangles=triangles, mass=mass, rounds=(), kept=np.arange(len(vertices)))
    )
    return levels


def _level(vertices, triangles, mass, rng) -> tuple[SphereLevel, np.ndarray, np.ndarray]:
    """A level, and the triangles and masses of the next in its numbering."""
    n = left = len(vertices)
    faces, face_mass, rounds = triangles, mass, []
    alive = np.ones(n, dtype=bool)
    for _ in range(MAX_ROUNDS):
        removed, parent = _choose(vertices, faces, rng)
        if len(removed) == 0:
            raise CoarseningError("The mesh cannot be made coarser")
        # At the coarse end no more may go than a tetrahedron can spare.
        removed, parent = removed[: left - 4], parent[: left - 4]
        step, faces, face_mass = _collapse(vertices, faces, face_mass, removed, parent)
        rounds.append(step)
        alive[removed] = False
        left -= len(removed)
        if left <= max(4, SHRINK * n):
            break
    kept = np.flatnonzero(alive)
    place = np.full(n, -1, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    level = SphereLevel(vertices=vertices, triangles=triangles, mass=mass, rounds=tuple(rounds), kept=kept)
    return level, place[faces], face_mass


def _choose(vertices, triangles, rng) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (r,) to remove and the neighbours (r,) they move into; closed neighbourhoods are disjoint."""
    n = len(vertices)
    tail, head = halfedges(triangles)
    adjacent = csr_matrix((np.ones(len(tail), np.int32), (tail, head)), shape=(n, n))
    common = (adjacent @ adjacent).multiply(adjacent).tocsr()
    allowed = np.asarray(common[tail, head]).ravel() == 2
    degree = np.bincount(tail, minlength=n)
    length = lengths(vertices[tail] - vertices[head])
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
        least = _least_around(_least_around(turn, tail, head), tail, head)
        more = (turn < n) & (turn == least)
        chosen |= more
        near = _least_around(_least_around(np.where(more, -1, 0), tail, head), tail, head) < 0
        turn[near] = n
    removed = np.flatnonzero(chosen)
    return removed, parent[removed]


def _least_around(value: np.ndarray, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """The least value (n,) of each vertex and its neighbours."""
    least = value.copy()
    np.minimum.at(least, tail, value[head])
    return least


def _worst_shape(vertices, triangles, parent) -> np.ndarray:
    """Shape (n,) of the worst triangle that a move into the parent makes, as `_shape`; not below LEAST_SHAPE."""
    corner = np.arange(3 * len(triangles))
    i, a, b = (triangles.ravel()[x] for x in (corner, next_halfedge(corner), next_halfedge(next_halfedge(corner))))
    j = parent[i]
    stays = (j >= 0) & (j != a) & (j != b)
    worst = np.ones(len(vertices))
    np.minimum.at(worst, i[stays], _shape(vertices[j[stays]], vertices[a[stays]], vertices[b[stays]]))
    return np.maximum(worst, LEAST_SHAPE)


def _shape(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Shape (k,) of triangles, 4 sqrt(3) area / (sum of the squared sides): 1 equilateral, 0 without area."""
    area = lengths(cross3(q - p, r - p))
    squares = ((q - p) ** 2).sum(axis=1) + ((r - q) ** 2).sum(axis=1) + ((p - r) ** 2).sum(axis=1)
    return 2 * np.sqrt(3) * area / np.maximum(squares, 1e-300)


def _collapse(vertices, triangles, mass, removed, parent):
    """Fill the holes of vertices (r,) by fans from their parents (r,): the round, and triangles and masses after it."""
    place = np.full(len(vertices), -1, dtype=np.int64)
    place[removed] = np.arange(len(removed))
    which = place[triangles]
    inside = (which >= 0).any(axis=1)
    rows, corner = triangles[inside], which[inside].argmax(axis=1)
    star = np.take_along_axis(rows, (corner[:, None] + np.arange(3)) % 3, axis=1)
    owner = place[star[:, 0]]
    step = CollapseRound(removed=removed, parent=parent, star=star, owner=owner, mass=mass[inside])
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
