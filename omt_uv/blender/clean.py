"""Mend meshes as Blender's own commands do, in Object Mode and in Edit Mode, all of their faces."""

from __future__ import annotations

from collections.abc import Callable

import bpy

import bmesh
import numpy as np

from ..solver.errors import RepeatedVertexError

# Vertices closer than this share of the extent lie on one another.
TOGETHER = 1e-6


def turn_outside(obj: bpy.types.Object) -> int:
    """Turn faces over until all look outside; how many were turned. Faces: see `check_faces`."""
    return _changed(obj, _turn)


def merge(obj: bpy.types.Object) -> int:
    """Join vertices that lie on one another; how many went. Faces: see `check_faces`."""
    return _changed(obj, _merge)


def dissolve(obj: bpy.types.Object) -> int:
    """Dissolve faces without area and edges without length, and take away faces that use a vertex twice; how many
    vertices and faces went."""
    count = 0
    if obj.mode != "EDIT" and _repeating(obj):
        count = len(obj.data.polygons)
        # As is everything that Blender holds for invalid.
        obj.data.validate()
        count -= len(obj.data.polygons)
    return count + _changed(obj, _dissolve)


def check_faces(obj: bpy.types.Object) -> None:
    """Raise RepeatedVertexError for faces that use a vertex twice: Blender's commands never come to the end of them."""
    repeating = _repeating(obj) if obj.mode != "EDIT" else []
    if repeating:
        raise RepeatedVertexError("A face uses a vertex twice", kind="face", elements=np.array(repeating))


def _repeating(obj: bpy.types.Object) -> list[int]:
    """The indices of faces that use a vertex twice."""
    return [face.index for face in obj.data.polygons if len(set(face.vertices)) < len(face.vertices)]


def _changed(obj: bpy.types.Object, change: Callable[[bmesh.types.BMesh, float], int]) -> int:
    mesh = obj.data
    extent = max(obj.dimensions) / max(1e-30, max(map(abs, obj.matrix_world.to_scale())))
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(mesh)
        count = change(edit, extent)
        bmesh.update_edit_mesh(mesh)
        return count
    edit = bmesh.new()
    try:
        edit.from_mesh(mesh)
        count = change(edit, extent)
        if count:
            edit.to_mesh(mesh)
            mesh.update()
    finally:
        edit.free()
    return count


def _turn(edit: bmesh.types.BMesh, _extent: float) -> int:
    edit.normal_update()
    before = [face.normal.copy() for face in edit.faces]
    bmesh.ops.recalc_face_normals(edit, faces=edit.faces[:])
    edit.normal_update()
    return sum(face.normal.dot(old) < 0 for face, old in zip(edit.faces, before, strict=True))


def _merge(edit: bmesh.types.BMesh, extent: float) -> int:
    count = len(edit.verts)
    # No vertices are as close as 0 to Blender 4.2, and where all are in one place, any distance will do.
    bmesh.ops.remove_doubles(edit, verts=edit.verts[:], dist=TOGETHER * (extent or 1.0))
    return count - len(edit.verts)


def _dissolve(edit: bmesh.types.BMesh, extent: float) -> int:
    count = len(edit.verts) + len(edit.faces)
    bmesh.ops.dissolve_degenerate(edit, dist=TOGETHER * extent, edges=edit.edges[:])
    return count - len(edit.verts) - len(edit.faces)
