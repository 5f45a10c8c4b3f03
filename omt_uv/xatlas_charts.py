"""Find seams of many charts of low distortion, by xatlas: for textures where islands matter less than shear."""

from __future__ import annotations

import numpy as np

from .errors import UserError
from .solver.mesh.surface import Surface, chosen_triangles
from .solver.mesh.topology import graph_components, halfedges, pair_keys, pair_up

# Extent of the mesh for xatlas, which drops faces of meshes with small units.
EXTENT = 100.0


class SegmentationError(UserError):
    """xatlas cannot be loaded or failed."""


def chart_seams(surface: Surface, faces: np.ndarray | None = None) -> np.ndarray:
    """Edges (k,2) between charts of low distortion of the polygons `faces` (f,) bool, all by default.

    Polygons are never divided. Add the edges to the seams of the surface and prepare it with seams "auto": a chart that
    is no disk is cut once more.

    Raises
    ------
    EmptyMeshError, NonFiniteError : see `charts.strict_charts`
    SegmentationError : xatlas is missing or fails
    """
    _, triangles, owner = chosen_triangles(surface, faces)
    chart = _chart_of_triangle(surface, triangles)
    # A polygon goes where its first triangle goes.
    first = np.zeros(len(surface.face_start) - 1, dtype=np.int64)
    first[owner[::-1]] = chart[::-1]
    chart = first[owner]
    tail, head = halfedges(surface.corner_vertex[triangles])
    one, other = pair_up(pair_keys(tail, head))
    border = chart[one // 3] != chart[other // 3]
    return np.stack([tail[one[border]], head[one[border]]], axis=1)


def _chart_of_triangle(surface: Surface, triangles: np.ndarray) -> np.ndarray:
    """Chart (m,) that xatlas puts each triangle (m,3) of corners into."""
    try:
        import xatlas
    except ImportError as error:
        raise SegmentationError(f"{error}. Install xatlas, or choose another kind of seams.") from error
    used, index = np.unique(surface.corner_vertex[triangles], return_inverse=True)
    low, high = surface.positions[used].min(axis=0), surface.positions[used].max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    size = 2 * float((high / 2 - low / 2).max()) or 1.0
    points = EXTENT * (surface.positions[used] / size - low / size)
    # xatlas may keep pointers to these until generate().
    points, faces = points.astype(np.float32), index.reshape(-1, 3).astype(np.uint32)
    atlas = xatlas.Atlas()
    try:
        atlas.add_mesh(points, faces)
        atlas.generate()
    except RuntimeError as error:
        raise SegmentationError(f"xatlas: {error}. Choose another kind of seams.") from error
    _, indices, _ = atlas[0]
    # Charts of xatlas share no vertices.
    flat = np.asarray(indices, dtype=np.int64)
    n = int(flat.max()) + 1
    rows, columns = np.repeat(flat[:, 0], 2), flat[:, 1:].ravel()
    label = graph_components(rows, columns, n)[1]
    return label[flat[:, 0]]
