"""Subdivide polygon meshes, by Catmull and Clark's rules (1978) with creases (DeRose, Kass, Truong 1998).

A subdivided mesh is linear in the cage: its vertices are a sparse matrix times those of the cage, and so are its UVs
times the cage's UVs, by the same rules on the topology of the charts (OpenSubdiv's face-varying interpolation). The
quads of a polygon lie together, in the order of its corners, whatever the vertices are: a surface and its charts, cut
along seams, have the same quads in the same order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, vstack

from ..counts import BYTES_PER_ELEMENT, check_memory, quadrupled
from ..mesh.topology import next_corners

# Sharpness of what stays sharp for ever.
SHARP = 1e6
# Rules of a vertex, by the number of its sharp edges.
SMOOTH = 0
CREASE = 1
CORNER = 2


@dataclass(frozen=True)
class Cage:
    """Polygons to subdivide.

    corner_vertex (c,): vertex of every corner; face_start (f+1,): first corner of each polygon; count: vertices;
    ends (k,2) and sharpness (k,): edges that are creases, and for how many levels; corner_sharpness (n,): vertices'
    """

    corner_vertex: np.ndarray
    face_start: np.ndarray
    count: int
    ends: np.ndarray
    sharpness: np.ndarray
    corner_sharpness: np.ndarray


@dataclass(frozen=True)
class Subdivision:
    """matrix (n',n): vertices of the subdivided mesh from those of the cage; quads (q,4) of the subdivided mesh, and
    the polygon (q,) of the cage that each lies in, ascending."""

    matrix: csr_matrix
    quads: np.ndarray
    polygon: np.ndarray


@dataclass(frozen=True)
class _Topology:
    """Edges (e,2) of a cage, the edge (c,) of every corner and the next one, polygons at each edge, sharpness (e,)."""

    ends: np.ndarray
    edge: np.ndarray
    face: np.ndarray
    following: np.ndarray
    faces_at: np.ndarray
    sharpness: np.ndarray


def cage_of(corner_vertex: np.ndarray, face_start: np.ndarray, count: int) -> Cage:
    """A cage without creases, of corners (c,) and polygons (f+1,) of `count` vertices."""
    none = np.zeros((0, 2), np.int64)
    return Cage(corner_vertex, face_start, count, none, np.zeros(0), np.zeros(count))


def subdivide(coarse: Cage, levels: int, limit: bool = True) -> Subdivision:
    """The cage after one or more levels, its vertices moved to the limit surface if `limit`.

    Raises
    ------
    ValueError : no level
    CountError : more levels than this machine has memory for
    """
    if levels < 1:
        raise ValueError(f"levels must be at least 1, not {levels}")
    _check_levels(coarse, levels)
    matrix = identity(coarse.count, format="csr")
    polygon = np.arange(len(coarse.face_start) - 1)
    for _ in range(levels):
        polygon = np.repeat(polygon, np.diff(coarse.face_start))
        step, coarse = _step(coarse)
        matrix = step @ matrix
    if limit:
        matrix = _limit(coarse) @ matrix
    return Subdivision(csr_matrix(matrix), coarse.corner_vertex.reshape(-1, 4), polygon)


def _check_levels(coarse: Cage, levels: int) -> None:
    quads = len(coarse.corner_vertex) * quadrupled(levels - 1)
    check_memory(quads, BYTES_PER_ELEMENT, "A subdivided mesh of about {} quads", "Ask for fewer levels")


def straight_boundary(coarse: Cage) -> Cage:
    """The cage with all vertices of its boundary as corners: its boundary edges stay straight."""
    found = _topology(coarse)
    sharp = coarse.corner_sharpness.copy()
    sharp[found.ends[found.faces_at != 2].ravel()] = SHARP
    return replace(coarse, corner_sharpness=sharp)


def straight_corners(coarse: Cage) -> Cage:
    """The cage with the vertices of one polygon alone as corners."""
    alone = np.bincount(coarse.corner_vertex, minlength=coarse.count) == 1
    return replace(coarse, corner_sharpness=np.where(alone, SHARP, coarse.corner_sharpness))


def bilinear(coarse: Cage, levels: int) -> Subdivision:
    """The cage subdivided without smoothing: every quad by its bilinear map, others into quads around their centre.
    Raises CountError for more levels than this machine has memory for."""
    _check_levels(coarse, levels)
    everywhere = replace(coarse, corner_sharpness=np.full(coarse.count, SHARP), ends=_topology(coarse).ends)
    everywhere = replace(everywhere, sharpness=np.full(len(everywhere.ends), SHARP))
    matrix, polygon = identity(coarse.count, format="csr"), np.arange(len(coarse.face_start) - 1)
    for _ in range(levels):
        polygon = np.repeat(polygon, np.diff(everywhere.face_start))
        step, everywhere = _step(everywhere)
        found = _topology(everywhere)
        everywhere = replace(everywhere, ends=found.ends, sharpness=np.full(len(found.ends), SHARP))
        everywhere = replace(everywhere, corner_sharpness=np.full(everywhere.count, SHARP))
        matrix = step @ matrix
    return Subdivision(csr_matrix(matrix), everywhere.corner_vertex.reshape(-1, 4), polygon)


def _topology(coarse: Cage) -> _Topology:
    sides = np.diff(coarse.face_start)
    following = next_corners(coarse.face_start)
    a, b = coarse.corner_vertex, coarse.corner_vertex[following]
    key = np.minimum(a, b) * coarse.count + np.maximum(a, b)
    unique, edge = np.unique(key, return_inverse=True)
    ends = np.column_stack(np.divmod(unique, coarse.count))
    faces_at = np.bincount(edge, minlength=len(unique))
    sharpness = np.zeros(len(unique))
    if len(coarse.ends):
        creased = coarse.ends.min(axis=1) * coarse.count + coarse.ends.max(axis=1)
        at = np.minimum(np.searchsorted(unique, creased), len(unique) - 1)
        known = unique[at] == creased
        np.maximum.at(sharpness, at[known], coarse.sharpness[known])
    sharpness[faces_at != 2] = SHARP
    return _Topology(
        ends=ends,
        edge=edge,
        face=np.repeat(np.arange(len(sides)), sides),
        following=following,
        faces_at=faces_at,
        sharpness=sharpness,
    )


def _step(coarse: Cage) -> tuple[csr_matrix, Cage]:
    """The matrix of one level and the quads it makes: vertices first, then edge points, then face points."""
    top = _topology(coarse)
    n, e, f = coarse.count, len(top.ends), len(coarse.face_start) - 1
    sides = np.diff(coarse.face_start)
    centres = coo_matrix((1 / sides[top.face], (top.face, coarse.corner_vertex)), shape=(f, n)).tocsr()
    rows = np.arange(e)
    middle = coo_matrix((np.full(2 * e, 0.5), (np.tile(rows, 2), top.ends.T.ravel())), shape=(e, n)).tocsr()
    at_edge = coo_matrix((0.5 * np.ones(len(top.edge)), (top.edge, top.face)), shape=(e, f)).tocsr()
    smooth = 0.5 * middle + 0.5 * (at_edge @ centres)
    sharp = np.minimum(top.sharpness, 1)
    edges = _scaled(sharp, middle) + _scaled(1 - sharp, smooth)
    vertices = _vertex_rows(coarse, top, centres)
    previous = np.empty_like(top.following)
    previous[top.following] = np.arange(len(previous))
    quads = np.column_stack([coarse.corner_vertex, n + top.edge, n + e + top.face, n + top.edge[previous]])
    child = np.maximum(top.sharpness - 1, 0)
    kept = np.flatnonzero(child > 0)
    ends = np.concatenate([np.column_stack([top.ends[kept, k], n + kept]) for k in (0, 1)])
    corner = np.concatenate([np.maximum(coarse.corner_sharpness - 1, 0), np.zeros(e + f)])
    fine = Cage(
        corner_vertex=quads.ravel(),
        face_start=np.arange(0, 4 * len(quads) + 1, 4),
        count=n + e + f,
        ends=ends,
        sharpness=np.tile(child[kept], 2),
        corner_sharpness=corner,
    )
    return vstack([vertices, edges, centres]).tocsr(), fine


def _vertex_rows(coarse: Cage, top: _Topology, centres: csr_matrix) -> csr_matrix:
    """Where the vertices of the cage go in one level, (n,n)."""
    n, f = coarse.count, centres.shape[0]
    valence = np.maximum(np.bincount(coarse.corner_vertex, minlength=n), 1).astype(float)
    faces = coo_matrix((np.ones(len(top.face)), (coarse.corner_vertex, top.face)), shape=(n, f)).tocsr() @ centres
    smooth = _scaled((valence - 2) / valence, identity(n, format="csr"))
    smooth = smooth + _scaled(1 / valence**2, _neighbours(top.ends, n) + faces)
    before, after = (_rules(top, coarse.corner_sharpness, level) for level in (0.0, 1.0))
    # Where a crease ends within this level, between the rules of before and after (DeRose, Kass, Truong 1998, 5.2).
    passing = (top.sharpness > 0) & (top.sharpness < 1)
    number = np.bincount(top.ends[passing].ravel(), minlength=n).astype(float)
    total = np.bincount(top.ends[passing].ravel(), np.repeat(top.sharpness[passing], 2), n)
    point = (coarse.corner_sharpness > 0) & (coarse.corner_sharpness < 1)
    number, total = number + point, total + np.where(point, coarse.corner_sharpness, 0)
    share = np.where(before == after, 1.0, total / np.maximum(number, 1))
    share[(before != after) & (number == 0)] = 1.0
    result = csr_matrix((n, n))
    for rule, weight, level in ((before, share, 0.0), (after, 1 - share, 1.0)):
        crease = _scaled(0.75 * np.ones(n), identity(n, format="csr"))
        crease = crease + 0.125 * _neighbours(top.ends[top.sharpness > level], n)
        for which, rows in ((SMOOTH, smooth), (CREASE, crease), (CORNER, identity(n, format="csr"))):
            result = result + _scaled(weight * (rule == which), rows)
    return result.tocsr()


def _rules(top: _Topology, corner_sharpness: np.ndarray, level: float) -> np.ndarray:
    """The rule (n,) of every vertex by what is sharper than a level."""
    edges = np.bincount(top.ends[top.sharpness > level].ravel(), minlength=len(corner_sharpness))
    rule = np.where(edges == 2, CREASE, np.where(edges > 2, CORNER, SMOOTH))
    return np.where(corner_sharpness > level, CORNER, rule)


def _limit(fine: Cage) -> csr_matrix:
    """Limit positions of the vertices of a mesh of quads, (n,n) (Halstead, Kass, DeRose 1993)."""
    top, n = _topology(fine), fine.count
    k = np.maximum(np.bincount(fine.corner_vertex, minlength=n), 1).astype(float)
    quads = fine.corner_vertex.reshape(-1, 4)
    opposite = quads[:, [2, 3, 0, 1]].ravel()
    across = coo_matrix((np.ones(len(opposite)), (fine.corner_vertex, opposite)), shape=(n, n)).tocsr()
    smooth = 4 * _neighbours(top.ends, n) + across + _scaled(k**2, identity(n, format="csr"))
    smooth = _scaled(1 / (k * (k + 5)), smooth)
    rule = _rules(top, fine.corner_sharpness, 0.0)
    crease = _neighbours(top.ends[top.sharpness > 0], n) / 6 + _scaled(np.full(n, 2 / 3), identity(n, format="csr"))
    parts = ((SMOOTH, smooth), (CREASE, crease), (CORNER, identity(n, format="csr")))
    return sum((_scaled((rule == which).astype(float), rows) for which, rows in parts), csr_matrix((n, n)))


def _neighbours(ends: np.ndarray, n: int) -> csr_matrix:
    """The vertices (n,n) that edges (e,2) join."""
    a, b = ends.T
    return coo_matrix((np.ones(2 * len(a)), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)).tocsr()


def _scaled(factor: np.ndarray, rows: csr_matrix) -> csr_matrix:
    """Rows times their factors (n,)."""
    chosen = coo_matrix((factor, (np.arange(len(factor)), np.arange(len(factor)))), shape=(len(factor), len(factor)))
    return (chosen.tocsr() @ rows).tocsr()
