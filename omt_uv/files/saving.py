"""Save mesh files, whole or not at all, and where only UVs are new, with everything else as it was.

A file in the format of its source is that source with other UVs; what Blender writes anew takes along all that the
format holds, and warnings name the rest.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias
from urllib.parse import unquote

import numpy as np

from .in_place.imported import Imported, InPlaceError
from .silence import silence
from .verified import FileError, check_bytes, check_suffix, check_writable, staged

if TYPE_CHECKING:
    import bpy

WRITABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx")
# What can be changed in place, and the module of `in_place` that does it.
IN_PLACE = {".obj": "obj", ".ply": "ply", ".glb": "glb", ".gltf": "gltf"}
COMPRESSED = (b"\x28\xb5\x2f\xfd", b"\x1f\x8b")
Objects: TypeAlias = "Sequence[bpy.types.Object]"


def check_target(path: Path) -> None:
    """Raise FileError unless meshes can be written to a file of this name."""
    check_suffix(path, WRITABLE)
    check_writable(path)


def save(path: Path, objects: Objects, source: Path | None = None) -> list[str]:
    """Write mesh objects alone to a file, a .blend with everything around them; returns warnings.

    source : the file that was read, if a .blend

    Raises
    ------
    FileError : an unknown format, or the file cannot be written
    """
    check_target(path)
    if path.suffix.lower() == ".blend":
        return _save_blend(path, objects, source)
    return _save_anew(path, objects, everything=False)


def save_uvs(path: Path, objects: Objects, source: Path) -> list[str]:
    """Write the file that was read with the UVs that its mesh objects have now; returns warnings.

    Raises
    ------
    FileError : an unknown format, or the file cannot be written
    """
    check_target(path)
    suffix = path.suffix.lower()
    if suffix == ".blend":
        return _save_blend(path, objects, source)
    told = []
    if suffix == source.suffix.lower() and suffix in IN_PLACE:
        from .losses import losses_in_place

        try:
            done, behind = put_uvs(path, [_imported(obj) for obj in objects], source)
            return [*done, *losses_in_place(suffix, objects), *behind]
        except InPlaceError as error:
            told = [
                f"{source.name}: its UVs could not be changed in place: {error}. It was written anew, "
                "and what Blender does not hold is lost"
            ]
    return [*told, *_save_anew(path, objects, everything=True, source=source)]


def put_uvs(path: Path, meshes: Sequence[Imported], source: Path) -> tuple[list[str], list[str]]:
    """Write the bytes of the file that was read with other UVs; returns warnings about its faces and its companions.

    Raises
    ------
    FileError : the file cannot be written
    InPlaceError : the meshes are not those of the file
    """
    suffix = path.suffix.lower()
    # Formats that a file is not of are not read.
    put = importlib.import_module(f"{__package__}.in_place.{IN_PLACE[suffix]}").put
    folders = (source.resolve().parent, path.resolve().parent) if suffix == ".gltf" else ()
    try:
        new, warnings = put(source.read_bytes(), meshes, *folders)
    except OSError as error:
        raise FileError(f"{source}: {error.strerror}") from error
    with staged(path) as made:
        made.write_bytes(new)
        check_bytes(made, new)
    return warnings, _left_behind(new, suffix, source, path)


def _imported(obj: bpy.types.Object) -> Imported:
    """A mesh as Blender holds it."""
    from ..blender.mesh import read_uv

    mesh = obj.data
    positions, corner = np.zeros(3 * len(mesh.vertices), np.float32), np.zeros(len(mesh.loops), np.int32)
    start = np.zeros(len(mesh.polygons), np.int32)
    mesh.vertices.foreach_get("co", positions)
    mesh.loops.foreach_get("vertex_index", corner)
    mesh.polygons.foreach_get("loop_start", start)
    return Imported(
        name=mesh.name,
        positions=positions.reshape(-1, 3),
        corner_vertex=corner.astype(np.int64),
        face_start=np.append(start.astype(np.int64), len(corner)),
        layers=tuple(read_uv(mesh, layer.name) for layer in mesh.uv_layers),
        layer=mesh.uv_layers.active_index,
    )


def _left_behind(data: bytes, suffix: str, source: Path, path: Path) -> list[str]:
    """Warnings if a file in another folder names materials or images that are not there."""
    if suffix == ".ply" or source.resolve().parent == path.resolve().parent:
        return []
    if suffix == ".obj":
        lines = [line.split(None, 1) for line in data.splitlines() if line.lstrip().startswith(b"mtllib ")]
        names = [line[1].strip().decode(errors="replace") for line in lines if len(line) > 1]
    else:
        from .in_place import glb_data

        doc = json.loads(data) if suffix == ".gltf" else glb_data.read(data).doc
        images = doc.get("images", [])
        names = [unquote(image["uri"]) for image in images if not image.get("uri", "data:").startswith("data:")]
    missing = [name for name in dict.fromkeys(names) if not (path.resolve().parent / name).exists()]
    return [
        f"{path.name} names {name}, which is not in its folder. Copy it there, with what it names" for name in missing
    ]


def _save_blend(path: Path, objects: Objects, source: Path | None) -> list[str]:
    """Save the session as a .blend, compressed if its source was."""
    import bpy

    from .meshes import last_line
    from .read_back import check_blend

    with staged(path) as made:
        try:
            with silence():
                bpy.context.preferences.filepaths.save_version = 0
                # A copy: what is read again must not be the file of this session.
                bpy.ops.wm.save_as_mainfile(
                    filepath=str(made),
                    check_existing=False,
                    copy=True,
                    compress=source is not None and _is_compressed(source),
                )
        except RuntimeError as error:
            reason = last_line(str(error))
            raise FileError(f"{path}: cannot be written ({reason}). Is the disk full?") from error
        with silence():
            _named(path, check_blend, made, objects)
    return []


def _is_compressed(path: Path) -> bool:
    with open(path, "rb") as file:
        return file.read(4).startswith(COMPRESSED)


def _save_anew(path: Path, objects: Objects, everything: bool, source: Path | None = None) -> list[str]:
    """Write a file by Blender's exporter, and read it again."""
    from .export import export, exported_meshes
    from .losses import losses
    from .obj_materials import place_materials
    from .read_back import check

    suffix = path.suffix.lower()
    companions: dict[Path, Path] = {}
    meshes = exported_meshes(objects, everything)
    told = losses(suffix, meshes) if everything else []
    with staged(path, companions) as made:
        try:
            with silence():
                told += export(made, suffix, objects, everything)
        except RuntimeError as error:
            raise FileError(f"{path}: {_reason(error)}") from error
        if made.is_file():
            if suffix == ".obj":
                told += place_materials(made, path.resolve(), companions)
            _named(path, check, made, suffix, meshes)
            if suffix == ".fbx" and source is not None and source.suffix.lower() == ".fbx":
                told += _lost_kinds(source, made)
    return told


def _reason(error: RuntimeError) -> str:
    """What an exporter complains about, without the place in its program where it does."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("Location:", "INFO", "Traceback", "File "))]
    return lines[-1].removeprefix("Error: ") if lines else "cannot be written"


def _named(path: Path, check: Callable, *arguments) -> None:
    """Check a file, and name it by its last name where that fails."""
    try:
        check(*arguments)
    except FileError as error:
        raise FileError(f"{path}: {error}") from error


def _lost_kinds(source: Path, made: Path) -> list[str]:
    """A warning that counts what an FBX file had and has no more."""
    from .fbx_nodes import count

    try:
        before = count(source.read_bytes()).kinds
    except FileError:  # a text
        return ["What Blender does not read of an FBX file is lost"]
    lost = before - count(made.read_bytes()).kinds
    # Curves are sampled anew, and as many as there is movement.
    names = [f"{kind} ({n})" for kind, n in lost.items() if not kind.startswith("AnimationCurve")]
    return ["Blender does not carry all of an FBX file; lost: " + ", ".join(names)] if names else []
