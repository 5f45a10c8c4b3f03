"""uv.omt_refine: better areas for UVs that exist, whatever unwrapped them."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..settings import RefineSettings
from .base import Complaint, SolverOperator, read_objects, warn
from .properties import AreaSettings, MarginSettings, draw_balance, draw_margin


class UV_OT_omt_refine(AreaSettings, MarginSettings, SolverOperator, bpy.types.Operator):
    """Give every part of existing UV islands its share of the texture. Islands stay whole and in place, pins too"""

    bl_idname = "uv.omt_refine"
    bl_label = "Refine Area"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    makes_uvs = True

    keep_boundary: BoolProperty(
        name="Keep Outline", description="Leave the outline of every island exactly as it is", default=False
    )
    pack: BoolProperty(
        name="Pack Islands",
        description="Arrange the refined islands anew in the unit square. Otherwise they stay where they are",
        default=False,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> RefineSettings:
        return RefineSettings(
            quality=self.quality.lower(),
            balance=self.balance,
            margin=self.margin,
            texture_size=self.texture_size,
            pack=self.pack,
            tile=self.tile,
            keep_boundary=self.keep_boundary,
        )

    def steps(self, context: bpy.types.Context):
        from ..blender import mesh as blender_mesh
        from ..blender import uv_packer as blender_pack
        from ..pipelines.layout import Refusal
        from ..pipelines.refine import refine_islands
        from ..session import run as running
        from ..xatlas import packing

        pairs = read_objects(context)
        try:
            for obj, _ in pairs:
                blender_mesh.check_target(obj.data, "")
        except blender_mesh.TargetError as error:
            raise Complaint(str(error)) from error
        surfaces = [(reading.surface, reading.faces, reading.all_pins) for _, reading in pairs]
        try:
            steps = refine_islands(surfaces, self.settings(), running.in_front(blender_pack.pack))
            refined = yield from running.aside(steps)
        except Refusal as refusal:
            obj = pairs[refusal.index][0]
            raise Complaint(f"{obj.name}: {refusal.error}", obj, refusal.error) from refusal
        except packing.PackingError as error:
            raise Complaint(str(error)) from error
        return [obj for obj, _ in pairs], refined

    def finish(self, context: bpy.types.Context, result) -> None:
        from ..blender import mesh as blender_mesh

        objects, refined = result
        for obj, corners, uv in zip(objects, refined.corners, refined.uv, strict=True):
            blender_mesh.write_uv(obj, obj.data.uv_layers.active.name, corners, uv)
        warn(self, objects, refined.warnings)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    draw_balance(layout, properties)
    layout.prop(properties, "quality")
    layout.prop(properties, "keep_boundary")
    column = layout.column()
    column.active = not properties.keep_boundary
    column.prop(properties, "pack")
    column = layout.column()
    column.active = properties.pack and not properties.keep_boundary
    draw_margin(column, properties)
