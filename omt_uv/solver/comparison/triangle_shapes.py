"""Shapes of triangles: least angles, quality, and how even areas and edges are; and the topology of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import angles_from_lengths, edge_lengths, face_areas, halfedge_lengths
from ..mesh.topology import boundary_edges, graph_components, halfedges, pair_keys, paired


@dataclass(frozen=True)
class TriangleShapes:
    """angle_min, angle_p1, angle_mean : the least angle of a triangle, in degrees: the least, the first percentile and
    the mean; below_30 : share of triangles with one below 30 degrees; quality : mean of 2 inradius / circumradius, 1 is
    equilateral; edge_cv, area_cv : standard deviation over mean of edges and of areas"""

    angle_min: float
    angle_p1: float
    angle_mean: float
    below_30: float
    quality: float
    edge_cv: float
    area_cv: float


@dataclass(frozen=True)
class MeshTopology:
    """Components, boundary loops, Euler characteristic, edges with more than two faces, and those whose faces disagree
    about the orientation."""

    components: int
    loops: int
    euler: int
    crowded: int
    disagreeing: int


def compare_shapes(V: np.ndarray, F: np.ndarray) -> TriangleShapes:
    """Shapes of the triangles F (m,3) at positions V (n,3)."""
    length = halfedge_lengths(V, F).reshape(-1, 3)
    least = np.degrees(angles_from_lengths(length)).min(axis=1)
    area = face_areas(V, F)
    quality = 16 * area**2 / np.maximum(length.sum(axis=1) * length.prod(axis=1), 1e-300)
    keys = np.unique(pair_keys(*halfedges(F)))
    edge = edge_lengths(V, paired(keys))
    return TriangleShapes(
        angle_min=float(least.min()),
        angle_p1=float(np.percentile(least, 1)),
        angle_mean=float(least.mean()),
        below_30=float((least < 30).mean()),
        quality=float(quality.mean()),
        edge_cv=float(edge.std() / edge.mean()),
        area_cv=float(area.std() / area.mean()),
    )


def topology_of(F: np.ndarray) -> MeshTopology:
    """MeshTopology of the triangles F (m,3), of the vertices that they use."""
    used, flat = np.unique(F, return_inverse=True)
    F = flat.reshape(-1, 3)
    tail, head = halfedges(F)
    keys, inverse, count = np.unique(pair_keys(tail, head), return_inverse=True, return_counts=True)
    turn = np.bincount(inverse.ravel(), np.where(tail < head, 1, -1), len(keys))
    boundary = boundary_edges(F)
    outer, ends = np.unique(boundary, return_inverse=True)
    ends = ends.reshape(-1, 2)
    loops = graph_components(ends[:, 0], ends[:, 1], len(outer))[0] if len(boundary) else 0
    return MeshTopology(
        components=graph_components(tail, head, len(used))[0],
        loops=loops,
        euler=len(used) - len(keys) + len(F),
        crowded=int((count > 2).sum()),
        disagreeing=int(((count == 2) & (turn != 0)).sum()),
    )
