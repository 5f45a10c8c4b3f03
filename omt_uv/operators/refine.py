"""Refine the areas of UVs that exist, whatever unwrapped them: uv.omt_refine."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..session import run
from ..settings import RefineSettings
from .base import SolverOperator, complaints, read_writable, warn, write_layers
from .properties import AreaSettings, MarginSettings, SubdivisionSettings, draw_balance, draw_margin


class UV_OT_omt_refine(AreaSettings, SubdivisionSettings, MarginSettings, SolverOperator, bpy.types.Operator):
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
        from ..pipelines.refine import refine_islands

        objects, readings = read_writable(context)
        surfaces = [(reading.surface, reading.faces, reading.all_pins) for reading in readings]
        with complaints(objects=objects):
            steps = refine_islands(surfaces, self.settings(), self.subdivisions(readings))
            refined = yield from run.aside(steps)
        return objects, refined

    def finish(self, context: bpy.types.Context, result) -> None:
        objects, refined = result
        write_layers(objects, "", refined)
        warn(self, objects, refined.warnings)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    draw_balance(layout, properties)
    layout.prop(properties, "quality")
    layout.prop(properties, "keep_boundary")
    layout.prop(properties, "use_subdivision", text="Subdivision")
    column = layout.column()
    column.active = not properties.keep_boundary
    column.prop(properties, "pack")
    packed = properties.pack and not properties.keep_boundary
    draw_margin(layout, properties, packed)
    column = layout.column()
    column.active = packed
    column.prop(properties, "tile")
