"""Figures of regions, and values of faces for nodes: uv.omt_regions, uv.omt_attributes."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ...session.language import counted, words
from ...settings import DEFAULT_TEXTURE_SIZE
from ..base import Complaint, QuickOperator, blaming, check_all_local, complaints, read_objects

KINDS = (
    ("GROUPS", "Vertex Groups", "Faces whose vertices have a mean weight of a half and more"),
    ("MATERIALS", "Materials", "Faces of one material"),
    ("ATTRIBUTE", "Attribute", "Faces with one value of an attribute"),
)


class UV_OT_omt_regions(QuickOperator, bpy.types.Operator):
    """Measure regions: area, shares of surface and texture, perimeter, shear. The table goes to the clipboard"""

    bl_idname = "uv.omt_regions"
    bl_label = "Measure UV Regions"
    bl_options = {"REGISTER"}

    kind: EnumProperty(name="Regions", description="What tells regions apart", items=KINDS, default="GROUPS")
    attribute: StringProperty(name="Attribute", description="Name of the attribute of faces")
    texture_size: IntProperty(
        name="Texture Size",
        description="Width of the texture in pixels",
        default=DEFAULT_TEXTURE_SIZE,
        min=1,
        max=65536,
        subtype="PIXEL",
    )

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.measuring.region_labels import regions_of
        from ...pipelines.measuring.region_figures import figures_by_region, table_text

        if self.kind == "ATTRIBUTE" and not self.attribute:
            raise Complaint("No attribute is named. Choose one of whole numbers or truth values on faces.")
        pairs = read_objects(context)
        kind = self.attribute if self.kind == "ATTRIBUTE" else self.kind.lower()
        with complaints(), blaming(pairs):
            rows = figures_by_region([r for _, r in pairs], regions_of(pairs, kind), self.texture_size)
        context.window_manager.clipboard = table_text(rows, "\t")
        text = counted(len(rows) - 1, "{} region measured", "{} regions measured")
        self.report({"INFO"}, f"{text}; {words('the table is in the clipboard')}")


class UV_OT_omt_attributes(QuickOperator, bpy.types.Operator):
    """Write area ratio, shear and direction of stretch into attributes of faces, for nodes and shaders"""

    bl_idname = "uv.omt_attributes"
    bl_label = "UV Distortion to Attributes"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.measuring.face_attributes import KINDS as NAMES
        from ...blender.measuring.face_attributes import write_face_values
        from ...pipelines.measuring.per_face import face_values

        if context.mode != "OBJECT":
            raise Complaint("Attributes are written in Object Mode. Leave Edit Mode first.")
        pairs, values = check_all_local(read_objects(context)), []
        for obj, reading in pairs:
            with complaints(obj):
                values.append(face_values(reading))
        with complaints():
            for (obj, _), found in zip(pairs, values, strict=True):
                write_face_values(obj, found)
        self.report({"INFO"}, f"Written to {', '.join(NAMES)}")
