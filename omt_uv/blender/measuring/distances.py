"""Meshes where they stand in the world, and distances as an attribute of vertices."""

from __future__ import annotations

import bpy

import numpy as np

from ...errors import UserError
from ...pipelines.reading import Reading
from ..mesh import place_of

NAME = "OMT Distance"


class DistanceTargetError(UserError):
    """The distances cannot be written."""


def placed_mesh(obj: bpy.types.Object, reading: Reading) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) in the world and triangles (m,3) of an object."""
    rotation, shift = place_of(obj)
    surface = reading.surface
    return surface.positions @ rotation.T + shift, surface.corner_vertex[surface.triangles]


def write_distances(obj: bpy.types.Object, distance: np.ndarray) -> None:
    """Write distances (n,) into an attribute of vertices.

    Raises
    ------
    DistanceTargetError : there is one of this name and of another kind
    """
    attribute = obj.data.attributes.get(NAME)
    if attribute is not None and (attribute.data_type, attribute.domain) != ("FLOAT", "POINT"):
        raise DistanceTargetError(f"{obj.name}: there is another attribute {NAME!r}. Rename it.")
    attribute = attribute or obj.data.attributes.new(NAME, "FLOAT", "POINT")
    attribute.data.foreach_set("value", np.ascontiguousarray(distance, np.float32))
