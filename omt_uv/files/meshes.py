"""Load mesh files, with coordinates and the order of vertices and faces kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy

import numpy as np

from ..blender.mesh import new_mesh
from ..blender.versions import known_options
from .ply_uvs import add_uvs
from .silence import silence
from .verified import FileError, check_length

READABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".fbx", ".off")
# Blender turns these two formats by default; their axes are taken as they are.
AXES = {"forward_axis": "Y", "up_axis": "Z"}


def load(path: Path) -> list[bpy.types.Object]:
    """Open a file in an emptied session and return its mesh objects, in order.

    Raises
    ------
    FileError : no such file, an unknown format, or Blender cannot read it
    """
    check_suffix(path, READABLE)
    check_length(path)
    if not path.is_file():
        raise FileError(f"{path}: there is no such file")
    try:
        with silence() as log:
            _READERS[path.suffix.lower()](str(path.resolve()))
    except (RuntimeError, ValueError, IndexError, OSError) as error:
        raise FileError(f"{path}: {last_line(str(error)) or 'cannot be read'}") from error
    objects = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    if not objects:
        printed = last_line(log())
        # Readers that find nothing to read may say no more than how long that took.
        raise FileError(f"{path}: {printed if printed and 'took' not in printed else 'the file has no mesh'}")
    bpy.context.view_layer.update()
    return objects


def check_suffix(path: Path, known: tuple[str, ...]) -> None:
    """Raise FileError unless the suffix of a path is a known one."""
    if path.suffix.lower() not in known:
        raise FileError(f"{path}: unknown format {path.suffix!r}. Use one of {' '.join(known)}.")


def last_line(text: str) -> str:
    """The last line of what Blender printed that says anything."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1].removeprefix("Error: ") if lines else ""


def _read_blend(path: str) -> None:
    """Open a .blend file, in Object Mode."""
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=False)
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def _reader(read: Callable[[str], object]) -> Callable[[str], None]:
    """A reader of a format that adds to the open session."""

    def run(path: str) -> None:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        read(path)

    return run


def _read_off(path: str) -> None:
    """Object File Format: OFF, counts, vertices, faces as vertex counts and indices; colours are ignored."""
    lines = [line.split("#")[0].split() for line in Path(path).read_text().splitlines()]
    lines = [line for line in lines if line]
    if not lines or lines[0][0] not in {"OFF", "COFF"}:
        raise ValueError("the first word is not OFF")
    lines[0] = lines[0][1:]
    lines = [line for line in lines if line]
    n, f = int(lines[0][0]), int(lines[0][1])
    if len(lines) < 1 + n + f:
        raise ValueError("the file ends too early")
    positions = [tuple(map(float, line[:3])) for line in lines[1 : 1 + n]]
    faces = [tuple(map(int, line[1 : 1 + int(line[0])])) for line in lines[1 + n : 1 + n + f]]
    if faces and not 0 <= min(map(min, faces)) <= max(map(max, faces)) < n:
        raise ValueError("a face has a vertex that does not exist")
    name = Path(path).stem
    mesh = new_mesh(name, positions, faces)
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


def _read_glb(path: str) -> None:
    """Read a binary glTF file."""
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
    ".glb": _reader(_read_glb),
    ".fbx": _reader(_read_fbx),
    ".off": _reader(_read_off),
}
