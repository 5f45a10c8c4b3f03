"""Load and save mesh files, with coordinates and the order of vertices and faces kept."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import bpy

import bmesh
import numpy as np

from ..blender.mesh import new_mesh
from ..errors import UserError
from .obj_precision import restore_precision
from .silence import silence

READABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".fbx", ".off")
WRITABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".fbx")
# Blender turns these two formats by default; their axes are taken as they are.
AXES = {"forward_axis": "Y", "up_axis": "Z"}


class FileError(UserError):
    """A file that cannot be read or written."""


def load(path: Path) -> list[bpy.types.Object]:
    """Open a file in an emptied session and return its mesh objects, in order.

    Raises
    ------
    FileError : no such file, an unknown format, or Blender cannot read it
    """
    _check_suffix(path, READABLE)
    if not path.is_file():
        raise FileError(f"{path}: there is no such file")
    try:
        with silence() as log:
            _READERS[path.suffix.lower()](str(path.resolve()))
    except (RuntimeError, ValueError, IndexError, OSError) as error:
        raise FileError(f"{path}: {_last_line(str(error)) or 'cannot be read'}") from error
    objects = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    if not objects:
        printed = _last_line(log())
        # Readers that find nothing to read may say no more than how long that took.
        raise FileError(f"{path}: {printed if printed and 'took' not in printed else 'the file has no mesh'}")
    bpy.context.view_layer.update()
    return objects


def save(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """Write mesh objects to a file, a .blend with everything around them; returns warnings.

    Other formats are written in a folder of their own first, so that a failure leaves nothing half written.

    Raises
    ------
    FileError : an unknown format, or the file cannot be written
    """
    _check_suffix(path, WRITABLE)
    path = path.resolve()
    if not path.parent.is_dir():
        raise FileError(f"{path}: there is no such folder")
    try:
        if path.suffix.lower() == ".blend":
            with silence():
                bpy.context.preferences.filepaths.save_version = 0
                bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
            return []
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".omt_uv_") as folder:
            with silence():
                warnings = _WRITERS[path.suffix.lower()](Path(folder) / path.name, objects)
            for made in Path(folder).iterdir():
                os.replace(made, path.parent / made.name)
        return warnings
    except (RuntimeError, OSError) as error:
        raise FileError(f"{path}: {_last_line(str(error)) or 'cannot be written'}") from error


def _check_suffix(path: Path, known: tuple[str, ...]) -> None:
    """Raise FileError unless the suffix of a path is a known one."""
    if path.suffix.lower() not in known:
        raise FileError(f"{path}: unknown format {path.suffix!r}. Use one of {' '.join(known)}.")


def _last_line(text: str) -> str:
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
        bpy.ops.wm.fbx_import(filepath=path, validate_meshes=False, use_anim=False)
    else:
        bpy.ops.import_scene.fbx(filepath=path, use_anim=False)
    for obj in bpy.context.scene.objects:
        # Turned to other axes and back, with a rest of 4e-8.
        matrix = np.array(obj.matrix_basis)
        if np.abs(matrix - matrix.round()).max() < 1e-6:
            obj.matrix_basis = matrix.round().T


# Validation would drop faces; what is wrong with them is reported later, by name.
_READERS: dict[str, Callable[[str], None]] = {
    ".blend": _read_blend,
    ".obj": _reader(
        lambda path: bpy.ops.wm.obj_import(filepath=path, validate_meshes=False, use_split_objects=False, **AXES)
    ),
    ".ply": _reader(lambda path: bpy.ops.wm.ply_import(filepath=path, merge_verts=False, **AXES)),
    ".stl": _reader(lambda path: bpy.ops.wm.stl_import(filepath=path, use_mesh_validate=False, **AXES)),
    # Shapes of bones would be meshes that the file does not have.
    ".glb": _reader(
        lambda path: bpy.ops.import_scene.gltf(filepath=path, merge_vertices=False, disable_bone_shape=True)
    ),
    ".fbx": _reader(_read_fbx),
    ".off": _reader(_read_off),
}


def _select_only(objects: Sequence[bpy.types.Object]) -> None:
    """Select these objects and no others."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(False)
    for obj in objects:
        obj.hide_set(False)
        obj.hide_viewport = obj.hide_select = False
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


def _write_obj(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """Write an OBJ file; returns warnings."""
    _select_only(objects)
    # The exporter sorts faces by material, and only where it writes materials.
    ordered = all(_materials_ascend(obj.data) for obj in objects)
    bpy.ops.wm.obj_export(
        filepath=str(path),
        export_selected_objects=True,
        export_materials=ordered and any(obj.data.materials for obj in objects),
        export_normals=any(obj.data.has_custom_normals for obj in objects),
        apply_modifiers=False,
        **AXES,
    )
    restore_precision(path, objects)
    return [] if ordered else ["Materials were left out of the OBJ file, which would have changed the order of faces"]


def _materials_ascend(mesh: bpy.types.Mesh) -> bool:
    """Whether faces come in the order of their materials, by which the exporter sorts them."""
    index = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    return bool((np.diff(index) >= 0).all())


def _write_ply(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """PLY keeps one UV per vertex; the exporter would renumber all vertices, so seams are cut beforehand."""
    cut = []
    for obj in objects:
        copy = obj.copy()
        copy.data = obj.data.copy()
        bpy.context.scene.collection.objects.link(copy)
        _cut_uv_seams(copy.data)
        cut.append(copy)
    _select_only(cut)
    bpy.ops.wm.ply_export(
        filepath=str(path),
        export_selected_objects=True,
        export_uv=False,
        export_attributes=True,
        export_normals=any(obj.data.has_custom_normals for obj in objects),
        apply_modifiers=False,
        **AXES,
    )
    for copy in cut:
        bpy.data.meshes.remove(copy.data)
    return []


def _cut_uv_seams(mesh: bpy.types.Mesh) -> None:
    """Split vertices with several UVs, the new ones at the end, and store the UVs as vertex attributes s and t."""
    edit = bmesh.new()
    edit.from_mesh(mesh)
    layer = edit.loops.layers.uv.active
    if layer is None:
        edit.free()
        return
    bmesh.ops.split_edges(edit, edges=[edge for edge in edit.edges if _is_uv_seam(edge, layer)])
    for vertex in list(edit.verts):
        # Faces that touch in this vertex alone, with UVs of their own.
        corners = list(vertex.link_loops)
        for loop in corners[1:]:
            if loop[layer].uv != corners[0][layer].uv:
                bmesh.utils.face_vert_separate(loop.face, vertex)
    edit.to_mesh(mesh)
    edit.free()
    corner_vertex, uv = np.zeros(len(mesh.loops), np.int32), np.zeros(2 * len(mesh.loops), np.float32)
    mesh.loops.foreach_get("vertex_index", corner_vertex)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    for axis, name in enumerate("st"):
        values = np.zeros(len(mesh.vertices), np.float32)
        values[corner_vertex] = uv[axis::2]
        if name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])
        mesh.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", values)


def _is_uv_seam(edge: bmesh.types.BMEdge, layer) -> bool:
    """Whether the UVs of a layer differ on the two sides of an edge."""
    if len(edge.link_loops) != 2:
        return False
    a, b = edge.link_loops
    return a[layer].uv != b.link_loop_next[layer].uv or a.link_loop_next[layer].uv != b[layer].uv


def _write_stl(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """Write an STL file; returns warnings."""
    _select_only(objects)
    bpy.ops.wm.stl_export(filepath=str(path), export_selected_objects=True, apply_modifiers=False, **AXES)
    return ["STL files hold no UVs; write .blend, .obj, .ply, .glb or .fbx to keep them"]


def _write_glb(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """Write a binary glTF file; returns warnings."""
    _select_only(objects)
    bpy.ops.export_scene.gltf(
        filepath=str(path),
        export_format="GLB",
        use_selection=True,
        # Flat normals would split every vertex; a file without normals is shaded flat all the same.
        export_normals=any(obj.data.has_custom_normals for obj in objects),
    )
    return []


def _write_fbx(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """Write an FBX file; returns warnings."""
    _select_only(objects)
    bpy.ops.export_scene.fbx(
        filepath=str(path), use_selection=True, object_types={"MESH"}, use_mesh_modifiers=False, bake_anim=False
    )
    return []


_WRITERS: dict[str, Callable[[Path, Sequence[bpy.types.Object]], list[str]]] = {
    ".obj": _write_obj,
    ".ply": _write_ply,
    ".stl": _write_stl,
    ".glb": _write_glb,
    ".fbx": _write_fbx,
}
