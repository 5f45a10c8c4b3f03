"""Write meshes, and what stands around them, by Blender's exporters: with all digits, in the order they have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import bpy

import bmesh
import numpy as np

from ..blender.versions import known_options, settle_context
from ..temporary import own_folder
from .in_place import glb_data, gltf
from .meshes import AXES
from .obj_materials import name_materials
from .obj_precision import restore_precision

Objects = Sequence[bpy.types.Object]
# Types of attributes that are colours.
COLOURS = {"FLOAT_COLOR", "BYTE_COLOR"}


def export(path: Path, suffix: str, objects: Objects, everything: bool) -> list[str]:
    """Write objects in the format of a suffix, with all that stands around them if the format holds it; warnings."""
    for obj in objects:
        # Of another scene, or in a collection that the view layer leaves out.
        if obj.name not in bpy.context.view_layer.objects:
            bpy.context.scene.collection.objects.link(obj)
    return _WRITERS[suffix](path, objects, everything)


def exported_meshes(objects: Objects, everything: bool) -> list[bpy.types.Object]:
    """The mesh objects that are written: those given, or all of the scene."""
    if not everything:
        return list(objects)
    return [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]


def _select_only(objects: Objects) -> None:
    """Select these objects and no others."""
    layer, always = bpy.context.view_layer, bpy.context.scene.collection.objects
    # What was linked a moment ago comes in only then, and comes selected.
    layer.update()
    for obj in layer.objects:
        obj.select_set(False)
    for obj in objects:
        obj.hide_set(False)
        obj.hide_viewport = obj.hide_select = False
        obj.select_set(True)
        if not obj.select_get() and obj.name not in always:
            # All its collections are hidden, or are not to be selected.
            always.link(obj)
            obj.select_set(True)
    layer.objects.active = objects[0]


def _write_obj(path: Path, objects: Objects, everything: bool) -> list[str]:
    """Write an OBJ file; returns warnings."""
    objects = exported_meshes(objects, everything)
    _select_only(objects)
    materials = any(obj.data.materials for obj in objects)
    # The exporter sorts faces by material, and only where it writes materials; an object without any would be read with
    # the last one of the object before.
    ordered = all(_materials_ascend(obj.data) and (obj.data.materials or not materials) for obj in objects)
    for with_materials in [materials] if ordered or not materials else [True, False]:
        bpy.ops.wm.obj_export(
            filepath=str(path),
            export_selected_objects=True,
            export_materials=with_materials,
            export_normals=any(obj.data.has_custom_normals for obj in objects),
            export_colors=any(obj.data.color_attributes for obj in objects),
            apply_modifiers=False,
            **AXES,
        )
    restore_precision(path, objects)
    return name_materials(path, objects) if materials and not ordered else []


def _materials_ascend(mesh: bpy.types.Mesh) -> bool:
    """Whether faces come in the order of their materials, by which the exporter sorts them."""
    index = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    return bool((np.diff(index) >= 0).all())


def _write_ply(path: Path, objects: Objects, everything: bool) -> list[str]:
    """PLY keeps one UV per vertex; the exporter would renumber all vertices, so seams are cut beforehand."""
    objects = exported_meshes(objects, everything)
    cut = []
    for obj in objects:
        copy = obj.copy()
        copy.data = obj.data.copy()
        bpy.context.scene.collection.objects.link(copy)
        _cut_uv_seams(copy.data)
        cut.append(copy)
    told = _with_like_attributes([copy.data for copy in cut])
    _select_only(cut)
    try:
        bpy.ops.wm.ply_export(
            filepath=str(path),
            export_selected_objects=True,
            export_uv=False,
            export_attributes=True,
            export_normals=any(obj.data.has_custom_normals for obj in objects),
            apply_modifiers=False,
            **AXES,
        )
    finally:
        for copy in cut:
            bpy.data.meshes.remove(copy.data)
        # Until then the view layer holds objects that are gone.
        bpy.context.view_layer.update()
    return told


def _with_like_attributes(meshes: Sequence[bpy.types.Mesh]) -> list[str]:
    """Give all meshes the vertex attributes that any has, 0 where it had none, or none of them: the exporter writes
    those that some lack to other vertices, and beyond the end of its memory. Warnings name what is left out."""
    kinds: dict[str, set[str]] = {}
    for mesh in meshes:
        active = mesh.color_attributes.active_color
        for found in mesh.attributes:
            written = found.domain == "POINT" and found.name != "position" and not found.name.startswith(".")
            if written and (active is None or found.name != active.name):
                kinds.setdefault(found.name, set()).add(found.data_type)
    left = []
    for name, types in kinds.items():
        there = [mesh for mesh in meshes if name in mesh.attributes]
        # One that is new may become the colour that is shown.
        alike = (
            len(types) == 1 and not types & COLOURS and all(mesh.attributes[name].domain == "POINT" for mesh in there)
        )
        if len(there) < len(meshes) and alike:
            for mesh in meshes:
                if mesh not in there:
                    mesh.attributes.new(name, *types, "POINT")
        elif len(there) < len(meshes) or len(types) > 1:
            left.append(name)
            for mesh in there:
                mesh.attributes.remove(mesh.attributes[name])
    return [f"Not every object has a vertex attribute of one kind named {name}; it was left out" for name in left]


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
        # Faces that touch in this vertex alone, with UVs of their own; those that have the same ones stay together.
        corners = list(vertex.link_loops)
        parted: dict[tuple[float, ...], bmesh.types.BMVert] = {}
        for loop in corners[1:]:
            place = tuple(loop[layer].uv)
            if place == tuple(corners[0][layer].uv):
                continue
            new = bmesh.utils.face_vert_separate(loop.face, vertex)
            if place in parted:
                bmesh.utils.vert_splice(new, parted[place])
            else:
                parted[place] = new
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


def _write_stl(path: Path, objects: Objects, everything: bool) -> list[str]:
    """Write an STL file; returns warnings."""
    _select_only(exported_meshes(objects, everything))
    bpy.ops.wm.stl_export(filepath=str(path), export_selected_objects=True, apply_modifiers=False, **AXES)
    return ["STL files hold no UVs; write .blend, .obj, .ply, .glb, .gltf or .fbx to keep them"]


def _write_glb(path: Path, objects: Objects, everything: bool) -> list[str]:
    """Write a binary glTF file; returns warnings."""
    settle_context()
    if not everything:
        _select_only(objects)
    meshes = [obj.data for obj in exported_meshes(objects, everything)]
    options = known_options(
        bpy.ops.export_scene.gltf,
        # Colours are left out unless a material uses them, by default.
        export_vertex_color="ACTIVE" if any(mesh.color_attributes for mesh in meshes) else "MATERIAL",
        export_cameras=everything,
        export_lights=everything,
        export_extras=everything,
        export_animations=everything,
    )
    bpy.ops.export_scene.gltf(
        filepath=str(path),
        export_format="GLB",
        use_selection=not everything,
        # Flat normals would split every vertex; a file without normals is shaded flat all the same.
        export_normals=any(mesh.has_custom_normals or (everything and _is_smooth(mesh)) for mesh in meshes),
        **options,
    )
    return []


def _write_gltf(path: Path, objects: Objects, everything: bool) -> list[str]:
    """Write a glTF file of text, with everything in it; returns warnings."""
    binary = path.with_suffix(".glb")
    told = _write_glb(binary, objects, everything)
    path.write_bytes(gltf.embedded(glb_data.read(binary.read_bytes())))
    binary.unlink()
    return told


def _is_smooth(mesh: bpy.types.Mesh) -> bool:
    """Whether any face is shaded smooth."""
    smooth = np.zeros(len(mesh.polygons), bool)
    mesh.polygons.foreach_get("use_smooth", smooth)
    return bool(smooth.any())


def _write_fbx(path: Path, objects: Objects, everything: bool) -> list[str]:
    """Write an FBX file; returns warnings."""
    options: dict[str, object] = {}
    if everything:
        options |= {"use_custom_props": True, "add_leaf_bones": False, "bake_anim_simplify_factor": 0.0}
    else:
        _select_only(objects)
        options |= {"object_types": {"MESH"}}
    _name_source()
    bpy.ops.export_scene.fbx(
        filepath=str(path),
        use_selection=not everything,
        use_mesh_modifiers=False,
        bake_anim=everything and len(bpy.data.actions) > 0,
        **options,
    )
    return []


def _name_source() -> None:
    """Give what is open a name that can be written: the exporter puts that of the .blend into an .fbx as UTF-8, and
    ends with an error where it is none."""
    name = bpy.data.filepath
    if name.encode(errors="replace").decode() == name:
        return
    with own_folder() as folder:
        # From here on it is of that name, and finds its images from there.
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "source.blend"), check_existing=False)


_WRITERS: dict[str, Callable[[Path, Objects, bool], list[str]]] = {
    ".obj": _write_obj,
    ".ply": _write_ply,
    ".stl": _write_stl,
    ".glb": _write_glb,
    ".gltf": _write_gltf,
    ".fbx": _write_fbx,
}
