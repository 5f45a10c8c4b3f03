"""From a polygon mesh with seams to disk charts, with index maps back to the face corners.

A chart vertex is a class of corners that are joined around a vertex by edges which are no seams, so a seam
that ends inside a chart, and a vertex where two fans meet, are cut open for the map only.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import (
    DuplicateFaceError,
    EmptyMeshError,
    NonFiniteError,
    NonManifoldEdgeError,
    NotADiskError,
    OrientationError,
    ZeroAreaFaceError,
)
from .gluing import Gluing, components, corner_classes, diagonal_pairs, groups, polygon_sides
from .topology import boundary_loops, halfedges, pair_keys, pair_up

# A triangle whose area is below this share of its longest side squared is a line.
DEGENERATE = 1e-10


@dataclass(frozen=True)
class Surface:
    """A polygon mesh as arrays; a corner is a vertex of one polygon.

    positions (n,3), corner_vertex (c,), face_start (f+1,) so that polygon f owns the corners
    face_start[f]:face_start[f+1], triangles (m,3) of corners, triangle_face (m,), seams (k,2) vertex pairs,
    sharp (k,2) vertex pairs of edges that are marked sharp, where cuts are welcome.
    """

    positions: np.ndarray
    corner_vertex: np.ndarray
    face_start: np.ndarray
    triangles: np.ndarray
    triangle_face: np.ndarray
    seams: np.ndarray
    sharp: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))


@dataclass(frozen=True)
class Chart:
    """A disk: vertices (n,3), triangles (m,3), the surface's corners (m,3), faces (m,) and vertex_ids (n,).

    patches (k,3) are triangles that fill holes of the chart. They exist for the map only: they have no corners,
    and vertices that only they use have the id -1. `disk` (m+k,3), the triangles and the patches, is what is a disk.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    faces: np.ndarray
    vertex_ids: np.ndarray
    patches: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))

    @property
    def disk(self) -> np.ndarray:
        """Triangles and patches together, (m+k,3) vertex indices."""
        return np.concatenate([self.triangles, self.patches]) if len(self.patches) else self.triangles


def triangle_surface(positions: np.ndarray, triangles: np.ndarray, seams=()) -> Surface:
    """The surface of a triangle mesh: positions (n,3), triangles (m,3), seams (k,2)."""
    triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    m = len(triangles)
    corners = np.arange(3 * m).reshape(m, 3)
    seams = np.asarray(seams, dtype=np.int64).reshape(-1, 2)
    return Surface(
        np.asarray(positions, dtype=float), triangles.ravel(), 3 * np.arange(m + 1), corners, np.arange(m), seams
    )


def strict_charts(surface: Surface, faces: np.ndarray | None = None) -> list[Chart]:
    """Charts of the polygons `faces` (f,) bool (all by default), each a topological disk.

    Nothing is repaired: see `preparation.prepare` for meshes that need it.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError, DuplicateFaceError, NonManifoldEdgeError,
    OrientationError, NotADiskError : with the indices of the offending elements of the surface
    """
    charts = charts_of(surface, strict_gluing(surface, faces))
    for chart in charts:
        check_edges(chart)
        check_disk(chart)
    return charts


def strict_gluing(surface: Surface, faces: np.ndarray | None = None) -> Gluing:
    """The triangles of sound polygons, joined across every edge that is no seam; raises what `strict_charts` raises."""
    faces, triangles, owner = chosen_triangles(surface, faces)
    _check_areas(surface, triangles, owner)
    duplicates = duplicate_faces(surface, faces)
    if len(duplicates):
        raise DuplicateFaceError(
            "Faces share all their vertices with another face", kind="face", elements=duplicates[:, 0]
        )
    return _joined(surface, triangles, owner)


def chosen_triangles(surface: Surface, faces: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The polygons (f,) bool, their triangles (m,3) of corners, and the polygon (m,) of each.

    Raises
    ------
    EmptyMeshError, NonFiniteError : nothing to unwrap, or not anywhere
    """
    if faces is None:
        faces = np.ones(len(surface.face_start) - 1, dtype=bool)
    faces = np.asarray(faces, dtype=bool)
    chosen = faces[surface.triangle_face]
    triangles, owner = surface.triangles[chosen], surface.triangle_face[chosen]
    if len(triangles) == 0:
        raise EmptyMeshError("There are no faces to unwrap")
    check_finite(surface.positions, surface.corner_vertex[triangles])
    return faces, triangles, owner


def check_finite(positions: np.ndarray, triangles: np.ndarray) -> None:
    """Raise NonFiniteError unless the vertices of triangles (m,3) are somewhere."""
    used = np.unique(triangles)
    wrong = used[~np.isfinite(positions[used]).all(axis=1)]
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)


def degenerate_triangles(positions: np.ndarray, triangles: np.ndarray, flat: float = DEGENERATE) -> np.ndarray:
    """Triangles (m,3) of positions (n,3) that are a line or a point next to the extent of them all, (m,) bool.

    flat : share of the square of its longest side that the area of a line does not exceed
    """
    p = positions[triangles]
    # Halves: the difference of two huge numbers may be infinite.
    side = p / 2 - p[:, :1] / 2
    size = np.abs(side).max(axis=(1, 2))
    # Scaling first keeps tiny and huge meshes clear of underflow and overflow.
    side = side / np.where(size > 0, size, 1)[:, None, None]
    area = 0.5 * np.linalg.norm(np.cross(side[:, 1], side[:, 2]), axis=1)
    extent = np.ptp(p.reshape(-1, 3) / 2, axis=0).max()
    return (area <= flat) | (size <= 1e-9 * extent)


def _check_areas(surface: Surface, triangles: np.ndarray, owner: np.ndarray) -> None:
    wrong = degenerate_triangles(surface.positions, surface.corner_vertex[triangles])
    if wrong.any():
        raise ZeroAreaFaceError("Faces have no area", kind="face", elements=np.unique(owner[wrong]))


def duplicate_faces(surface: Surface, faces: np.ndarray) -> np.ndarray:
    """Polygons on the same set of vertices as another: rows (k,2) of polygon and its number among its likes."""
    size = np.diff(surface.face_start)
    rows = [np.zeros((0, 2), np.int64)]
    for s in np.unique(size[faces]):
        index = np.flatnonzero(faces & (size == s))
        vertices = np.sort(surface.corner_vertex[surface.face_start[index][:, None] + np.arange(s)], axis=1)
        _, inverse, count = np.unique(vertices, axis=0, return_inverse=True, return_counts=True)
        inverse = inverse.ravel()
        order = np.argsort(inverse, kind="stable")
        number = np.zeros(len(index), np.int64)
        number[order] = np.arange(len(index)) - (np.cumsum(count) - count)[inverse[order]]
        twice = count[inverse] > 1
        rows.append(np.stack([index[twice], number[twice]], axis=1))
    return np.concatenate(rows)


def _joined(surface: Surface, triangles: np.ndarray, owner: np.ndarray) -> Gluing:
    """Triangles joined across every edge that is no seam; what cannot be joined is an error."""
    side = polygon_sides(len(surface.corner_vertex), surface.face_start, triangles)
    gluing = Gluing(triangles, owner, surface.corner_vertex, side, *diagonal_pairs(triangles, side))
    sides = np.flatnonzero(side)
    a, b = gluing.ends(sides)
    key = pair_keys(a, b)
    keep = ~is_seam(surface, key)
    sides, key, a, b = sides[keep], key[keep], a[keep], b[keep]
    _, index, count = np.unique(key, return_index=True, return_counts=True)
    if (count > 2).any():
        h = index[count > 2]
        raise NonManifoldEdgeError(
            "More than two faces meet at an edge", kind="edge", elements=np.stack([a[h], b[h]], axis=1)
        )
    first, second = pair_up(key)
    wrong = first[a[first] == a[second]]
    if len(wrong):
        raise OrientationError(
            "Neighbouring faces point to opposite sides", kind="edge", elements=np.stack([a[wrong], b[wrong]], axis=1)
        )
    return replace(
        gluing,
        first=np.concatenate([gluing.first, sides[first]]),
        second=np.concatenate([gluing.second, sides[second]]),
    )


def is_seam(surface: Surface, key: np.ndarray) -> np.ndarray:
    """Whether edges, given by `topology.pair_keys` of their vertices, are seams; (k,) bool."""
    return np.isin(key, pair_keys(surface.seams[:, 0], surface.seams[:, 1]))


def is_sharp(surface: Surface, key: np.ndarray) -> np.ndarray:
    """Whether edges, given by `topology.pair_keys` of their vertices, are marked sharp; (k,) bool."""
    return np.isin(key, pair_keys(surface.sharp[:, 0], surface.sharp[:, 1]))


def charts_of(surface: Surface, gluing: Gluing) -> list[Chart]:
    """One chart per connected part of the sheets, in the order of their first triangles."""
    corner_class = corner_classes(gluing)
    return [_make(surface, c, gluing, corner_class) for c in groups(components(gluing))]


def _make(surface: Surface, members: np.ndarray, gluing: Gluing, corner_class: np.ndarray) -> Chart:
    corners, owner = gluing.triangles[members], gluing.owner[members]
    _, index, inverse = np.unique(corner_class[corners], return_index=True, return_inverse=True)
    vertex_ids = gluing.vertex[corners.ravel()[index]]
    local = inverse.reshape(-1, 3).astype(np.int64)
    # Triangles of no polygon fill holes, see `holes.py`; vertices that only they use are no vertices of the mesh.
    real = owner >= 0
    own = np.zeros(len(vertex_ids), dtype=bool)
    own[local[real]] = True
    positions, ids = surface.positions[vertex_ids], np.where(own, vertex_ids, -1)
    return Chart(positions, local[real], corners[real], owner[real], ids, local[~real])


def triangle_rows(surface: Surface, chart: Chart) -> np.ndarray:
    """Which triangles of the surface the triangles of a chart are, (m,).

    A triangle is known by the smaller two of its corners: no other triangle of its polygon has the same two as such.
    """

    def key(triangles):
        ordered = np.sort(triangles, axis=1)
        return pair_keys(ordered[:, 0], ordered[:, 1])

    keys = key(surface.triangles)
    order = np.argsort(keys)
    return order[np.searchsorted(keys[order], key(chart.corners))]


def check_edges(chart: Chart) -> None:
    """Straight lines in the plane cannot tell apart two edges, or diagonals, between the same two vertices."""
    tail, head = halfedges(chart.disk)
    unique, index, count = np.unique(pair_keys(tail, head), return_index=True, return_counts=True)
    wrong = index[count > 2]
    if len(wrong):
        raise NonManifoldEdgeError(
            "Two faces share several edges in a row, so that their diagonals coincide",
            remedy="Triangulate these faces, or dissolve the vertex that only they share",
            kind="edge",
            elements=chart.vertex_ids[np.stack([tail[wrong], head[wrong]], axis=1)],
        )


def check_disk(chart: Chart) -> None:
    """Raise NotADiskError unless the chart, holes filled, is connected to one boundary without handles."""
    loops = boundary_loops(chart.disk)
    n, m, b = len(chart.vertices), len(chart.disk), sum(len(loop) for loop in loops)
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
            remedy=_boundary_remedy(chart, np.concatenate(loops)),
            kind="edge",
            elements=chart.vertex_ids[rest],
        )
    if handles:
        plural = "a handle" if handles == 1 else f"{handles} handles"
        raise NotADiskError(f"A chart has {plural}", kind="face", elements=faces)


def _boundary_remedy(chart: Chart, rim: np.ndarray) -> str:
    remedy = "Mark seams that join the boundaries, or fill the holes"
    # Adding zero makes -0.0 and 0.0 the same.
    if len(np.unique(chart.vertices[rim] + 0.0, axis=0)) < len(np.unique(chart.vertex_ids[rim])):
        return f"Use Merge by Distance where they touch. {remedy}"
    return remedy
