"""Join the boundaries of a component with a mirror plane so that it becomes a disk and stays its own mirror image.

Arcs come in mirrored pairs, or run in the plane. They form a tree with the boundaries: the first pair meets in the
plane, and no other that leaves the plane comes back to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..cutting.component import CutComponent, boundary_vertices
from ..cutting.cut_graph import is_disk
from ..mesh.topology import pair_keys
from .fine_paths import FineGraph, FineMirror
from .path_graph import path_to


@dataclass(frozen=True)
class _ArcPlace:
    """Where an arc may run: from `start` over `allowed` to `end`, all (n,) bool; pairs of arcs count twice."""

    start: np.ndarray
    allowed: np.ndarray
    end: np.ndarray
    count: int


def symmetric_base(component: CutComponent, mirror: FineMirror) -> np.ndarray | None:
    """Edges (e,) bool that cut a component without handles into a disk, symmetrically; None where there are none."""
    loops = boundary_vertices(component)
    edges = len(component.pair) + len(component.boundary)
    if component.vertex_count - edges + len(component.triangles) + len(loops) != 2:
        return None
    loop = np.full(component.vertex_count, -1)
    for k, vertices in enumerate(loops):
        loop[vertices] = k
    # Where a face was mapped apart, the rest of its boundary need not be quite its own image.
    votes = [np.bincount(loop[mirror.image[vertices]] + 1, minlength=len(loops) + 1)[1:] for vertices in loops]
    own = np.array([vote.argmax() == k for k, vote in enumerate(votes)], dtype=bool)
    size = np.array(
        [len(vertices) if own[k] and mirror.plane[vertices].any() else 0 for k, vertices in enumerate(loops)]
    )
    joined, left = np.zeros(component.vertex_count, dtype=bool), np.ones(len(loops), dtype=bool)
    if size.any():
        joined[loops[int(size.argmax())]] = True
        left[size.argmax()] = False
    graph = FineGraph.of(component, mirror.image).cost
    paths: list[np.ndarray] = []
    while left.any():
        target = (loop >= 0) & left[loop]
        path = _cheapest(graph, _ways(mirror, joined, target, target & own[loop]))
        ends = np.zeros(0, np.int64) if path is None else np.unique(loop[[path[-1], mirror.image[path[-1]]]])
        if path is None or (ends < 0).any() or not left[ends].all():
            return None
        for end in ends:
            joined[loops[int(end)]] = True
        left[ends] = False
        joined[path] = joined[mirror.image[path]] = True
        paths += [path, mirror.image[path]]
    keys = [pair_keys(path[:-1], path[1:]) for path in paths]
    cut = np.isin(pair_keys(*component.ends.T), np.concatenate([np.zeros(0, np.int64), *keys]))
    # Where the mesh is not quite its own image, an arc may meet another one's image.
    return cut if is_disk(component, cut) else None


def _ways(mirror: FineMirror, joined: np.ndarray, target: np.ndarray, crossing: np.ndarray) -> list[_ArcPlace]:
    """The ways to boundaries that are left, `target`, from what is joined, both (n,) bool; crossing: in the plane."""
    off = mirror.side & ~mirror.plane
    if not joined.any():
        return [_ArcPlace(mirror.plane, off | mirror.plane, off & target, 2)]
    beside = _ArcPlace(joined & (mirror.side | mirror.plane), (off & ~crossing) | joined, off & target & ~crossing, 2)
    return [beside, _ArcPlace(joined & mirror.plane, mirror.plane, mirror.plane & crossing, 1)]


def _cheapest(graph: csr_matrix, ways: list[_ArcPlace]) -> np.ndarray | None:
    """Vertices (k,) of the cheapest arc that one of the ways allows; None if there is no arc."""
    best, least = None, np.inf
    for way in ways:
        inner = np.flatnonzero(way.start | way.allowed | way.end)
        begin, goal = np.flatnonzero(way.start[inner]), np.flatnonzero(way.end[inner])
        if len(begin) == 0 or len(goal) == 0:
            continue
        cost, before, _ = dijkstra(graph[inner][:, inner], indices=begin, min_only=True, return_predecessors=True)
        last = int(goal[np.argmin(cost[goal])])
        if way.count * cost[last] < least:
            least = way.count * cost[last]
            best = inner[path_to(before, last)[::-1]]
    return best
