"""Tell what Blender did not take from a file, and keep coordinates that single precision would round.

Single precision has seven digits: of a survey in metres it leaves half metres. Where positions can be read as they
stand in the file, the mesh is moved to the origin and the object put where it was.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy

import numpy as np

from ..solver.errors import plural
from .formats.headers import check_header
from .formats.off import read_off
from .in_place import obj_text, ply
from .in_place.imported import InPlaceError

# Share of the extent by which rounding matters: a thousandth of an edge of a mesh of a million faces.
ROUNDED = 1e-6
# Blender reads what single precision does not have as 0: words like NaN, and exponents of 38 and more.
STRANGE = re.compile(rb"nan|inf|[0-9.]e\+?(?:3[89]|[4-9][0-9]|[0-9]{3})", re.IGNORECASE)
TEXT = (".obj", ".ply", ".off")
# Squares of greater numbers leave single precision, in which Blender computes.
HUGE = 1e18


@dataclass(frozen=True)
class Loaded:
    """What a file holds that its objects do not: texts for `--strict` to refuse; `loss` : by how much coordinates are
    rounded wherever they are stored in the world, 0 where they are not; `moved` : a text about it"""

    texts: tuple[str, ...] = ()
    loss: float = 0.0
    moved: str = ""


def compare(path: Path, objects: Sequence[bpy.types.Object]) -> Loaded:
    """Compare objects with the file that they come from; moves a mesh that single precision would round."""
    texts = [*_faces(path, objects), *_coordinates(path, objects)]
    if path.suffix.lower() == ".blend":
        return Loaded(tuple(texts))
    suspect = [obj for obj in objects if _is_far(positions_of(obj.data))]
    if not suspect:
        return Loaded(tuple(texts))
    exact = _exact_positions(path) if len(objects) == 1 else None
    if exact is None:
        loss = max(float(np.spacing(np.abs(positions_of(obj.data)).max())) / 2 for obj in suspect)
        texts.append(f"Coordinates are so far from the origin that single precision rounds them by up to {loss:.2g}")
        return Loaded(tuple(texts), loss)
    return _moved(objects[0], exact, texts)


def positions_of(mesh: bpy.types.Mesh) -> np.ndarray:
    """Positions (n,3) float32 of the vertices of a mesh."""
    values = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def _faces(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """What is to be said of faces that are in the file alone."""
    declared = check_header(path)
    if path.suffix.lower() == ".obj":
        declared = sum(line.lstrip()[:2] in (b"f ", b"f\t") for line in path.read_bytes().splitlines())
    there = sum(len(obj.data.polygons) for obj in objects)
    if declared is None or there >= declared:
        return []
    why = "they name vertices that do not exist, or one twice, or the file ends before them"
    return [f"{declared - there} of {declared} faces {plural(declared - there, 'was', 'were')} not read: {why}"]


def _coordinates(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """What is to be said of coordinates that are no finite numbers, or huge ones.

    Those that Blender holds and a face needs are an error later on, which names them.
    """
    strange = sum(int((~np.isfinite(positions_of(obj.data)).all(axis=1) & ~_used(obj.data)).sum()) for obj in objects)
    if path.suffix.lower() in TEXT and STRANGE.search(path.read_bytes()):
        exact = _exact_positions(path)
        if exact is not None and all(np.isfinite(positions_of(obj.data)).all() for obj in objects):
            with np.errstate(over="ignore"):
                strange = int((~np.isfinite(exact.astype(np.float32))).any(axis=1).sum())
    huge = sum(int((np.abs(positions_of(obj.data)) > HUGE).any(axis=1).sum()) for obj in objects)
    texts = [f"{strange} of its vertices have coordinates beyond single precision, or none"] if strange else []
    return [*texts, *([f"{huge} of its vertices have coordinates above {HUGE:.0e}"] if huge else [])]


def _used(mesh: bpy.types.Mesh) -> np.ndarray:
    """Which vertices (n,) bool are corners of faces."""
    corner, used = np.zeros(len(mesh.loops), np.int32), np.zeros(len(mesh.vertices), bool)
    mesh.loops.foreach_get("vertex_index", corner)
    used[corner] = True
    return used


def _is_far(positions: np.ndarray) -> bool:
    """Whether single precision may round positions (n,3) by more than a small share of their extent."""
    positions = positions[np.isfinite(positions).all(axis=1)]
    if not len(positions):
        return False
    extent = np.ptp(positions.astype(float), axis=0).max()
    # Half a mesh of extent 0 may be all that rounding has left.
    return bool(np.spacing(np.abs(positions).max()) / 2 > ROUNDED * max(extent, 1e-30))


def _exact_positions(path: Path) -> np.ndarray | None:
    """Positions (n,3) as they stand in the file, None where they cannot be read."""
    try:
        match path.suffix.lower():
            case ".obj":
                return obj_text.read(path.read_bytes()).positions
            case ".ply":
                return ply.read(path.read_bytes()).positions
            case ".off":
                return read_off(path)[0]
    except InPlaceError:
        return None
    return None


def _moved(obj: bpy.types.Object, exact: np.ndarray, texts: list[str]) -> Loaded:
    """Put an object where the middle of its mesh is, and the mesh to the origin, where rounding is worth it."""
    found = positions_of(obj.data).astype(float)
    finite = bool(len(exact)) and bool(np.isfinite(exact).all())
    if exact.shape != found.shape or not finite or not np.isfinite(found).all():
        return Loaded(tuple(texts))
    loss = float(np.abs(exact - found).max())
    # Another order, or other axes, would be no rounding.
    if loss > np.spacing(np.float32(np.abs(exact).max())) or loss <= ROUNDED * np.ptp(exact, axis=0).max():
        return Loaded(tuple(texts))
    middle = ((exact.min(axis=0) + exact.max(axis=0)) / 2).astype(np.float32).astype(float)
    obj.data.vertices.foreach_set("co", (exact - middle).astype(np.float32).ravel())
    obj.data.update()
    obj.location = middle
    bpy.context.view_layer.update()
    place = ", ".join(f"{x:.9g}" for x in middle)
    moved = f"Single precision would round coordinates by up to {loss:.2g}: the mesh is taken relative to ({place})"
    return Loaded(tuple(texts), loss, moved)
