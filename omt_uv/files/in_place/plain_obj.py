"""Read small OBJ files of which Blender would make what stands in them: its start takes longer than their unwrap.

Whatever Blender decides of a file is left to it: faces that it drops, vertices that it leaves out, corners of which it
makes triangles in its own way, normals that hardly differ, coordinates that it rounds.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .imported import Imported, InPlaceError
from .obj_text import ObjText, numbers, read

# Files of more bytes take longer than Blender's start.
MOST_BYTES = 1 << 22
NUMBER = rb"[ \t]+-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
CORNER = rb"[ \t]+\d+(?:/\d*/\d+|/\d+)?"
# No backslash, which continues a line, stands in any of these.
LINE = re.compile(
    rb"(?:v(?:%b){3}|vt(?:%b){2}|vn(?:%b){3}|f(?:%b){3,4}|(?:(?:o|g|s|usemtl|mtllib)[ \t]|#)[^\\\r\n]*|)[ \t]*\r?"
    % (NUMBER, NUMBER, NUMBER, CORNER)
)
# Names that Blender keeps, and that are the same in every encoding.
NAME = re.compile(r"[A-Za-z0-9_ -]{1,60}")
# Of extents, how far off the origin a mesh may lie: farther off, single precision could round it.
FARTHEST = 16.0
GREATEST = 1e9
# Cosine of the angle between normals of halves of a quad up to which rounding may decide which diagonal is taken.
UNDECIDED = 1e-3
# One minus the cosine of the angle between normals that Blender takes for one, and for two: it parts them at 1e-4.
SAME = 1e-6
OTHER = 1.2e-4
# Of shorter ones it makes its own.
LEAST_NORMAL = 0.5


@dataclass(frozen=True)
class PlainObj:
    """One mesh as Blender would hold it: its `Imported`, without a layer where it has no UVs.

    triangles (m,3) of corners; triangle_face (m,); sharp (k,2) vertex pairs of the edges that its normals make sharp
    """

    mesh: Imported
    triangles: np.ndarray
    triangle_face: np.ndarray
    sharp: np.ndarray

    @property
    def name(self) -> str:
        """Of its object, which is that of the mesh."""
        return self.mesh.name

    @property
    def uv(self) -> np.ndarray | None:
        """UVs (c,2) float32, None where it has none."""
        return self.mesh.uv if self.mesh.layers else None

    def with_uv(self, corners: np.ndarray, uv: np.ndarray) -> PlainObj:
        """The same with UVs (k,2) at corners (k,); what had none is 0 elsewhere."""
        values = np.zeros((len(self.mesh.corner_vertex), 2), np.float32) if self.uv is None else self.uv.copy()
        values[corners] = uv
        return replace(self, mesh=replace(self.mesh, layers=(values,)))


def read_plain(path: Path) -> PlainObj | None:
    """The mesh of an OBJ file, None where Blender may make something else of the file than what stands in it."""
    try:
        if not NAME.fullmatch(path.stem) or path.stat().st_size > MOST_BYTES:
            return None
        data = path.read_bytes()
        if not all(map(LINE.fullmatch, data.split(b"\n"))):
            return None
        text = read(data)
    except (OSError, InPlaceError):
        return None
    sizes = np.diff(text.face_start)
    if not len(sizes) or not _is_whole(text, sizes) or not _is_near(text.positions):
        return None
    named = [word.split(b"/") for i in text.face_line.tolist() for word in text.lines[i].split()[1:]]
    uvs, normals = ([words[k] for words in named if len(words) > k and words[k]] for k in (1, 2))
    if uvs and (len(uvs) < len(named) or text.corner_uv.min() < 0):
        return None
    sharp = np.zeros((0, 2), np.int64) if not normals else None
    if len(normals) == len(named):
        sharp = _sharp_edges(text, np.array(normals).astype(np.int64) - 1)
    positions = text.positions.astype(np.float32)
    triangles = _triangles(positions[text.corner_vertex].astype(float), text.face_start, sizes)
    if triangles is None or sharp is None:
        return None
    layers = (text.uv[text.corner_uv].astype(np.float32),) if uvs else ()
    mesh = Imported(path.stem, positions, text.corner_vertex, text.face_start, layers, 0)
    return PlainObj(mesh, triangles, np.repeat(np.arange(len(sizes)), sizes - 2), sharp)


def _is_whole(text: ObjText, sizes: np.ndarray) -> bool:
    """Whether all vertices are corners of faces, and no face is there twice, or has one of its vertices twice."""
    corner, n = text.corner_vertex, len(text.positions)
    if corner.min() < 0 or not (np.bincount(corner, minlength=n) > 0).all():
        return False
    rows = np.full((len(sizes), 4), n)
    rows[np.arange(4) < sizes[:, None]] = corner
    rows.sort(axis=1)
    twice = (rows[:, 1:] == rows[:, :-1]) & (rows[:, 1:] < n)
    return not twice.any() and len(np.unique(rows, axis=0)) == len(rows)


def _is_near(positions: np.ndarray) -> bool:
    """Whether single precision has positions (n,3) as exactly as it has any."""
    if not np.isfinite(positions).all():
        return False
    farthest = np.abs(positions).max()
    return bool(farthest < GREATEST and farthest <= FARTHEST * np.ptp(positions, axis=0).max())


def _sharp_edges(text: ObjText, named: np.ndarray) -> np.ndarray | None:
    """Vertex pairs (k,2) of edges with other normals on either side at one of their ends; None where Blender may find
    others. named : the normal (c,) of every corner"""
    normals = numbers([line for line in text.lines if line.startswith(b"vn")], 3)
    if named.min() < 0 or named.max() >= len(normals):
        return None
    length = np.linalg.norm(normals[named], axis=1)
    here = text.corner_vertex
    after = np.arange(1, len(here) + 1)
    after[text.face_start[1:] - 1] = text.face_start[:-1]
    there, n = here[after], len(text.positions)
    # Edges as their faces run along them: the other face of one runs back.
    key, back = here * n + there, there * n + here
    order = np.argsort(key)
    if not (length > LEAST_NORMAL).all() or (np.diff(key[order]) == 0).any():
        return None
    place = np.minimum(np.searchsorted(key[order], back), len(key) - 1)
    is_inside = key[order[place]] == back
    edge = np.flatnonzero(is_inside & (here < there))
    twin, direction = order[place[edge]], normals[named] / length[:, None]
    ends = [(edge, after[twin]), (after[edge], twin)]
    apart = np.stack([1 - np.einsum("ij,ij->i", direction[a], direction[b]) for a, b in ends])
    if ((apart > SAME) & (apart < OTHER)).any():
        return None
    found = edge[(apart >= OTHER).any(axis=0)]
    if np.isin(np.stack([here[found], there[found]]), [here[~is_inside], there[~is_inside]]).any():
        # At the ends of a boundary vertex's fan it compares the last face with the first, and marks another edge.
        return None
    return np.stack([here[found], there[found]], axis=1)


def _triangles(points: np.ndarray, start: np.ndarray, sizes: np.ndarray) -> np.ndarray | None:
    """Corners (m,3) of Blender's triangles of faces with corners at points (c,3); None where rounding decides."""
    is_quad = sizes == 4
    a, b, c, d = (points[start[:-1][is_quad] + k] for k in range(4))
    # A quad whose two halves face away from one another is cut along its other diagonal.
    left, right = np.cross(b - a, c - a), np.cross(d - a, c - a)
    along = np.einsum("ij,ij->i", left, right)
    apart = np.sqrt(np.einsum("ij,ij->i", left, left) * np.einsum("ij,ij->i", right, right))
    if not (np.abs(along) > UNDECIDED * apart).all():
        return None
    other = np.zeros(len(sizes), bool)
    other[is_quad] = along > 0
    face = np.repeat(np.arange(len(sizes)), sizes - 2)
    second = np.append(False, face[1:] == face[:-1])
    pattern = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
    return start[face, None] + pattern[other[face].astype(int), second.astype(int)]
