"""Write the cells of a partition onto the faces of a mesh: face sets, materials, an attribute, seams; in any mode."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np

from ...pipelines.shapes.partition import Partition
from ...settings import CELL_ATTRIBUTE, MOST_MATERIALS
from ..mesh import TargetError
from ..seams import mark_seams

FACE_SETS = ".sculpt_face_set"


def check_cells(obj: bpy.types.Object, write: str) -> None:
    """Raise TargetError if cells cannot be written to an object in this way."""
    name = {"face_sets": FACE_SETS, "attribute": CELL_ATTRIBUTE}.get(write)
    attribute = obj.data.attributes.get(name) if name else None
    if attribute is not None and (attribute.data_type, attribute.domain) != ("INT", "FACE"):
        raise TargetError(f"{obj.name} has another attribute {name!r}. Rename or remove it.")
    if write == "materials" and len(obj.data.materials) >= MOST_MATERIALS:
        raise TargetError(f"{obj.name} has {len(obj.data.materials)} material slots already. Remove some.")


def write_cells(obj: bpy.types.Object, partition: Partition, write: str) -> None:
    """Write the cells of the faces of an object that belong to one; `write` as in `settings.PartitionSettings`."""
    faces = np.flatnonzero(partition.cell >= 0)
    cells = partition.cell[faces]
    if write == "seams":
        mark_seams(obj, partition.borders)
    elif write == "materials":
        _write_materials(obj, faces, cells)
    elif write == "face_sets":
        # Face sets are counted from 1.
        _write_integers(obj.data, FACE_SETS, faces, cells + 1, 1)
    else:
        _write_integers(obj.data, CELL_ATTRIBUTE, faces, cells, -1)


def _write_integers(mesh: bpy.types.Mesh, name: str, faces: np.ndarray, values: np.ndarray, other: int) -> None:
    """Values (k,) of faces (k,) in an attribute of integers, made with the value `other` elsewhere if it is new."""
    if mesh.is_editmode:
        edit = bmesh.from_edit_mesh(mesh)
        layer = edit.faces.layers.int.get(name)
        if layer is None:
            layer = edit.faces.layers.int.new(name)
            for face in edit.faces:
                face[layer] = other
        edit.faces.ensure_lookup_table()
        for face, value in zip(faces.tolist(), values.tolist(), strict=True):
            edit.faces[face][layer] = value
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
        return
    all_values = np.full(len(mesh.polygons), other, np.int32)
    attribute = mesh.attributes.get(name)
    if attribute is None:
        attribute = mesh.attributes.new(name, "INT", "FACE")
    else:
        attribute.data.foreach_get("value", all_values)
    all_values[faces] = values
    attribute.data.foreach_set("value", all_values)
    mesh.update()


def _write_materials(obj: bpy.types.Object, faces: np.ndarray, cells: np.ndarray) -> None:
    """A material slot for each cell, behind those that there are."""
    mesh = obj.data
    first, count = len(mesh.materials), int(cells.max()) + 1
    digits = len(str(count))
    for k in range(count):
        material = bpy.data.materials.new(f"{obj.name} {k + 1:0{digits}d}")
        material.diffuse_color = (*_colour(k), 1.0)
        mesh.materials.append(material)
    if mesh.is_editmode:
        edit = bmesh.from_edit_mesh(mesh)
        edit.faces.ensure_lookup_table()
        for face, cell in zip(faces.tolist(), cells.tolist(), strict=True):
            edit.faces[face].material_index = first + cell
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
        return
    index = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    index[faces] = first + cells
    mesh.polygons.foreach_set("material_index", index)
    mesh.update()


def _colour(number: int) -> tuple[float, float, float]:
    """A colour that differs from those of the numbers next to it: hues a golden section apart."""
    from colorsys import hsv_to_rgb

    return hsv_to_rgb((number * 0.6180339887) % 1, 0.45 + 0.15 * (number % 3), 0.9 - 0.12 * (number % 2))
