"""Mark seams of Blender meshes, in Object Mode and in Edit Mode."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np


def mark_seams(obj: bpy.types.Object, edges: np.ndarray) -> int:
    """Mark the edges between vertices (k,2) as seams, and leave all others as they are; how many are new."""
    if len(edges) == 0:
        return 0
    if obj.mode == "EDIT":
        return _mark_bmesh(obj.data, edges)
    mesh = obj.data
    n, count = len(mesh.vertices), len(mesh.edges)
    ends, seam = np.zeros(2 * count, np.int32), np.zeros(count, bool)
    mesh.edges.foreach_get("vertices", ends)
    mesh.edges.foreach_get("use_seam", seam)
    low, high = np.sort(ends.reshape(-1, 2).astype(np.int64), axis=1).T
    chosen = np.isin(low * n + high, edges.min(axis=1) * n + edges.max(axis=1))
    mesh.edges.foreach_set("use_seam", seam | chosen)
    mesh.update()
    return int((chosen & ~seam).sum())


def _mark_bmesh(mesh: bpy.types.Mesh, edges: np.ndarray) -> int:
    edit = bmesh.from_edit_mesh(mesh)
    edit.verts.ensure_lookup_table()
    found = (edit.edges.get((edit.verts[a], edit.verts[b])) for a, b in edges.tolist())
    new = [edge for edge in found if edge and not edge.seam]
    for edge in new:
        edge.seam = True
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
    return len(new)
