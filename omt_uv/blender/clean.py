"""Mend meshes as Blender's own commands do, in Object Mode and in Edit Mode, all of their faces."""

from __future__ import annotations

from collections.abc import Callable

import bpy

import bmesh

# Vertices closer than this share of the extent lie on one another.
TOGETHER = 1e-6


def turn_outside(obj: bpy.types.Object) -> int:
    """Turn faces over until all look outside; how many were turned."""
    return _changed(obj, _turn)[0]


def merge(obj: bpy.types.Object) -> int:
    """Join vertices that lie on one another; how many went."""
    return _changed(obj, _merge)[0]


def dissolve(obj: bpy.types.Object) -> int:
    """Dissolve faces without area and edges without length; how many vertices and faces went."""
    return sum(_changed(obj, _dissolve))


def _changed(obj: bpy.types.Object, change: Callable[[bmesh.types.BMesh, float], int]) -> tuple[int, int]:
    """Change a mesh: what the change says it did, and how many faces went before that no change can be made with."""
    mesh = obj.data
    extent = max(obj.dimensions) / max(1e-30, max(map(abs, obj.matrix_world.to_scale())))
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(mesh)
        count = change(edit, extent)
        bmesh.update_edit_mesh(mesh)
        return count, 0
    edit = bmesh.new()
    try:
        edit.from_mesh(mesh)
        left_out = _leave_out_invalid(edit, mesh)
        count = change(edit, extent)
        if count:
            edit.to_mesh(mesh)
            mesh.update()
    finally:
        edit.free()
    return count, left_out


def _leave_out_invalid(edit: bmesh.types.BMesh, mesh: bpy.types.Mesh) -> int:
    """Take away faces that use a vertex twice, which Blender's commands never come to the end of; how many went."""
    if all(len(set(face.verts)) == len(face.verts) for face in edit.faces):
        return 0
    edit.clear()
    count = len(mesh.polygons)
    mesh.validate()
    edit.from_mesh(mesh)
    return count - len(mesh.polygons)


def _turn(edit: bmesh.types.BMesh, _extent: float) -> int:
    edit.normal_update()
    before = [face.normal.copy() for face in edit.faces]
    bmesh.ops.recalc_face_normals(edit, faces=edit.faces[:])
    edit.normal_update()
    return sum(face.normal.dot(old) < 0 for face, old in zip(edit.faces, before, strict=True))


def _merge(edit: bmesh.types.BMesh, extent: float) -> int:
    count = len(edit.verts)
    bmesh.ops.remove_doubles(edit, verts=edit.verts[:], dist=TOGETHER * extent)
    return count - len(edit.verts)


def _dissolve(edit: bmesh.types.BMesh, extent: float) -> int:
    count = len(edit.verts) + len(edit.faces)
    bmesh.ops.dissolve_degenerate(edit, dist=TOGETHER * extent, edges=edit.edges[:])
    return count - len(edit.verts) - len(edit.faces)
