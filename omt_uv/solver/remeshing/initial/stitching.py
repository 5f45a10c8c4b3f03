"""Stitch triangulated charts along their common samples to one mesh that has the topology of the surface."""

from __future__ import annotations

import numpy as np

from ...mesh.topology import halfedges, pair_keys, twins
from ..edits.split_collapse import independent_splits, split_edges
from .arc_network import ChartBoundary
from .disk_samples import ChartMesh

# Rounds of splits of edges without a triangle in common.
MAX_ROUNDS = 50


def stitch(
    shared: np.ndarray, boundaries: list[ChartBoundary], charts: list[ChartMesh]
) -> tuple[np.ndarray, np.ndarray]:
    """Stitch charts to a mesh: points (n,3), the samples on arcs `shared` (s,3) first, and triangles (m,3).

    Edges inside of charts that join the same two samples on arcs as another edge does, or one with itself, get a
    vertex in the middle, so that two vertices have at most one edge.
    """
    number, points, triangles = [], [], []
    total, local = len(shared), 0
    for chart_boundary, chart in zip(boundaries, charts, strict=True):
        number.append(np.concatenate([chart_boundary.samples, total + np.arange(len(chart.points))]))
        points.append(np.concatenate([shared[chart_boundary.samples], chart.points]))
        triangles.append(chart.triangles + local)
        total, local = total + len(chart.points), local + len(number[-1])
    p, t, n = np.concatenate(points), np.concatenate(triangles), np.concatenate(number)
    for _ in range(MAX_ROUNDS):
        repeated = _repeated(t, n)
        if len(repeated) == 0:
            break
        edit = split_edges(p, t, independent_splits(t, repeated))
        n = np.concatenate([n, total + np.arange(len(edit.points) - len(p))])
        p, t, total = edit.points, edit.triangles, total + len(edit.points) - len(p)
    stitched = np.empty((total, 3))
    stitched[n] = p
    stitched[: len(shared)] = shared
    return stitched, n[t]


def _repeated(triangles: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Halfedges (k,) of edges inside of charts between samples (n,) that are the same, or are joined elsewhere.

    The former come first: beside one of them, an edge that is split has halves that join the same two samples again.
    """
    twin = twins(triangles)
    tail, head = halfedges(triangles)
    a, b = number[tail], number[head]
    inner, boundary = np.flatnonzero(twin > np.arange(len(twin))), np.flatnonzero(twin < 0)
    keys = np.concatenate([pair_keys(a[inner], b[inner]), np.unique(pair_keys(a[boundary], b[boundary]))])
    _, place, count = np.unique(keys, return_inverse=True, return_counts=True)
    again, same = count[place.ravel()[: len(inner)]] > 1, a[inner] == b[inner]
    return np.concatenate([inner[same], inner[again & ~same]])
