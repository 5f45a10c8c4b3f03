"""uv.omt_unwrap: area-preserving UVs for whole objects or for selected faces."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..settings import (
    BOUNDARIES,
    DEFAULT_BALANCE,
    DEFAULT_BOUNDARY,
    DEFAULT_MARGIN,
    DEFAULT_QUALITY,
    DEFAULT_TEXTURE_SIZE,
    QUALITIES,
    Settings,
)
from .common import Complaint, SolverOperator, read_objects, warn


class UV_OT_omt_unwrap(SolverOperator, bpy.types.Operator):
    """Unwrap so that every part of the surface gets its share of the texture. Islands follow the seams, pins stay"""

    bl_idname = "uv.omt_unwrap"
    bl_label = "Unwrap Area Preserving"
    bl_options = {"REGISTER", "UNDO"}

    boundary: EnumProperty(
        name="Boundary", description="Outline of every island", items=BOUNDARIES, default=DEFAULT_BOUNDARY
    )
    balance: FloatProperty(
        name="Balance",
        description="From 0, exact areas, to 1, least shear",
        default=DEFAULT_BALANCE,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    quality: EnumProperty(
        name="Quality", description="How exact the areas become", items=QUALITIES, default=DEFAULT_QUALITY
    )
    pack: BoolProperty(
        name="Pack Islands",
        description="Arrange the islands in the unit square. Otherwise they are centred one upon the other, "
        "the largest as wide as the square",
        default=True,
    )
    margin: IntProperty(
        name="Margin",
        description="Least distance between islands, in pixels of the texture",
        default=DEFAULT_MARGIN,
        min=0,
        max=1024,
        soft_max=64,
        subtype="PIXEL",
    )
    texture_size: IntProperty(
        name="Texture Size",
        description="Width of the texture that the margin is measured in",
        default=DEFAULT_TEXTURE_SIZE,
        min=16,
        max=65536,
        soft_max=8192,
        subtype="PIXEL",
    )
    uv_layer: StringProperty(
        name="UV Map", description="UV map to write, made if there is none of this name. Empty: the active one"
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> Settings:
        return Settings(
            boundary=self.boundary.lower(),
            quality=self.quality.lower(),
            balance=self.balance,
            margin=self.margin,
            texture_size=self.texture_size,
            pack=self.pack,
        )

    def steps(self, context: bpy.types.Context):
        from .. import blender_mesh, blender_pack, packing
        from ..unwrapping import Refusal, lay_out

        pairs = read_objects(context, self.uv_layer)
        try:
            for obj, _ in pairs:
                blender_mesh.check_target(obj.data, self.uv_layer)
        except blender_mesh.TargetError as error:
            raise Complaint(str(error)) from error
        surfaces = [(reading.surface, reading.faces, reading.pins) for _, reading in pairs]
        try:
            layout = yield from lay_out(surfaces, self.settings(), blender_pack.pack)
        except Refusal as refusal:
            obj = pairs[refusal.index][0]
            raise Complaint(f"{obj.name}: {refusal.error}", obj, refusal.error) from refusal
        except packing.PackingError as error:
            raise Complaint(str(error)) from error
        return [obj for obj, _ in pairs], layout

    def finish(self, context: bpy.types.Context, result) -> None:
        from .. import blender_mesh

        objects, layout = result
        for obj, corners, uv in zip(objects, layout.corners, layout.uv, strict=True):
            layer = blender_mesh.target_layer(obj.data, self.uv_layer)
            blender_mesh.write_uv(obj, layer, corners, uv)
        warn(self, objects, layout.warnings)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "boundary")
    layout.prop(properties, "balance")
    layout.prop(properties, "quality")
    layout.prop(properties, "pack")
    column = layout.column()
    column.active = properties.pack
    column.prop(properties, "margin")
    column.prop(properties, "texture_size")
    layout.prop(properties, "uv_layer")
