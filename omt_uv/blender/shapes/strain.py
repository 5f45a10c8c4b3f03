"""Write the strain of a mesh as attributes: its size, and vectors along the greatest stretch."""

from __future__ import annotations

import bpy

import numpy as np

SIZE_NAME = "OMT Strain"
VECTOR_NAME = "OMT Stretch"


def write_strain(mesh: bpy.types.Mesh, size: np.ndarray, vector: np.ndarray) -> None:
    """Two attributes of the faces: size (f,) floats, and vector (f,3), which Geometry Nodes and shaders can read."""
    for name, kind, key, values in (
        (SIZE_NAME, "FLOAT", "value", size),
        (VECTOR_NAME, "FLOAT_VECTOR", "vector", vector),
    ):
        layer = mesh.attributes.get(name)
        if layer is not None and (layer.domain, layer.data_type) != ("FACE", kind):
            mesh.attributes.remove(layer)
            layer = None
        layer = layer or mesh.attributes.new(name, kind, "FACE")
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
