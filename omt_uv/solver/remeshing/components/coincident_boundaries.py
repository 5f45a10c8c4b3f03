"""Join boundaries that lie on one another, as where a mesh was cut, for remeshing, and reopen them afterwards.

Sampled apart, the two sides would cross each other or gape; joined along a line that is kept they cannot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.cut_mesh import cut_open
from ...mesh.geometry import places
from ...mesh.topology import first_of, halfedges, joined_along, only_once, opposite_sides, pair_keys, paired


@dataclass(frozen=True)
class JoinedBoundaries:
    """Triangles (m,3) joined along boundaries; same (n,): the vertex that stands for each; to_reopen (s,2): edges that
    were two before."""

    triangles: np.ndarray
    same: np.ndarray
    to_reopen: np.ndarray


def join_coincident(positions: np.ndarray, triangles: np.ndarray) -> JoinedBoundaries:
    """Join boundary edges of a mesh (n,3), (m,3) that lie on exactly one other, run against it and can be joined.

    Where anything else would meet in one edge, nothing is joined.
    """
    n, (tail, head) = len(positions), halfedges(triangles)
    none = JoinedBoundaries(triangles, np.arange(n), np.zeros((0, 2), np.int64))
    ends = np.stack([tail, head])[:, only_once(pair_keys(tail, head))]
    place, used = np.zeros(n, np.int64), np.unique(ends)
    place[used] = places(positions[used])
    first, second = (ends[:, k] for k in opposite_sides(place, ends))
    if first.size == 0:
        return none
    same = first_of(joined_along(n, first, second))
    result = same[triangles]
    tail, head = halfedges(result)
    if (np.unique(pair_keys(tail, head), return_counts=True)[1] > 2).any() or (tail == head).any():
        return none
    return JoinedBoundaries(result, same, same[first].T)


def reopened(points: np.ndarray, triangles: np.ndarray, to_reopen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut a mesh (n,3), (m,3) along the edges with the sorted keys `to_reopen` (k,): points (p,3), triangles (m,3)."""
    if len(to_reopen) == 0:
        return points, triangles
    sides = cut_open(points, triangles, paired(to_reopen)).sides
    return points[triangles.ravel()[np.unique(sides, return_index=True)[1]]], sides


def reopened_copies(ends: np.ndarray, on_boundary: np.ndarray) -> int:
    """Count the vertices that reopening adds: of edges with the ends (2s,), and vertices (n,) bool on a boundary.

    As many edges as meet inside of the surface part it into as many fans, or on a boundary into one more.
    """
    meeting = np.bincount(ends, minlength=len(on_boundary))
    return int(np.maximum(meeting - ~on_boundary, 0).sum())
