"""Unwrap arrays by Blender's own methods, as an artist runs them: Edit Mode, all faces selected, seams marked.

Needs the `bpy` module. Minimum Stretch exists from Blender 4.3 on.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import bpy

import numpy as np

METHODS: dict[str, dict[str, Any]] = {
    "Angle Based": {"method": "ANGLE_BASED"},
    "Conformal": {"method": "CONFORMAL"},
    "Minimum Stretch 10": {"method": "MINIMUM_STRETCH", "iterations": 10},
    "Minimum Stretch 50": {"method": "MINIMUM_STRETCH", "iterations": 50},
}

# What times are ratios to.
REFERENCE = "Minimum Stretch 50"


@dataclass(frozen=True)
class RivalMap:
    """UVs of one run: (m,3,2) per triangle corner, and the seconds it took by both clocks."""

    uv: np.ndarray
    processor_seconds: float
    wall_seconds: float


def make_object(V, F, seams=(), name="chart"):
    """A mesh object linked to the scene, selected and active, its seams marked. V (n,3), F (m,3), seams (k,2)."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(V).tolist(), [], np.asarray(F).tolist())
    if len(seams):
        mesh.edges.foreach_set("use_seam", _are_seams(mesh, np.asarray(seams), len(V)))
    mesh.uv_layers.new(name="UVMap")
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


def _are_seams(mesh, seams, count):
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    edges = np.sort(edges.reshape(-1, 2).astype(np.int64), axis=1)
    seams = np.sort(seams, axis=1)
    return np.isin(edges[:, 0] * count + edges[:, 1], seams[:, 0] * count + seams[:, 1])


def remove_object(obj):
    """Remove an object and its mesh."""
    mesh = obj.data
    bpy.data.objects.remove(obj)
    bpy.data.meshes.remove(mesh)


def read_uv(obj):
    """Corner UVs of a mesh of triangles in Object Mode, (m,3,2) float64."""
    uv = np.empty(2 * len(obj.data.loops), np.float32)
    obj.data.uv_layers.active.uv.foreach_get("vector", uv)
    return uv.reshape(-1, 3, 2).astype(float)


def write_uv(obj, uv):
    """Write corner UVs (m,3,2) into the active layer of an object in Object Mode."""
    obj.data.uv_layers.active.uv.foreach_set("vector", np.asarray(uv, np.float32).ravel())
    obj.data.update()


def unwrap(V, F, seams, method):
    """Unwrap the mesh with one of METHODS; the clocks run around `bpy.ops.uv.unwrap` alone."""
    obj = make_object(V, F, seams)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    wall, processor = time.perf_counter(), time.process_time()
    bpy.ops.uv.unwrap(fill_holes=True, correct_aspect=False, margin=0.0, **METHODS[method])
    processor, wall = time.process_time() - processor, time.perf_counter() - wall
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = read_uv(obj)
    remove_object(obj)
    return RivalMap(uv=uv, processor_seconds=processor, wall_seconds=wall)


def median_unwrap(case, method, runs=1):
    """The run with the median processor time, of the `RivalMap`s of a case."""
    found = [unwrap(case.V, case.F, case.seams, method) for _ in range(runs)]
    return sorted(found, key=lambda run: run.processor_seconds)[(runs - 1) // 2]
