"""Read and write vertex groups of Blender meshes, in Object Mode and in Edit Mode."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np

from ..errors import UserError
from ..solver.canonical.markers import MapMarkers
from .mesh import check_local


class GroupError(UserError):
    """A vertex group or attribute that is not there, or of no use."""


def group_weights(obj: bpy.types.Object, name: str, mesh: bpy.types.Mesh | None = None) -> np.ndarray | None:
    """Weights (n,) in [0,1] of a vertex group, 0 outside of it; None if the object has none of this name.

    mesh : whose vertices are meant, such as the object's with its modifiers; by default its own, in any mode
    """
    group = obj.vertex_groups.get(name)
    if group is None:
        return None
    if mesh is None:
        if obj.mode == "EDIT":
            obj.update_from_editmode()
        mesh = obj.data
    weights = np.zeros(len(mesh.vertices))
    for vertex in mesh.vertices:
        for element in vertex.groups:
            if element.group == group.index:
                weights[vertex.index] = element.weight
    return weights


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


def map_markers(objects: list, groups: dict[str, str]) -> list[MapMarkers | None]:
    """Markers of each object's maps from vertex groups named as centre, start and corners; None where it has none.

    Raises
    ------
    GroupError : no object has a group that is named
    """
    if not any(groups.values()):
        return [None] * len(objects)
    weights = {role: avoided(objects, name) for role, name in groups.items()}
    found = []
    for k in range(len(objects)):
        of_role = {role: np.flatnonzero([] if w[k] is None else w[k] > 0.5) for role, w in weights.items()}
        markers = MapMarkers(**of_role)
        found.append(markers if markers.any else None)
    return found


def selected_vertices(obj: bpy.types.Object) -> np.ndarray:
    """Which vertices (n,) bool are selected, in any mode."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    selected = np.zeros(len(obj.data.vertices), bool)
    obj.data.vertices.foreach_get("select", selected)
    return selected


def check_group_target(obj: bpy.types.Object, name: str) -> None:
    """Raise GroupError or TargetError if weights cannot be written to the vertex group `name`."""
    if not name:
        raise GroupError(f"{obj.name}: The vertex group has no name. Name the one to write.")
    check_local(obj)
    group = obj.vertex_groups.get(name)
    if group is not None and group.lock_weight:
        raise GroupError(f"{obj.name}: The vertex group {name!r} is locked. Unlock it, or choose another name.")


def write_group(obj: bpy.types.Object, name: str, weights: np.ndarray) -> None:
    """Write weights (n,) into a vertex group, made if there is none of this name, and make it the active one.

    Vertices of weight 0 are not in the group.
    """
    group = obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)
    obj.vertex_groups.active_index = group.index
    weights = weights.astype(np.float32)
    if obj.mode == "EDIT":
        _write_bmesh(obj.data, group.index, weights)
        return
    group.remove(np.flatnonzero(weights <= 0).tolist())
    order = np.argsort(weights, kind="stable")
    order = order[weights[order] > 0]
    values, first = np.unique(weights[order], return_index=True)
    for value, members in zip(values.tolist(), np.split(order, first)[1:], strict=True):
        group.add(members.tolist(), value, "REPLACE")
    obj.data.update()


def _write_bmesh(mesh: bpy.types.Mesh, index: int, weights: np.ndarray) -> None:
    edit = bmesh.from_edit_mesh(mesh)
    layer = edit.verts.layers.deform.verify()
    for vertex, weight in zip(edit.verts, weights.tolist(), strict=True):
        if weight > 0:
            vertex[layer][index] = weight
        elif index in vertex[layer]:
            del vertex[layer][index]
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
