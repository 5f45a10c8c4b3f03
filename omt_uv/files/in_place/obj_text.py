"""Read the lines of an OBJ file that hold positions, UVs and faces; all bytes are kept."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .imported import InPlaceError

WORD = re.compile(rb"[^\s\\#]+")
CONTINUED = re.compile(rb"\\\r?\n")
# Lines of faces whose words are taken at once.
AT_ONCE = 50_000


@dataclass(frozen=True)
class ObjText:
    """The lines of an OBJ file, with continuation lines joined by what joined them, and what they say.

    positions (n,3); uv (m,2) and uv_line (m,); of faces their line (f,), face_start (f+1,), and of their corners the
    vertex and UV (c,), -1 where there is none. Polylines and points stand among the faces; is_face (f,) tells them
    apart; last_vertex (f,): the line of positions, normals or parameters before; has_surfaces : of free form, with UVs
    """

    lines: list[bytes]
    positions: np.ndarray
    uv: np.ndarray
    uv_line: np.ndarray
    face_line: np.ndarray
    face_start: np.ndarray
    corner_vertex: np.ndarray
    corner_uv: np.ndarray
    is_face: np.ndarray
    last_vertex: np.ndarray
    has_surfaces: bool


def read(data: bytes) -> ObjText:
    """Read an OBJ file.

    Raises
    ------
    InPlaceError : a line of positions has no numbers
    """
    lines = _logical_lines(data)
    vertices: list[bytes] = []
    uv_line: list[int] = []
    faces: list[tuple[int, int, int, int, bool]] = []
    before, has_surfaces = -1, False
    for i, line in enumerate(lines):
        kind = line[:2] if line[:1] not in b" \t" else line.lstrip()[:2]
        if kind in (b"v ", b"v\t"):
            vertices.append(line)
            before = i
        elif kind in (b"vt", b"vn", b"vp"):
            if kind == b"vt":
                uv_line.append(i)
            before = i
        elif kind in (b"f ", b"f\t", b"l ", b"p ", b"l\t", b"p\t"):
            faces.append((i, len(vertices), len(uv_line), before, kind[:1] == b"f"))
        elif kind in (b"su", b"cu") and line.split()[:1] in ([b"surf"], [b"curv"], [b"curv2"]):
            has_surfaces = True
    where = np.array(faces, np.int64).reshape(-1, 5)
    start, corner_vertex, corner_uv = _corners(lines, faces)
    return ObjText(
        lines=lines,
        positions=numbers(vertices, 3),
        uv=_uvs([lines[i] for i in uv_line]),
        uv_line=np.array(uv_line, np.int64),
        face_line=where[:, 0],
        face_start=start,
        corner_vertex=corner_vertex,
        corner_uv=corner_uv,
        is_face=where[:, 4] > 0,
        last_vertex=where[:, 3],
        has_surfaces=has_surfaces,
    )


def words(line: bytes) -> list[bytes]:
    """What a line says, without its comment."""
    if b"#" in line:
        line = line[: line.index(b"#")]
    return WORD.findall(line) if b"\\" in line else line.split()


def _logical_lines(data: bytes) -> list[bytes]:
    """Lines with their ends, those that a backslash continues as one."""
    pieces = data.split(b"\n")
    lines = [piece + b"\n" for piece in pieces[:-1]] + ([pieces[-1]] if pieces[-1] else [])
    if not CONTINUED.search(data):
        return lines
    joined: list[bytes] = []
    open_line = False
    for line in lines:
        if open_line:
            joined[-1] += line
        else:
            joined.append(line)
        open_line = line.endswith((b"\\\n", b"\\\r\n"))
    return joined


def numbers(lines: Sequence[bytes], columns: int) -> np.ndarray:
    """The first numbers (k, columns) of lines."""
    try:
        rows = [[float(word) for word in words(line)[1 : 1 + columns]] for line in lines]
        return np.array(rows, float).reshape(len(lines), columns)
    except ValueError as error:
        raise InPlaceError("a line of positions lacks a number") from error


def _uvs(lines: Sequence[bytes]) -> np.ndarray:
    """UVs (k,2) of lines; what is missing, or no finite number, is 0."""
    try:
        found = numbers(lines, 2)
    except InPlaceError:
        found = np.array([[_float(word) for word in (words(line)[1:3] + [b"", b""])[:2]] for line in lines], float)
    return np.where(np.isfinite(found), found, 0.0)


def _float(word: bytes) -> float:
    """The number that a word says, 0 if it says none."""
    try:
        return float(word)
    except ValueError:
        return 0.0


def _corners(lines: list[bytes], faces: list) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """face_start (f+1,), vertices (c,) and UVs (c,) of face lines; -1 for what is not there."""
    # Some after the others: the words of all lines take several times the memory of their text.
    parts = [_some_corners(lines, faces[k : k + AT_ONCE]) for k in range(0, max(len(faces), 1), AT_ONCE)]
    sizes, vertex, uv = (np.concatenate(x) for x in zip(*parts, strict=True))
    return np.append(0, np.cumsum(sizes)), vertex, uv


def _some_corners(lines: list[bytes], faces: list) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How many corners face lines (f,) have, and their vertices (c,) and UVs (c,)."""
    of = [words(lines[i])[1:] for i, *_ in faces]
    sizes = np.array([len(row) for row in of], np.int64)
    said = _indices([word for row in of for word in row])
    before = np.array([(n, m) for _, n, m, *_ in faces], np.int64).reshape(-1, 2)
    there = np.repeat(before, sizes, axis=0)
    index = np.where(said > 0, said - 1, np.where(said < 0, said + there, -1))
    index[(index < 0) | (index >= there)] = -1
    return sizes, index[:, 0], index[:, 1]


def _indices(corners: list[bytes]) -> np.ndarray:
    """Numbers (c,2) of vertices and UVs that corners say, 0 for none."""
    kinds = {word.count(b"/") for word in corners}
    if len(kinds) == 1 and max(kinds) <= 2:
        # As a rule all corners are alike.
        (slashes,) = kinds
        text = b" ".join(corners).replace(b"//", b"/0/").replace(b"/", b" ")
        try:
            found = np.array(text.split()).astype(np.int64).reshape(len(corners), slashes + 1)
            return np.concatenate([found, np.zeros_like(found)], axis=1)[:, :2] if slashes == 0 else found[:, :2]
        except (ValueError, OverflowError):
            pass
    rows = [word.split(b"/", 2) for word in corners]
    return np.array([[_number(row[0]), _number(row[1]) if len(row) > 1 else 0] for row in rows], np.int64).reshape(
        -1, 2
    )


def _number(word: bytes) -> int:
    """The number that a word says, 0 if it says none that an index can be."""
    try:
        return int(word) if len(word) < 18 else 0
    except ValueError:
        return 0
