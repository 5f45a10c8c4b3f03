"""Load mesh files, with coordinates and the order of vertices and faces kept."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import bpy

import numpy as np

from ..blender.mesh import new_mesh
from ..blender.versions import known_options, open_empty, settle_context
from .formats.headers import check_header
from .formats.off import read_off
from .ply_uvs import add_uvs
from .silence import silence
from .verified import FileError, check_length, check_readable, check_suffix

READABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx", ".off")
# Blender turns these two formats by default; their axes are taken as they are.
AXES = {"forward_axis": "Y", "up_axis": "Z"}
# How the last line of an error that nobody foresaw begins.
TRACED = re.compile(r"[\w.]*(?:Error|Exception): ")


def load(path: Path) -> list[bpy.types.Object]:
    """Open a file in an emptied session and return its mesh objects, in order, those of the active scene first.

    Raises
    ------
    FileError : no such file, an unknown format, or Blender cannot read it
    """
    check_suffix(path, READABLE)
    check_length(path)
    check_readable(path)
    try:
        check_header(path)
        with silence() as log:
            _READERS[path.suffix.lower()](str(path.resolve()))
    except (RuntimeError, ValueError, LookupError, TypeError, ArithmeticError, SystemError, OSError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path}: {_why(str(error))}") from error
    scenes = [bpy.context.scene, *(scene for scene in bpy.data.scenes if scene != bpy.context.scene)]
    for scene in scenes:
        for layer in scene.view_layers:
            layer.update()
    objects = list(dict.fromkeys(obj for scene in scenes for obj in scene.objects if obj.type == "MESH"))
    if not objects:
        lines = [line for line in log().splitlines() if "error" in line.lower()]
        raise FileError(f"{path}: {last_line(lines[-1]) if lines else 'the file has no mesh'}")
    _check_names(path, objects)
    return objects


def _check_names(path: Path, objects: list[bpy.types.Object]) -> None:
    """Raise FileError where a name is no text: Blender reads it, and everything else would stumble over it later."""
    data = bpy.data
    named = [data.scenes, data.collections, data.objects, data.meshes, data.materials]
    named += [x for o in objects for x in (o.vertex_groups, o.data.uv_layers, o.data.attributes)]
    for collection in named:
        try:
            # One by one: of all names at once, the error would be lost in Blender.
            [item.name for item in collection]
        except UnicodeDecodeError as error:
            raise FileError(f"{path}: a name in the file is no text, {error.object!r}. The file is damaged.") from error


def _why(text: str) -> str:
    """What is told of a file that Blender does not read; the errors of its readers' own programs name no cause."""
    last = last_line(text)
    if TRACED.match(last):
        return f"Blender's reader fails on it ({last}). The file is damaged, or holds what that reader does not know."
    return last or "cannot be read"


def last_line(text: str) -> str:
    """The last line of what Blender printed that says anything."""
    lines = [line.strip() for line in text.splitlines()]
    # Where in Blender's own files it happened says nothing.
    lines = [line for line in lines if line and not line.startswith(("Location:", "INFO", "Info:"))]
    return lines[-1].removeprefix("Error: ") if lines else ""


def _read_blend(path: str) -> None:
    """Open a .blend file, in Object Mode, with its windows: what is not open is not saved again."""
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=True, use_scripts=False)
    settle_context()
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def _reader(read: Callable[[str], object]) -> Callable[[str], None]:
    """A reader of a format that adds to the open session."""

    def run(path: str) -> None:
        open_empty()
        read(path)

    return run


def _read_off(path: str) -> None:
    """Open an OFF file."""
    positions, faces = read_off(Path(path))
    name = Path(path).stem
    mesh = new_mesh(name, positions.tolist(), faces)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def _read_fbx(path: str) -> None:
    """Read an FBX file by the reader that this Blender has."""
    # Blender 4.5 and later have a reader of their own; the one in Python came before.
    if "fbx_import" in dir(bpy.ops.wm):
        bpy.ops.wm.fbx_import(filepath=path, validate_meshes=False)
    else:
        bpy.ops.import_scene.fbx(filepath=path)
    for obj in bpy.context.scene.objects:
        # Turned to other axes and back, with a rest of 4e-8.
        matrix = np.array(obj.matrix_basis)
        if np.abs(matrix - matrix.round()).max() < 1e-6:
            obj.matrix_basis = matrix.round().T


def _read_gltf(path: str) -> None:
    """Read a glTF file, binary or text."""
    # Shapes of bones would be meshes that the file does not have.
    options = known_options(bpy.ops.import_scene.gltf, disable_bone_shape=True)
    bpy.ops.import_scene.gltf(filepath=path, merge_vertices=False, **options)


def _read_ply(path: str) -> None:
    """Read a PLY file, with UVs under any of the names that are in use."""
    bpy.ops.wm.ply_import(filepath=path, merge_verts=False, **AXES)
    for obj in bpy.context.scene.objects:
        if obj.type == "MESH":
            add_uvs(Path(path), obj)


# Validation would drop faces; what is wrong with them is reported later, by name.
_READERS: dict[str, Callable[[str], None]] = {
    ".blend": _read_blend,
    ".obj": _reader(
        lambda path: bpy.ops.wm.obj_import(filepath=path, validate_meshes=False, use_split_objects=False, **AXES)
    ),
    ".ply": _reader(_read_ply),
    ".stl": _reader(lambda path: bpy.ops.wm.stl_import(filepath=path, use_mesh_validate=False, **AXES)),
    ".glb": _reader(_read_gltf),
    ".gltf": _reader(_read_gltf),
    ".fbx": _reader(_read_fbx),
    ".off": _reader(_read_off),
}
