"""Seams and vertex groups of Blender meshes, in Object Mode and in Edit Mode; see `blender_mesh.py`."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np

from ..errors import UserError


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


class GroupError(UserError):
    """No object has a vertex group of this name."""


def avoided(objects: list, name: str) -> list:
    """Weights (n,) of the vertex group for each object, None where it has none; without a name for none.

    Raises
    ------
    GroupError : no object has this group
    """
    weights = [group_weights(obj, name) if name else None for obj in objects]
    if name and all(w is None for w in weights):
        names = ", ".join(obj.name for obj in objects)
        raise GroupError(f"{names}: There is no vertex group {name!r}. Choose one, or leave it empty.")
    return weights


def group_weights(obj: bpy.types.Object, name: str) -> np.ndarray | None:
    """Weights (n,) in [0,1] of a vertex group, 0 outside of it; None if the object has none of this name."""
    group = obj.vertex_groups.get(name)
    if group is None:
        return None
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    weights = np.zeros(len(obj.data.vertices))
    for vertex in obj.data.vertices:
        for element in vertex.groups:
            if element.group == group.index:
                weights[vertex.index] = element.weight
    return weights
