"""From a polygon mesh with seams to disk charts, with index maps back to the face corners.

A chart vertex is a class of corners that are joined around a vertex by edges which are no seams, so a seam
that ends inside a chart, and a vertex where two fans meet, are cut open for the map only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .errors import (
    DuplicateFaceError,
    EmptyMeshError,
    NonFiniteError,
    NonManifoldEdgeError,
    NotADiskError,
    OrientationError,
    ZeroAreaFaceError,
)
from .topology import boundary_loops, halfedges, pair_keys, pair_up

# A triangle whose area is below this share of its longest side squared is a line.
DEGENERATE = 1e-10


@dataclass(frozen=True)
class Surface:
    """A polygon mesh as arrays; a corner is a vertex of one polygon.

    positions (n,3), corner_vertex (c,), face_start (f+1,) so that polygon f owns the corners
    face_start[f]:face_start[f+1], triangles (m,3) of corners, triangle_face (m,), seams (k,2) vertex pairs.
    """

    positions: np.ndarray
    corner_vertex: np.ndarray
    face_start: np.ndarray
    triangles: np.ndarray
    triangle_face: np.ndarray
    seams: np.ndarray


@dataclass(frozen=True)
class Chart:
    """A disk: vertices (n,3), triangles (m,3), the surface's corners (m,3), faces (m,) and vertex_ids (n,)."""

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    faces: np.ndarray
    vertex_ids: np.ndarray


def triangle_surface(positions: np.ndarray, triangles: np.ndarray, seams=()) -> Surface:
    """The surface of a triangle mesh: positions (n,3), triangles (m,3), seams (k,2)."""
    triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    m = len(triangles)
    corners = np.arange(3 * m).reshape(m, 3)
    seams = np.asarray(seams, dtype=np.int64).reshape(-1, 2)
    return Surface(
        np.asarray(positions, dtype=float), triangles.ravel(), 3 * np.arange(m + 1), corners, np.arange(m), seams
    )


def split(surface: Surface, faces: np.ndarray | None = None) -> list[Chart]:
    """Charts of the polygons `faces` (f,) bool (all by default), each a topological disk.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError, DuplicateFaceError, NonManifoldEdgeError,
    OrientationError, NotADiskError : with the indices of the offending elements of the surface
    """
    if faces is None:
        faces = np.ones(len(surface.face_start) - 1, dtype=bool)
    chosen = np.asarray(faces, dtype=bool)[surface.triangle_face]
    triangles, owner = surface.triangles[chosen], surface.triangle_face[chosen]
    if len(triangles) == 0:
        raise EmptyMeshError("There are no faces to unwrap")
    _check_positions(surface, triangles)
    _check_areas(surface, triangles, owner)
    _check_duplicates(surface, faces)
    first, second = _joined_halfedges(surface, triangles)
    corner_class, chart_of_triangle = _join(surface, triangles, owner, first, second)
    return [_make(surface, c, triangles, owner, corner_class) for c in _groups(chart_of_triangle)]


def _check_positions(surface: Surface, triangles: np.ndarray) -> None:
    used = np.unique(surface.corner_vertex[triangles])
    wrong = used[~np.isfinite(surface.positions[used]).all(axis=1)]
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)


def _check_areas(surface: Surface, triangles: np.ndarray, owner: np.ndarray) -> None:
    p = surface.positions[surface.corner_vertex[triangles]]
    # Halves: the difference of two huge numbers may be infinite.
    side = p / 2 - p[:, :1] / 2
    size = np.abs(side).max(axis=(1, 2))
    # Scaling first keeps tiny and huge meshes clear of underflow and overflow.
    side = side / np.where(size > 0, size, 1)[:, None, None]
    area = 0.5 * np.linalg.norm(np.cross(side[:, 1], side[:, 2]), axis=1)
    extent = np.ptp(p.reshape(-1, 3) / 2, axis=0).max()
    wrong = (area <= DEGENERATE) | (size <= 1e-9 * extent)
    if wrong.any():
        raise ZeroAreaFaceError("Faces have no area", kind="face", elements=np.unique(owner[wrong]))


def _check_duplicates(surface: Surface, faces: np.ndarray) -> None:
    """Faces on the same set of vertices, compared size by size."""
    size = np.diff(surface.face_start)
    wrong = []
    for s in np.unique(size[faces]):
        index = np.flatnonzero(faces & (size == s))
        vertices = np.sort(surface.corner_vertex[surface.face_start[index][:, None] + np.arange(s)], axis=1)
        _, inverse, count = np.unique(vertices, axis=0, return_inverse=True, return_counts=True)
        wrong.append(index[count[inverse.ravel()] > 1])
    duplicates = np.concatenate(wrong)
    if len(duplicates):
        raise DuplicateFaceError("Faces share all their vertices with another face", kind="face", elements=duplicates)


def _joined_halfedges(surface: Surface, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of opposite halfedges (p,), (p,) across which the map is continuous."""
    tail, head = halfedges(triangles)
    a, b = surface.corner_vertex[tail], surface.corner_vertex[head]
    # A triangle side that is no side of its polygon is a diagonal; its twin lies in the same polygon.
    after = np.arange(len(surface.corner_vertex)) + 1
    after[surface.face_start[1:] - 1] = surface.face_start[:-1]
    side = after[tail] == head
    diagonal = np.flatnonzero(~side)
    first, second = pair_up(pair_keys(tail[diagonal], head[diagonal]))
    inner = diagonal[first], diagonal[second]

    sides = np.flatnonzero(side)
    key = pair_keys(a[sides], b[sides])
    if len(surface.seams):
        keep = ~np.isin(key, pair_keys(surface.seams[:, 0], surface.seams[:, 1]))
        sides, key = sides[keep], key[keep]
    unique, index, count = np.unique(key, return_index=True, return_counts=True)
    if (count > 2).any():
        h = sides[index[count > 2]]
        raise NonManifoldEdgeError(
            "More than two faces meet at an edge", kind="edge", elements=np.stack([a[h], b[h]], axis=1)
        )
    first, second = pair_up(key)
    first, second = sides[first], sides[second]
    wrong = first[a[first] == a[second]]
    if len(wrong):
        raise OrientationError(
            "Neighbouring faces point to opposite sides", kind="edge", elements=np.stack([a[wrong], b[wrong]], axis=1)
        )
    return np.concatenate([inner[0], first]), np.concatenate([inner[1], second])


def _join(surface, triangles, owner, first, second) -> tuple[np.ndarray, np.ndarray]:
    """Class of every corner and chart of every triangle, joined across the halfedge pairs."""
    tail, head = halfedges(triangles)
    rows = np.concatenate([tail[first], head[first]])
    columns = np.concatenate([head[second], tail[second]])
    c = len(surface.corner_vertex)
    corner_class = connected_components(coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(c, c)), False)[1]
    m = len(triangles)
    # Triangles of one polygon always share its diagonals, so edge pairs alone connect a chart.
    graph = coo_matrix((np.ones(len(first)), (first // 3, second // 3)), shape=(m, m))
    return corner_class, connected_components(graph, directed=False)[1]


def _groups(label: np.ndarray) -> list[np.ndarray]:
    """Indices of equal labels, one array per label in order."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def _make(surface: Surface, members: np.ndarray, triangles, owner, corner_class) -> Chart:
    corners = triangles[members]
    classes, index, inverse = np.unique(corner_class[corners], return_index=True, return_inverse=True)
    vertex_ids = surface.corner_vertex[corners.ravel()[index]]
    local = inverse.reshape(-1, 3).astype(np.int64)
    chart = Chart(surface.positions[vertex_ids], local, corners, owner[members], vertex_ids)
    _check_edges(chart)
    _check_disk(chart)
    return chart


def _check_edges(chart: Chart) -> None:
    """Straight lines in the plane cannot tell apart two edges, or diagonals, between the same two vertices."""
    tail, head = halfedges(chart.triangles)
    unique, index, count = np.unique(pair_keys(tail, head), return_index=True, return_counts=True)
    wrong = index[count > 2]
    if len(wrong):
        raise NonManifoldEdgeError(
            "Two faces share several edges in a row, so that their diagonals coincide",
            remedy="Triangulate these faces, or dissolve the vertex that only they share",
            kind="edge",
            elements=chart.vertex_ids[np.stack([tail[wrong], head[wrong]], axis=1)],
        )


def _check_disk(chart: Chart) -> None:
    loops = boundary_loops(chart.triangles)
    n, m, b = len(chart.vertices), len(chart.triangles), sum(len(loop) for loop in loops)
    euler = n - (3 * m + b) // 2 + m
    handles = (2 - euler - len(loops)) // 2
    faces = np.unique(chart.faces)
    if not loops:
        shape = "sphere" if handles == 0 else f"surface of genus {handles}"
        raise NotADiskError(f"A chart is a closed {shape} without a boundary", kind="face", elements=faces)
    if len(loops) > 1:
        rest = np.concatenate([np.stack([x, np.roll(x, -1)], axis=1) for x in loops[1:]])
        raise NotADiskError(
            f"A chart has {len(loops)} boundaries instead of one",
            remedy="Mark seams that join the boundaries, or fill the holes",
            kind="edge",
            elements=chart.vertex_ids[rest],
        )
    if handles:
        plural = "a handle" if handles == 1 else f"{handles} handles"
        raise NotADiskError(f"A chart has {plural}", kind="face", elements=faces)
