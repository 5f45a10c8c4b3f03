"""Slit a chart from its boundary to where its map shears most, along a shortest path."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..mesh.charts import Chart
from ..mesh.geometry import face_areas
from ..mesh.gluing import polygon_sides
from ..mesh.surface import Surface, is_sharp
from ..mesh.topology import boundary_loops, halfedges, pair_keys, twins
from .component import AVOIDED, NOISE, SHARP


def slit(surface: Surface, chart: Chart, shear: np.ndarray, avoid: np.ndarray | None = None) -> np.ndarray:
    """Edges (k,2) of the surface from the boundary of the chart to its worst place; (0,2) where there is no way.

    The end is where much shear lies far from the boundary, and the way there runs along sheared edges, where a cut
    helps most. A slit leaves a disk a disk. Holes that are filled for the map are left alone.

    Parameters
    ----------
    shear : (m,) s1/s2 >= 1 of every triangle
    avoid : (n,) in [0,1], vertices of the surface to keep free of seams
    """
    n = len(chart.vertices)
    on_boundary, taboo = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    on_boundary[boundary_loops(chart.disk)[0]] = True
    taboo[chart.patches.ravel()] = True
    local = _mean_at_vertices(chart, np.log(np.maximum(shear, 1)))
    a, b = _inner_sides(surface, chart)
    usable = ~(taboo[a] | taboo[b]) & ~(on_boundary[a] & on_boundary[b])
    a, b = a[usable], b[usable]
    length = np.linalg.norm(chart.vertices[a] - chart.vertices[b], axis=1)
    noise = 1 + NOISE * np.random.default_rng(0).random(len(a))
    cost = np.maximum(length, 1e-9 * length.max(initial=1e-300)) * noise / (1 + local[a] + local[b])
    weight = np.zeros(n)
    if avoid is not None:
        weight = np.where(chart.vertex_ids >= 0, np.clip(avoid, 0, 1)[chart.vertex_ids], 0)
    cost *= 1 + (AVOIDED - 1) * (weight[a] + weight[b]) / 2
    cost[is_sharp(surface, pair_keys(chart.vertex_ids[a], chart.vertex_ids[b]))] *= SHARP
    graph = csr_matrix((np.tile(cost, 2), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n))
    distance, before, _ = dijkstra(graph, indices=np.flatnonzero(on_boundary), min_only=True, return_predecessors=True)
    worth = np.where(np.isfinite(distance), distance, 0) * local * (1 - weight)
    worth *= 1 + NOISE * np.random.default_rng(1).random(n)
    end = int(np.argmax(worth))
    if worth[end] <= 0:
        return np.zeros((0, 2), dtype=np.int64)
    return chart.vertex_ids[_path(before, end)]


def _mean_at_vertices(chart: Chart, value: np.ndarray) -> np.ndarray:
    """Mean (n,) of a value (m,) of the triangles around every vertex, weighted by area."""
    area = face_areas(chart.vertices, chart.triangles)
    n = len(chart.vertices)
    total = np.bincount(chart.triangles.ravel(), np.repeat(area, 3), n)
    return np.bincount(chart.triangles.ravel(), np.repeat(area * value, 3), n) / np.maximum(total, 1e-300)


def _inner_sides(surface: Surface, chart: Chart) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the inner edges of the chart that are sides of polygons, (e,) and (e,)."""
    side = polygon_sides(len(surface.corner_vertex), surface.face_start, chart.corners)
    tail, head = halfedges(chart.triangles)
    h = np.flatnonzero(side & (twins(chart.triangles) >= 0))
    key = np.unique(pair_keys(tail[h], head[h]))
    return key >> 32, key & 0xFFFFFFFF


def _path(before: np.ndarray, end: int) -> np.ndarray:
    """Edges (k,2) from `end` back to where the predecessors stop."""
    steps = [end]
    while before[steps[-1]] >= 0:
        steps.append(int(before[steps[-1]]))
    return np.column_stack([steps[:-1], steps[1:]])
