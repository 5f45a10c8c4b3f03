"""Check a polygon surface, and glue its triangles across every edge that is no seam.

What is wrong with a surface is an error that names the elements: nothing is repaired here, see `repair.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import (
    DuplicateFaceError,
    EmptyMeshError,
    NonFiniteError,
    NonManifoldEdgeError,
    OrientationError,
    ZeroAreaFaceError,
)
from .geometry import bounds, cross3, lengths, of_corners, part_by_part, turned_by
from .gluing import Gluing, polygon_gluing
from .topology import FEW_CORNERS, are_among, distinct, next_corners, pair_keys, pair_up, places_in_table, row_labels

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


def triangle_surface(positions: np.ndarray, triangles: np.ndarray, seams=()) -> Surface:
    """The surface of a triangle mesh: positions (n,3), triangles (m,3), seams (k,2)."""
    triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    m = len(triangles)
    corners = np.arange(3 * m).reshape(m, 3)
    seams = np.asarray(seams, dtype=np.int64).reshape(-1, 2)
    return Surface(
        positions=np.asarray(positions, dtype=float),
        corner_vertex=triangles.ravel(),
        face_start=3 * np.arange(m + 1),
        triangles=corners,
        triangle_face=np.arange(m),
        seams=seams,
    )


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
    used = distinct(triangles)[0]
    wrong = used[~of_corners(np.logical_and, np.isfinite(positions.take(used, axis=0)))]
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)


def with_loose_placed(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Positions (n,3), with vertices of no triangle (m,3) that are nowhere upon one of the mesh; see `check_finite`."""
    check_finite(positions, triangles)
    nowhere = ~np.isfinite(positions).all(axis=1)
    return np.where(nowhere[:, None], positions[triangles[0, 0]], positions) if nowhere.any() else positions


def degenerate_triangles(
    positions: np.ndarray, triangles: np.ndarray, flat: float = DEGENERATE, owner: np.ndarray | None = None
) -> np.ndarray:
    """Triangles (m,3) of positions (n,3) that are a line or a point next to the extent of them all, (m,) bool.

    flat : share of the square of its longest side that the area of a line does not exceed; owner (m,) : ascending from
    0, of triangles that only count next to those of the same one
    """
    area, size = part_by_part(lambda some: _relative_areas(positions[some]), triangles).T
    if owner is None or owner[-1] == 0:
        used = np.zeros(len(positions), bool)
        used[triangles] = True
        low, high = bounds(positions if used.all() else positions[used])
        extent = (high / 2 - low / 2).max()
    else:
        begin = np.searchsorted(owner, np.arange(int(owner[-1]) + 1))
        high, low = (
            reduced.reduceat(part_by_part(lambda some, of=reduced: of_corners(of, positions[some]), triangles), begin)
            for reduced in (np.maximum, np.minimum)
        )
        extent = (high / 2 - low / 2).max(axis=1)[owner]
    return (area <= flat) | (size <= 1e-9 * extent)


def _relative_areas(p: np.ndarray) -> np.ndarray:
    """Areas of triangles with corners (m,3,3) over the squares of their sizes, and these sizes: (m,2)."""
    # Halves: the difference of two huge numbers may be infinite.
    side = p / 2 - p[:, :1] / 2
    size = of_corners(np.maximum, of_corners(np.maximum, np.abs(side)))
    # Scaling first keeps tiny and huge meshes clear of underflow and overflow.
    side = side / np.where(size > 0, size, 1)[:, None, None]
    return np.stack([0.5 * lengths(cross3(side[:, 1], side[:, 2])), size], axis=1)


def _check_areas(surface: Surface, triangles: np.ndarray, owner: np.ndarray) -> None:
    """Raise ZeroAreaFaceError where triangles (m,3) of corners have no area, with the polygons (m,) that own them."""
    wrong = degenerate_triangles(surface.positions, surface.corner_vertex[triangles])
    if wrong.any():
        raise ZeroAreaFaceError("Faces have no area", kind="face", elements=np.unique(owner[wrong]))


def duplicate_faces(surface: Surface, faces: np.ndarray) -> np.ndarray:
    """Polygons on the same set of vertices as another: rows (k,3) of polygon, its number among its likes, and the first
    of these. None with a vertex used twice."""
    size = np.diff(surface.face_start)
    rows = [np.zeros((0, 3), np.int64)]
    for s in np.unique(size[faces]):
        index = np.flatnonzero(faces & (size == s))
        index = index[_may_be_double(surface.corner_vertex[surface.face_start[index][:, None] + np.arange(s)])]
        vertices = np.sort(surface.corner_vertex[surface.face_start[index][:, None] + np.arange(s)], axis=1)
        proper = (vertices[:, 1:] != vertices[:, :-1]).all(axis=1)
        index, vertices = index[proper], vertices[proper]
        if not len(index):
            continue
        inverse = row_labels(vertices)
        count = np.bincount(inverse)
        order = np.argsort(inverse, kind="stable")
        number = np.zeros(len(index), np.int64)
        number[order] = np.arange(len(index)) - (np.cumsum(count) - count)[inverse[order]]
        twice = count[inverse] > 1
        first = index[order[np.cumsum(count) - count]][inverse]
        rows.append(np.stack([index[twice], number[twice], first[twice]], axis=1))
    return np.concatenate(rows)


def _may_be_double(vertices: np.ndarray) -> np.ndarray:
    """Which rows (k,s) of vertices may have those of another one, in any order, (k,) bool: all that do, and, of many
    rows, few others. Sums of random numbers tell that, and little is left to be sorted."""
    n = int(vertices.max(initial=-1)) + 1
    if vertices.size <= max(FEW_CORNERS, n):
        return np.ones(len(vertices), bool)
    number = np.random.default_rng(0).integers(1 << 62, size=n)
    place = places_in_table(number[vertices.T].sum(axis=0), len(vertices))
    return np.bincount(place)[place] > 1


def _joined(surface: Surface, triangles: np.ndarray, owner: np.ndarray) -> Gluing:
    """Triangles joined across every edge that is no seam; what cannot be joined is an error."""
    gluing = polygon_gluing(triangles, owner, surface.corner_vertex, surface.face_start)
    sides = np.flatnonzero(gluing.side)
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


@dataclass(frozen=True)
class FlatTriangles:
    """Triangles that lie on an edge or a vertex of other polygons: these polygons (t,), their corners (3t,), and the
    corner (3t,) of another polygon at the same place as each."""

    polygons: np.ndarray
    corners: np.ndarray
    hosts: np.ndarray

    def carried(self, corners: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners (k,), ascending, with UVs (k,2), and those of these triangles, with the UVs of their hosts."""
        at = np.searchsorted(corners, self.hosts)
        there = np.isin(self.hosts, corners)
        every = np.concatenate([corners, self.corners[there]])
        order = np.argsort(every, kind="stable")
        return every[order], np.concatenate([uv, uv[at[there]]])[order]


def side_ends(surface: Surface) -> np.ndarray:
    """The vertices (2,c) at both ends of the side of its polygon that begins at each corner."""
    return np.stack([surface.corner_vertex, surface.corner_vertex[next_corners(surface.face_start)]])


def with_joined_vertices(surface: Surface, same: np.ndarray) -> Surface:
    """The surface with vertices joined: `same` (n,) is the one that stands for each."""
    return replace(
        surface, corner_vertex=same[surface.corner_vertex], seams=same[surface.seams], sharp=same[surface.sharp]
    )


def used_twice(surface: Surface, faces: np.ndarray, label: np.ndarray) -> np.ndarray:
    """The corners (k,) of the polygons `faces` (f,) bool that use a vertex of a label (n,) twice."""
    owner = np.repeat(np.arange(len(faces)), np.diff(surface.face_start))
    joined = np.bincount(label, minlength=int(label.max(initial=0)) + 1)[label] > 1
    corners = np.flatnonzero(faces[owner] & joined[surface.corner_vertex])
    pairs = row_labels(np.stack([owner[corners], label[surface.corner_vertex[corners]]], axis=1))
    return corners[np.bincount(pairs)[pairs] > 1]


def using_twice(surface: Surface) -> np.ndarray:
    """The polygons (k,) with a vertex used twice, ascending."""
    vertex, size = surface.corner_vertex, np.diff(surface.face_start)
    polygon = np.repeat(np.arange(len(size)), size)
    # In a triangle they follow each other: only what has more sides is sorted.
    sides = size[polygon]
    beside = polygon[(vertex == vertex[next_corners(surface.face_start)]) & (sides == 3)]
    key = np.sort((polygon << 32 | vertex)[sides != 3])
    return np.union1d(beside, key[1:][key[1:] == key[:-1]] >> 32)


def turned_surface(surface: Surface, axes: np.ndarray) -> Surface:
    """The surface with its positions multiplied by a rotation (3,3)."""
    return replace(surface, positions=turned_by(surface.positions, axes))


def is_seam(surface: Surface, key: np.ndarray) -> np.ndarray:
    """Whether edges, given by `topology.pair_keys` of their vertices, are seams; (k,) bool."""
    return are_among(key, pair_keys(surface.seams[:, 0], surface.seams[:, 1]))


def is_sharp(surface: Surface, key: np.ndarray) -> np.ndarray:
    """Whether edges, given by `topology.pair_keys` of their vertices, are marked sharp; (k,) bool."""
    return are_among(key, pair_keys(surface.sharp[:, 0], surface.sharp[:, 1]))
