"""Pack islands by Blender's own packer, behind the interface of `xatlas.packing.pack`, where xatlas cannot be used."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import bpy

import numpy as np

from ..xatlas.packing import MarginError, Packing, PackingError, covered_area


def pack(
    islands: Sequence[np.ndarray], triangles: Sequence[np.ndarray], margin: float = 4, texture_size: int = 1024
) -> Packing:
    """Place islands with `uv.pack_islands`; arguments, result and MarginError as for `packing.pack`.

    The islands become a mesh of their own in a scene of their own, so that no mode or selection changes.

    Raises
    ------
    MarginError, PackingError : the margins leave no room; the operator fails
    """
    sizes = np.cumsum([0, *(len(p) for p in islands)])
    extent = max(float(np.ptp(p, axis=0).max()) for p in islands)
    points = np.concatenate([(p - p.min(axis=0)) / extent for p in islands])
    index = np.concatenate([t + s for t, s in zip(triangles, sizes[:-1], strict=True)])
    packed = np.empty_like(points)
    packed[index.ravel()] = _pack_mesh(points, index, margin / texture_size)
    result = [packed[a:b] for a, b in itertools.pairwise(sizes)]
    scales = [_diameter(q) / _diameter(p) for p, q in zip(islands, result, strict=True)]
    if packed.min() < -1e-6 or packed.max() > 1 + 1e-6 or min(scales) <= 0:
        raise MarginError(f"No room for {len(islands)} islands with a margin of {margin:g} pixels")
    if max(scales) > 1.001 * min(scales):
        raise PackingError("Blender's packer scaled islands differently")
    result = [np.clip(q, 0, 1) for q in result]
    return Packing(result, float(np.median(scales)), "Blender's Pack Islands", covered_area(result, triangles))


def _diameter(points: np.ndarray) -> float:
    """Largest distance from the first point, which no rotation changes."""
    return float(np.linalg.norm(points - points[0], axis=1).max())


def _pack_mesh(points: np.ndarray, index: np.ndarray, margin: float) -> np.ndarray:
    """Packed UVs (3m,2) of the corners of triangles (m,3)."""
    mesh = bpy.data.meshes.new("omt_uv_packing")
    scene = bpy.data.scenes.new("omt_uv_packing")
    obj = bpy.data.objects.new("omt_uv_packing", mesh)
    try:
        mesh.from_pydata(np.pad(points, ((0, 0), (0, 1))).tolist(), [], index.tolist())
        layer = mesh.uv_layers.new(name="UVMap").name
        mesh.uv_layers[layer].uv.foreach_set("vector", points[index.ravel()].astype(np.float32).ravel())
        scene.collection.objects.link(obj)
        scene.tool_settings.use_uv_select_sync = True
        view_layer = scene.view_layers[0]
        view_layer.objects.active = obj
        context = {"scene": scene, "view_layer": view_layer, "object": obj, "active_object": obj}
        lists = {"selected_objects": [obj], "selected_editable_objects": [obj]}
        with bpy.context.temp_override(**context, **lists):
            bpy.ops.object.mode_set(mode="EDIT")
        with bpy.context.temp_override(**context, **lists, edit_object=obj, mode="EDIT_MESH"):
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.pack_islands(shape_method="CONVEX", margin_method="FRACTION", margin=margin)
            bpy.ops.object.mode_set(mode="OBJECT")
        packed = np.zeros(2 * len(mesh.loops), np.float32)
        mesh.uv_layers[layer].uv.foreach_get("vector", packed)
        return packed.reshape(-1, 2).astype(float)
    except RuntimeError as error:
        raise PackingError(f"Blender's packer failed: {error}") from error
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.scenes.remove(scene)
        bpy.data.meshes.remove(mesh)
