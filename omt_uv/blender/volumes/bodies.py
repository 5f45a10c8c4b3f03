"""Read mesh objects as bodies in the space of the world, and write where their vertices went: as shape keys, or
moved."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

import bmesh
import numpy as np

from ...pipelines.volumes.flow import FlowBody
from ...solver.errors import NonFiniteError
from ..mesh import check_local
from ..vertex_groups import GroupError, group_weights

KEY = "Flow"
BASIS = "Basis"
# Weights from this on are in a group.
MEMBER = 0.5


def read_body(obj: bpy.types.Object, keep: str = "") -> FlowBody:
    """A mesh object in any mode, in the world; vertices of the group `keep` stay.

    Raises
    ------
    NonFiniteError : a coordinate is none, or the transformation of the object cannot be undone
    TargetError : what is written to it would not be saved
    """
    check_local(obj)
    matrix = _matrix(obj)
    copy = None
    if obj.mode == "EDIT":
        obj.update_from_editmode()
        copy = obj.data.copy()
    mesh = copy or obj.data
    try:
        positions = np.zeros(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", positions)
        mesh.calc_loop_triangles()
        triangles = np.zeros(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        polygons = np.zeros(len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("polygon_index", polygons)
    finally:
        if copy is not None:
            bpy.data.meshes.remove(copy)
    world = positions.reshape(-1, 3).astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    wrong = np.flatnonzero(~np.isfinite(world).all(axis=1))
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)
    faces = triangles.reshape(-1, 3).astype(np.int64)
    # A mirrored object shows its faces from the other side.
    faces = faces if np.linalg.det(matrix[:3, :3]) > 0 else faces[:, ::-1]
    stays = members(obj, keep) if keep else None
    return FlowBody(obj.name, world, faces, stays, polygons)


def _matrix(obj: bpy.types.Object) -> np.ndarray:
    """The matrix (4,4) of an object, which can be inverted."""
    matrix = np.array(obj.matrix_world, dtype=float)
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
        raise NonFiniteError("The transformation of the object cannot be undone", "Clear or fix its scale")
    return matrix


def members(obj: bpy.types.Object, group: str) -> np.ndarray | None:
    """Which vertices (n,) bool belong to a vertex group with at least half of the weight; None without the group."""
    weights = group_weights(obj, group)
    return None if weights is None else weights >= MEMBER


def check_keep(objects: Sequence[bpy.types.Object], keep: str) -> None:
    """Raise GroupError if a group is named that no object has."""
    if keep and all(obj.vertex_groups.get(keep) is None for obj in objects):
        names = ", ".join(obj.name for obj in objects)
        raise GroupError(f"{names}: There is no vertex group {keep!r}. Choose one, or leave it empty.")


def local(obj: bpy.types.Object, world: np.ndarray) -> np.ndarray:
    """Positions (n,3) float32 of an object's own space that are these (n,3) in the world."""
    inverse = np.linalg.inv(_matrix(obj))
    return (world @ inverse[:3, :3].T + inverse[:3, 3]).astype(np.float32)


def write_positions(obj: bpy.types.Object, world: np.ndarray, moved: np.ndarray | None = None) -> None:
    """Move the vertices of a mesh object, in any mode, to positions (n,3) in the world; with `moved` (n,) bool these
    alone, and every other keeps its bits."""
    values = local(obj, world)
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        which = np.ones(len(values), bool) if moved is None else moved
        for vertex, value, yes in zip(edit.verts, values.tolist(), which.tolist(), strict=True):
            if yes:
                vertex.co = value
        bmesh.update_edit_mesh(obj.data, loop_triangles=True, destructive=False)
        return
    keys = obj.data.shape_keys
    targets = [obj.data.vertices] if keys is None else [obj.data.vertices, keys.reference_key.data]
    for target in targets:
        if moved is not None:
            old = np.zeros(values.size, np.float32)
            target.foreach_get("co", old)
            merged = np.where(moved[:, None], values, old.reshape(-1, 3))
        else:
            merged = values
        target.foreach_set("co", merged.ravel())
    obj.data.update()


def read_positions(obj: bpy.types.Object) -> np.ndarray:
    """Positions (n,3) float32 in the object's own space, in any mode."""
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        return np.array([vertex.co[:] for vertex in edit.verts], np.float32).reshape(-1, 3)
    values = np.zeros(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def set_positions(obj: bpy.types.Object, values: np.ndarray) -> None:
    """Put back positions (n,3) float32 of the object's own space, to the bit."""
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        for vertex, value in zip(edit.verts, values.tolist(), strict=True):
            vertex.co = value
        bmesh.update_edit_mesh(obj.data, loop_triangles=True, destructive=False)
        return
    obj.data.vertices.foreach_set("co", values.ravel())
    obj.data.update()


def write_frames(obj: bpy.types.Object, frames: Sequence[np.ndarray], start: int = 1, keyed: bool = False) -> list[str]:
    """Add a shape key for every frame of positions (n,3) in the world; returns their names.

    The last one is shown. keyed : key frames make each the shape at its frame of the scene, from `start` on
    """
    if obj.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
        try:
            return write_frames(obj, frames, start, keyed)
        finally:
            bpy.ops.object.mode_set(mode="EDIT")
    if obj.data.shape_keys is None:
        obj.shape_key_add(name=BASIS, from_mix=False)
    names = []
    for k, world in enumerate(frames):
        key = obj.shape_key_add(name=f"{KEY} {k + 1}" if len(frames) > 1 else KEY, from_mix=False)
        key.data.foreach_set("co", local(obj, world).ravel())
        key.value = float(k == len(frames) - 1)
        names.append(key.name)
        if keyed:
            _animate(key, start + k, first=k == 0, last=k == len(frames) - 1)
    obj.active_shape_key_index = len(obj.data.shape_keys.key_blocks) - 1
    obj.data.update()
    return names


def _animate(key: bpy.types.ShapeKey, frame: int, first: bool, last: bool) -> None:
    """Value 1 at its frame + 1, 0 at the ones before and after, linearly in between; the last one stays."""
    times = [(frame, 0.0), (frame + 1, 1.0)] + ([] if last else [(frame + 2, 0.0)])
    for at, value in times:
        key.value = value
        key.keyframe_insert("value", frame=at)
    action = key.id_data.animation_data.action
    for curve in _curves(action, key.id_data.animation_data):
        if curve.data_path == key.path_from_id("value"):
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"


def _curves(action, data):
    """The curves of an action, of Blender with and without slots of actions."""
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    return [c for layer in action.layers for strip in layer.strips for bag in strip.channelbags for c in bag.fcurves]
