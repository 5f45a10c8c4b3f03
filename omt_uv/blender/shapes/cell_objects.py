"""Make new objects of a partition: the mesh cut along its cells, with all that it carries, or a point for each cell."""

from __future__ import annotations

import bpy

import numpy as np

from ...pipelines.attributes import Attributes
from ...pipelines.shapes.cell_attributes import carry_to_cells
from ...pipelines.shapes.partition import Partition
from ...settings import CELL_ATTRIBUTE
from ...solver.mesh.surface import Surface, chosen_triangles
from .. import mesh as blender_mesh
from ..read_attributes import read_attributes
from ..write_attributes import keep_chosen, write_attributes

CELLS_ENDING = "_cells"
POINTS_ENDING = "_points"


def read_carried(obj: bpy.types.Object) -> Attributes:
    """What the mesh of an object carries, in any mode."""
    names = tuple(group.name for group in obj.vertex_groups)
    if obj.mode != "EDIT":
        return read_attributes(obj.data, names)
    obj.update_from_editmode()
    copy = obj.data.copy()
    try:
        return read_attributes(copy, names)
    finally:
        bpy.data.meshes.remove(copy)


def new_cell_mesh(
    obj: bpy.types.Object, surface: Surface, faces: np.ndarray, partition: Partition, carried: Attributes
) -> bpy.types.Object:
    """An object of the divided polygons (f,) bool, cut along the cells, with their numbers as an attribute.

    The partition has to have a mesh.
    """
    cut = partition.mesh
    assert cut is not None
    _, corners, _ = chosen_triangles(surface, faces)
    positions = np.linalg.solve(blender_mesh.stretch(obj), cut.positions.T).T
    polygons = np.split(cut.corner_vertex, cut.face_start[1:-1])
    mesh = blender_mesh.new_mesh(obj.name + CELLS_ENDING, positions.tolist(), [p.tolist() for p in polygons])
    for material in obj.data.materials:
        mesh.materials.append(material)
    new = _new_object(obj, obj.name + CELLS_ENDING, mesh)
    write_attributes(new, carry_to_cells(carried, surface, corners, cut))
    keep_chosen(new, obj)
    if CELL_ATTRIBUTE not in mesh.attributes:
        mesh.attributes.new(CELL_ATTRIBUTE, "INT", "FACE")
    mesh.attributes[CELL_ATTRIBUTE].data.foreach_set("value", cut.cell.astype(np.int32))
    return new


def new_points(obj: bpy.types.Object, partition: Partition) -> bpy.types.Object:
    """An object of a vertex for each cell, with attributes for Geometry Nodes: the normal, the radius, the number."""
    points = partition.points
    stretch = blender_mesh.stretch(obj)
    positions = np.linalg.solve(stretch, points.positions.T).T
    # Normals go by the inverse of what takes positions there.
    normals = points.normals @ stretch
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    mesh = blender_mesh.new_mesh(obj.name + POINTS_ENDING, positions.tolist(), [])
    values = (
        ("normal", "FLOAT_VECTOR", "vector", normals),
        ("radius", "FLOAT", "value", points.radii),
        (CELL_ATTRIBUTE, "INT", "value", np.arange(len(points.radii), dtype=np.int32)),
    )
    for name, kind, key, array in values:
        data = mesh.attributes.new(name, kind, "POINT").data
        data.foreach_set(key, np.ascontiguousarray(array, np.int32 if kind == "INT" else np.float32).ravel())
    return _new_object(obj, obj.name + POINTS_ENDING, mesh)


def _new_object(obj: bpy.types.Object, name: str, mesh: bpy.types.Mesh) -> bpy.types.Object:
    # A copy has the parent, too: location, rotation and scale alone hold no shear.
    new = obj.copy()
    new.name, new.data = name, mesh
    for slot, old in zip(new.material_slots, obj.material_slots, strict=False):
        slot.link, slot.material = old.link, old.material
    new.modifiers.clear()
    blender_mesh.link_beside(new, obj)
    bpy.context.view_layer.update()
    return new
