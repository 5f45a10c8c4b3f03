"""Turn the arrays of a script into surfaces, and UVs of corners back into arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ..mesh.surface import Surface

Faces: TypeAlias = np.ndarray | Sequence[Sequence[int]]


def polygon_surface(vertices: np.ndarray, faces: Faces, seams=()) -> Surface:
    """The surface of polygons that are convex, or nearly: each is a fan about its first corner.

    Parameters
    ----------
    vertices : (n,3) positions
    faces : (m,k) vertex indices, counter-clockwise, or a list of polygons of any numbers of sides
    seams : (s,2) pairs of vertices, edges to cut

    Raises
    ------
    ValueError : arrays of another shape, a polygon of fewer than three corners, an index that is no vertex

    Examples
    --------
    >>> square = polygon_surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    >>> square.triangles.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    vertices = np.asarray(vertices, float)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices must have the shape (n,3), not {vertices.shape}")
    sides = np.array([len(face) for face in faces], np.int64)
    if len(sides) and sides.min() < 3:
        raise ValueError(f"face {int(sides.argmin())} has fewer than three corners")
    corner_vertex = np.concatenate([np.zeros(0, np.int64), *(np.asarray(face, np.int64) for face in faces)])
    if len(corner_vertex) and not (corner_vertex.min() >= 0 and corner_vertex.max() < len(vertices)):
        raise ValueError(f"faces name vertices that are not among the {len(vertices)} given")
    start = np.concatenate([[0], np.cumsum(sides)])
    owner = np.repeat(np.arange(len(sides)), sides - 2)
    second = np.arange(len(owner)) - (np.cumsum(sides - 2) - (sides - 2))[owner] + 1
    first = start[owner]
    triangles = np.stack([first, first + second, first + second + 1], axis=1)
    seams = pairs_of(seams, len(vertices), "seams")
    return Surface(vertices, corner_vertex, start, triangles, owner, seams)


def pairs_of(edges, count: int, name: str) -> np.ndarray:
    """Pairs (k,2) of vertices of so many; `name` is that of the argument, for the error."""
    pairs = np.asarray(edges, np.int64).reshape(-1, 2)
    if len(pairs) and not (pairs.min() >= 0 and pairs.max() < count):
        raise ValueError(f"{name} name vertices that are not among the {count} given")
    return pairs


def of_faces(values, surface: Surface, name: str) -> np.ndarray:
    """Numbers (f,) of the polygons of a surface."""
    return _one_each(values, len(surface.face_start) - 1, name, "faces")


def of_vertices(values, surface: Surface, name: str) -> np.ndarray:
    """Numbers (n,) of the vertices of a surface."""
    return _one_each(values, len(surface.positions), name, "vertices")


def marked_corners(marks, surface: Surface, name: str) -> np.ndarray:
    """Which corners (c,) of a surface are marked."""
    return _one_each(marks, len(surface.corner_vertex), name, "corners", bool)


def _one_each(values, count: int, name: str, what: str, kind: type = float) -> np.ndarray:
    found: np.ndarray = np.asarray(values, kind)
    if found.shape != (count,):
        raise ValueError(f"{name} must have the shape ({count},), one for each of the {what}, not {found.shape}")
    return found


def to_corners(uv: np.ndarray, surface: Surface) -> np.ndarray:
    """UVs (m,k,2) or (c,2) as those of the corners of the surface (c,2)."""
    flat = np.asarray(uv, float).reshape(-1, 2)
    if len(flat) != len(surface.corner_vertex):
        raise ValueError(f"uv has {len(flat)} corners, the faces have {len(surface.corner_vertex)}")
    return flat


def from_corners(corner_uv: np.ndarray, faces: Faces) -> np.ndarray:
    """UVs of the corners (c,2) in the shape of the faces: (m,k,2) for an array (m,k), else as they are."""
    shape = np.shape(faces) if isinstance(faces, np.ndarray) else ()
    return corner_uv.reshape(*shape, 2) if len(shape) == 2 else corner_uv
