"""Write values of faces into attributes that Geometry Nodes and shaders read."""

from __future__ import annotations

import bpy

import numpy as np

from ...errors import UserError
from ...pipelines.measuring.per_face import FaceValues
from ..mesh import linked

# Names of the attributes: log2 of the area ratio, shear, and direction of stretch.
AREA = "OMT UV Area"
SHEAR = "OMT UV Shear"
STRETCH = "OMT UV Stretch"
KINDS = {AREA: ("FLOAT", "value"), SHEAR: ("FLOAT", "value"), STRETCH: ("FLOAT_VECTOR", "vector")}


class AttributeTargetError(UserError):
    """The attributes cannot be written."""


def write_face_values(obj: bpy.types.Object, values: FaceValues) -> None:
    """Make or fill the attributes of an object in Object Mode.

    Raises
    ------
    AttributeTargetError : the mesh is linked, or has attributes of these names that are of another kind
    """
    mesh = obj.data
    if linked(obj):
        raise AttributeTargetError(f"{obj.name} {linked(obj)}. Make it local first.")
    for name, (kind, _) in KINDS.items():
        there = mesh.attributes.get(name)
        if there is not None and (there.data_type, there.domain) != (kind, "FACE"):
            raise AttributeTargetError(f"{obj.name}: there is another attribute {name!r}. Rename it.")
    for name, given in zip(KINDS, (values.area, values.shear, values.stretch), strict=True):
        kind, field = KINDS[name]
        attribute = mesh.attributes.get(name) or mesh.attributes.new(name, kind, "FACE")
        attribute.data.foreach_set(field, np.ascontiguousarray(given, np.float32).ravel())
    mesh.update()
