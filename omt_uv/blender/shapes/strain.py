"""Write the strain of a mesh as attributes: its size, and vectors along the greatest stretch."""

from __future__ import annotations

import bpy

import numpy as np

from ...errors import UserError
from ...pipelines.reading import Reading
from ...pipelines.shapes.strain import regions_of, strain_of
from ...solver.strain.regions import RegionStrain, region_strain
from ..mesh import stretch
from ..read_attributes import read_attributes
from ..write_attributes import fresh_attribute

SIZE_NAME = "OMT Strain"
VECTOR_NAME = "OMT Stretch"


def write_strain(mesh: bpy.types.Mesh, size: np.ndarray, vector: np.ndarray) -> None:
    """Two attributes of the faces: size (f,) floats, and vector (f,3), which Geometry Nodes and shaders can read."""
    for name, kind, key, values in (
        (SIZE_NAME, "FLOAT", "value", size),
        (VECTOR_NAME, "FLOAT_VECTOR", "vector", vector),
    ):
        layer = fresh_attribute(mesh, name, kind, "FACE")
        layer.data.foreach_set(key, np.ascontiguousarray(values, np.float32).ravel())
    mesh.update()


def key_shape(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    """Positions (n,3) of a shape key, None where there is none of this name."""
    block = mesh.shape_keys.key_blocks.get(name) if mesh.shape_keys else None
    if block is None:
        return None
    values = np.zeros(3 * len(mesh.vertices), np.float32)
    block.data.foreach_get("co", values)
    return values.reshape(-1, 3).astype(float)


class StrainError(UserError):
    """An object without the UV map or shape key whose strain is asked for."""


def strain_rows(obj: bpy.types.Object, reading: Reading, key: str = "") -> list[RegionStrain]:
    """Strain of the UV map of a Reading, or of a shape key, over all, by vertex groups and by materials.

    Raises
    ------
    StrainError : there is no such map
    """
    if key:
        shape = key_shape(obj.data, key)
        if shape is None:
            raise StrainError(f"{obj.name}: There is no shape key {key!r}. Name one that it has.")
        found = strain_of(reading.surface, shape=shape @ stretch(obj))
    elif reading.uv is None:
        raise StrainError(f"{obj.name}: There is no UV map. Unwrap it first, or name a shape key.")
    else:
        found = strain_of(reading.surface, uv=reading.uv)
    carried = read_attributes(obj.data, tuple(group.name for group in obj.vertex_groups))
    weights = {name: carried.weights[:, k] for k, name in enumerate(carried.groups)}
    materials = [slot.name or str(k) for k, slot in enumerate(obj.material_slots)]
    return region_strain(found, regions_of(reading.surface, weights, carried.material_index, materials))
