"""Vertex groups of Blender meshes: the region that is magnified, and weights written for the artist to repaint."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

import bmesh
import numpy as np

from .blender_mesh import Reading
from .blender_seams import GroupError, group_weights
from .solver.errors import MeshError
from .solver.scores import areas, score, soft_weights

# Regions that need no vertex group, and the score they are made from.
COMPUTED = {"saliency": "saliency", "curvature": "gaussian"}


class ScoreError(Exception):
    """A mesh that has no such score: the object and the MeshError."""

    def __init__(self, obj: bpy.types.Object, error: MeshError):
        super().__init__(f"{obj.name}: {error}")
        self.obj, self.error = obj, error


def region_weights(pairs: Sequence[tuple[bpy.types.Object, Reading]], name: str) -> list[np.ndarray]:
    """Weights (n,) of the region `name` for each object: a vertex group, 0 where an object has none; or one of
    COMPUTED, where no object has a group of this name.

    Raises
    ------
    GroupError : no object has this group, or no name is given
    ScoreError : a mesh that has no such score
    """
    weights = [group_weights(obj, name) if name else None for obj, _ in pairs]
    if all(w is None for w in weights):
        if name in COMPUTED:
            return [computed_weights(obj, reading, COMPUTED[name]) for obj, reading in pairs]
        names = ", ".join(obj.name for obj, _ in pairs)
        raise GroupError(
            f"{names}: There is no vertex group {name!r}. Paint one, or choose {' or '.join(COMPUTED)}."
            if name
            else f"{names}: No vertex group is named. Choose the one that marks the region."
        )
    sizes = [len(reading.surface.positions) for _, reading in pairs]
    return [np.zeros(n) if w is None else w for w, n in zip(weights, sizes, strict=True)]


def computed_weights(
    obj: bpy.types.Object,
    reading: Reading,
    kind: str,
    low: float = 0.5,
    high: float = 0.95,
    invert: bool = False,
    selected: np.ndarray | None = None,
) -> np.ndarray:
    """Weights (n,) from a score of the whole mesh; see `solver.scores.soft_weights`. Raises ScoreError."""
    surface = reading.surface
    triangles = surface.corner_vertex[surface.triangles]
    try:
        values = score(kind, surface.positions, triangles, selected)
        return soft_weights(values, areas(surface.positions, triangles), low, high, invert)
    except MeshError as error:
        raise ScoreError(obj, error) from error


def selected_vertices(obj: bpy.types.Object) -> np.ndarray:
    """Which vertices (n,) bool are selected, in any mode."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    selected = np.zeros(len(obj.data.vertices), bool)
    obj.data.vertices.foreach_get("select", selected)
    return selected


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
    for value, members in zip(values.tolist(), np.split(order, first[1:]), strict=True):
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


def check_group_target(obj: bpy.types.Object, name: str) -> None:
    """Raise GroupError if weights cannot be written to the vertex group `name`."""
    if not name:
        raise GroupError(f"{obj.name}: The vertex group has no name. Name the one to write.")
    if obj.library is not None or obj.data.library is not None:
        raise GroupError(f"{obj.name} is linked from a library. Make it local first.")
    group = obj.vertex_groups.get(name)
    if group is not None and group.lock_weight:
        raise GroupError(f"{obj.name}: The vertex group {name!r} is locked. Unlock it, or choose another name.")
