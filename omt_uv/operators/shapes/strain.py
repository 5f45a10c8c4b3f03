"""Write how far UVs or a shape key shear the faces, and in which direction: object.omt_strain."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, StringProperty

from ..base import Complaint, QuickOperator, complaints, mesh_objects

OF = (
    ("KEY", "Shape Key", "From the basis to the active shape key"),
    ("UV", "UV Map", "From the surface to the active UV map"),
    (
        "OBJECT",
        "Other Object",
        "From the active object to another of the same vertices and faces, such as a pose",
    ),
)


class OBJECT_OT_omt_strain(QuickOperator, bpy.types.Operator):
    """Write the strain of a shape key, a pose or a UV map into attributes: OMT Strain, OMT Stretch for directions"""

    bl_idname = "object.omt_strain"
    bl_label = "Strain"
    bl_options = {"REGISTER", "UNDO"}
    modes = ("OBJECT",)

    of: EnumProperty(name="Of", description="Which map is measured", items=OF)
    shape_key: StringProperty(name="Shape Key", description="Shape key to measure; the active one if empty")

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.mesh import check_local, read
        from ...blender.shapes.strain import write_strain
        from ...pipelines.shapes.strain import of_polygons, strain_of

        objects = mesh_objects(context)
        if self.of == "OBJECT":
            objects = objects[:1]
        found = []
        for obj in objects:
            with complaints(obj):
                check_local(obj)
                reading = read(obj)
                found.append((obj, reading.surface, strain_of(reading.surface, **self._map(context, obj, reading))))
        for obj, surface, strain in found:
            write_strain(obj.data, *of_polygons(strain, surface))
        self.report({"INFO"}, "; ".join(f"{obj.name}: mean strain {strain.mean:.3f}" for obj, _, strain in found))

    def _map(self, context: bpy.types.Context, obj: bpy.types.Object, reading) -> dict:
        """What `strain_of` measures of an object."""
        from ...blender.mesh import read, stretch
        from ...blender.shapes.strain import key_shape
        from ...pipelines.shapes.strain import same_polygons

        if self.of == "UV":
            if reading.uv is None:
                raise Complaint(f"{obj.name} has no UV map. Unwrap it first.")
            return {"uv": reading.uv}
        if self.of == "OBJECT":
            others = [o for o in context.selected_objects if o.type == "MESH" and o != obj]
            surface = read(others[0]).surface if len(others) == 1 else None
            if surface is None or not same_polygons(reading.surface, surface):
                raise Complaint("Select one other object with the same vertices and faces as the active one.")
            return {"shape": surface.positions}
        name = self.shape_key or (obj.active_shape_key.name if obj.active_shape_key else "")
        shape = key_shape(obj.data, name) if name else None
        if shape is None:
            raise Complaint(f"{obj.name} has no shape key {name!r}. Add or choose one.")
        return {"shape": shape @ stretch(obj)}
