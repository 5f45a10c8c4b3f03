"""Write colour attributes that show distortion, and give back what they covered."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np

ATTRIBUTE = "OMT UV Distortion"


def write_colours(obj: bpy.types.Object, corners: np.ndarray, rgb: np.ndarray) -> None:
    """Show sRGB colours (k,3) on corners (k,) of a mesh object; corners without one are grey.

    Which attribute was the active one is kept in a property of the mesh until `remove_colours`.
    """
    mesh = obj.data
    if mesh.color_attributes.get(ATTRIBUTE) is None:
        active = mesh.color_attributes.active_color
        mesh[_KEPT] = active.name if active else ""
        _make(obj)
    loops = _loops(mesh) if obj.mode == "EDIT" else len(mesh.loops)
    rgba = np.full((loops, 4), (0.5, 0.5, 0.5, 1.0), np.float32)
    rgba[corners, :3] = rgb
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(mesh)
        layer = edit.loops.layers.color[ATTRIBUTE]
        for values, loop in zip(rgba.tolist(), (loop for face in edit.faces for loop in face.loops), strict=True):
            loop[layer] = values
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
    else:
        mesh.color_attributes[ATTRIBUTE].data.foreach_set("color_srgb", rgba.ravel())
        mesh.update()
    mesh.color_attributes.active_color = mesh.color_attributes[ATTRIBUTE]


def remove_colours(obj: bpy.types.Object) -> None:
    """Take the colours away; the artist's own attributes are as they were, and the one that was active is so again."""
    mesh = obj.data
    if mesh.color_attributes.get(ATTRIBUTE) is not None:
        if obj.mode == "EDIT":
            edit = bmesh.from_edit_mesh(mesh)
            edit.loops.layers.color.remove(edit.loops.layers.color[ATTRIBUTE])
            bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
        else:
            mesh.color_attributes.remove(mesh.color_attributes[ATTRIBUTE])
    kept = mesh.color_attributes.get(mesh.get(_KEPT, ""))
    if kept is not None:
        mesh.color_attributes.active_color = kept
    if _KEPT in mesh:
        del mesh[_KEPT]


def has_colours(mesh: bpy.types.Mesh) -> bool:
    return mesh.color_attributes.get(ATTRIBUTE) is not None


_KEPT = "omt_uv_active_color"


def _make(obj: bpy.types.Object) -> None:
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        edit.loops.layers.color.new(ATTRIBUTE)
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
    else:
        obj.data.color_attributes.new(ATTRIBUTE, "BYTE_COLOR", "CORNER")


def _loops(mesh: bpy.types.Mesh) -> int:
    return sum(len(face.loops) for face in bmesh.from_edit_mesh(mesh).faces)
