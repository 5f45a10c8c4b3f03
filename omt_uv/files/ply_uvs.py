"""Read UVs of PLY files that Blender does not: of vertices under other names than s and t, and of corners of faces."""

from __future__ import annotations

from pathlib import Path

import bpy

import numpy as np

from ..blender.mesh import UV_LAYER_NAME, write_uv
from .in_place import ply
from .in_place.imported import InPlaceError, find_corners, same_places


def add_uvs(path: Path, obj: bpy.types.Object) -> None:
    """Give an object that was read from a PLY file, and has no UVs, those that the file has."""
    mesh = obj.data
    if mesh.uv_layers or not mesh.loops:
        return
    try:
        found, uv = ply.read_uv(path.read_bytes())
    except InPlaceError:
        # Blender has read it, in whatever way; UVs are not found.
        return
    if uv is None:
        return
    positions, vertex = np.zeros(3 * len(mesh.vertices), np.float32), np.zeros(len(mesh.loops), np.int32)
    start = np.zeros(len(mesh.polygons), np.int32)
    mesh.vertices.foreach_get("co", positions)
    mesh.loops.foreach_get("vertex_index", vertex)
    mesh.polygons.foreach_get("loop_start", start)
    ours, theirs = same_places(found.positions, positions.reshape(-1, 3))
    corner = find_corners(
        (np.append(ours, -1)[found.corner_vertex], found.face_start), (theirs[vertex], np.append(start, len(vertex)))
    )
    here = corner >= 0
    mesh.uv_layers.new(name=UV_LAYER_NAME)
    write_uv(obj, UV_LAYER_NAME, corner[here], uv[here].astype(np.float32))
