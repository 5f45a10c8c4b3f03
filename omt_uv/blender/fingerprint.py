"""Tell whether a mesh is still what it was, by a hash of what operators read."""

from __future__ import annotations

import hashlib

import bpy

import numpy as np

from ..pipelines.attributes import TYPES
from .versions import uv_values

# Blender's own caches, made and dropped as it likes.
_DERIVED = (".select_", ".uv_select_", ".hide_")


def fingerprint(obj: bpy.types.Object) -> bytes:
    """A hash of what operators read: mode, transformation, faces, selection, seams, and all attributes of a mesh.

    Equal as long as nothing changed. False attributes count as absent: Blender drops and makes these as it likes.
    """
    digest = hashlib.blake2b(digest_size=16)
    digest.update(repr((obj.mode, obj.data.name, [tuple(row) for row in obj.matrix_world])).encode())
    if obj.mode != "EDIT":
        _digest(obj.data, digest)
        return digest.digest()
    obj.update_from_editmode()
    copy = obj.data.copy()
    try:
        _digest(copy, digest)
    finally:
        bpy.data.meshes.remove(copy)
    return digest.digest()


def uv_mark(obj: bpy.types.Object) -> bytes:
    """A hash of what figures of the active UVs depend on: scale, positions, faces, and these UVs."""
    digest = hashlib.blake2b(digest_size=16)
    digest.update(repr([round(x, 6) for x in obj.matrix_world.to_scale()]).encode())
    mesh = obj.data
    if obj.mode == "EDIT":
        obj.update_from_editmode()
        mesh = obj.data.copy()
    try:
        _digest_uv(mesh, digest)
    finally:
        if mesh is not obj.data:
            bpy.data.meshes.remove(mesh)
    return digest.digest()


def _digest_uv(mesh: bpy.types.Mesh, digest) -> None:
    fields = [
        (mesh.vertices, "co", 3 * len(mesh.vertices), np.float32),
        (mesh.loops, "vertex_index", len(mesh.loops), np.int32),
        (mesh.polygons, "loop_start", len(mesh.polygons), np.int32),
    ]
    if mesh.uv_layers.active is not None:
        collection, field = uv_values(mesh, mesh.uv_layers.active.name)
        fields.append((collection, field, 2 * len(mesh.loops), np.float32))
    for collection, name, count, dtype in fields:
        values: np.ndarray = np.zeros(count, dtype)
        collection.foreach_get(name, values)
        digest.update(values.tobytes())


def _digest(mesh: bpy.types.Mesh, digest) -> None:
    for collection, name, count, dtype in (
        (mesh.vertices, "co", 3 * len(mesh.vertices), np.float32),
        (mesh.polygons, "loop_start", len(mesh.polygons), np.int32),
        (mesh.loops, "vertex_index", len(mesh.loops), np.int32),
        (mesh.edges, "use_seam", len(mesh.edges), bool),
        (mesh.polygons, "select", len(mesh.polygons), bool),
        (mesh.polygons, "hide", len(mesh.polygons), bool),
    ):
        values: np.ndarray = np.zeros(count, dtype)
        collection.foreach_get(name, values)
        digest.update(values.tobytes())
    for attribute in sorted(mesh.attributes, key=lambda a: a.name):
        if attribute.data_type not in TYPES or attribute.name.startswith(_DERIVED):
            continue
        field, width, kind, _ = TYPES[attribute.data_type]
        values = np.zeros(len(attribute.data) * width, kind)
        attribute.data.foreach_get(field, values)
        if kind is not bool or values.any():
            digest.update(attribute.name.encode() + attribute.domain.encode() + values.tobytes())
