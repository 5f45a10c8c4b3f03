"""Hold what Blender made of a mesh of a file, and find its faces among those that the file has.

Importers drop faces: with a vertex twice, with one that does not exist, and those that are there twice. So faces are
not counted off but found again by their vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import UserError
from ...solver.errors import plural


class InPlaceError(UserError):
    """UVs cannot be put into a file as it is; the text says what is in the way."""


@dataclass(frozen=True)
class Imported:
    """A mesh as Blender holds it.

    positions (n,3) float32; corner_vertex (c,); face_start (f+1,); layers : names and UVs (c,2) float32 of all layers;
    layer : index of the one that was written; name : of the mesh
    """

    name: str
    positions: np.ndarray
    corner_vertex: np.ndarray
    face_start: np.ndarray
    layers: tuple[np.ndarray, ...]
    layer: int

    @property
    def uv(self) -> np.ndarray:
        """UVs (c,2) float32 that were written."""
        return self.layers[self.layer]


def same_places(ours: np.ndarray, theirs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the places of positions (n,3) of a file and (m,3) float32 of Blender: equal where these are.

    Where both are as many and agree to single precision, in whatever place of the world, vertices are their own places.
    """
    if len(ours) == len(theirs) and _agree(ours, theirs):
        return np.arange(len(ours)), np.arange(len(theirs))
    with np.errstate(over="ignore"):
        # Adding zero makes -0.0 and 0.0 the same.
        both = np.concatenate([ours.astype(np.float32), theirs.astype(np.float32)]) + np.float32(0)
    _, place = np.unique(both, axis=0, return_inverse=True)
    place = place.ravel()
    return place[: len(ours)], place[len(ours) :]


def _agree(ours: np.ndarray, theirs: np.ndarray) -> bool:
    """Whether positions are equal but for single precision and an offset."""
    if not len(ours):
        return True
    with np.errstate(invalid="ignore", over="ignore"):
        off = (ours - ours[0]) - (theirs.astype(float) - theirs[0])
        bound = 2 * np.finfo(np.float32).eps * np.abs(ours).max()
        return bool((np.abs(off) <= bound).all())


def find_corners(ours: tuple[np.ndarray, np.ndarray], theirs: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The corner of Blender (c,) for every corner of a file, -1 where its face was dropped.

    ours, theirs : places (c,) of the corners, -1 for a vertex that does not exist, and face_start (f+1,)
    """
    (place, start), (their_place, their_start) = ours, theirs
    if np.array_equal(start, their_start) and np.array_equal(place, their_place):
        return np.arange(len(place))
    waiting: dict[bytes, list[int]] = {}
    for face in range(len(their_start) - 2, -1, -1):
        key = their_place[their_start[face] : their_start[face + 1]].astype(np.int64).tobytes()
        waiting.setdefault(key, []).append(face)
    corner = np.full(len(place), -1)
    for face in range(len(start) - 1):
        begin, end = start[face], start[face + 1]
        found = waiting.get(place[begin:end].astype(np.int64).tobytes())
        if found:
            first = their_start[found.pop()]
            corner[begin:end] = np.arange(first, first + end - begin)
    return corner


def numbered(uv: np.ndarray) -> np.ndarray:
    """Numbers (c,) of UVs (c,2 k) float32, equal where these are."""
    # Adding zero makes -0.0 and 0.0 the same bits; the bits of two numbers are one of twice the size.
    bits = np.ascontiguousarray(uv + np.float32(0), np.float32).view(np.int64)
    found = np.zeros(len(bits), np.int64)
    for column in bits.T:
        value = np.unique(column, return_inverse=True)[1].ravel()
        found = np.unique(found * (value.max(initial=0) + 1) + value, return_inverse=True)[1].ravel()
    return found


def check_found(corner: np.ndarray, start: np.ndarray, is_face: np.ndarray, theirs: int) -> int:
    """Number of faces of a file that Blender dropped.

    corner : of `find_corners`; start (f+1,): where faces of the file start; is_face (f,) bool: which of them are faces;
    theirs : corners that Blender has

    Raises
    ------
    InPlaceError : Blender has faces that are none of the file's
    """
    if np.count_nonzero(corner >= 0) != theirs:
        raise InPlaceError("Blender has faces that are none of the file's")
    filled = is_face & (np.diff(start) > 0)
    return int(is_face.sum() - np.count_nonzero(corner[start[:-1][filled]] >= 0))


def dropped_warning(count: int) -> list[str]:
    """What is said of faces that Blender does not read."""
    if not count:
        return []
    faces = plural(count, "1 face that Blender drops keeps its", "{} faces that Blender drops keep their")
    return [f"{faces} place in the file, and the UVs it had: invalid ones, or there twice"]
