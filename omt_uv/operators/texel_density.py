"""Measure and set pixels of the texture for every metre of the surface: uv.omt_density_get, uv.omt_density_set."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..settings import DEFAULT_TEXTURE_SIZE
from .base import QuickOperator, read_objects, read_writable

SCOPES = (
    ("ISLANDS", "Every Island", "Every island gets this density, about its own middle"),
    (
        "ALL",
        "All Together",
        "The whole layout is scaled by one factor; islands keep the densities they have among themselves",
    ),
)


class TextureSize:
    """How wide the texture is that densities refer to."""

    texture_size: IntProperty(
        name="Texture Size",
        description="Width of the texture, in pixels",
        default=DEFAULT_TEXTURE_SIZE,
        min=16,
        max=65536,
        soft_max=8192,
        subtype="PIXEL",
    )

    def texels(self, context: bpy.types.Context):
        from ..pipelines.texel_density import Texels

        return Texels(self.texture_size, context.scene.unit_settings.scale_length)


class UV_OT_omt_density_get(TextureSize, QuickOperator, bpy.types.Operator):
    """Measure the texel density of the selection, and take it over as the density to set"""

    bl_idname = "uv.omt_density_get"
    bl_label = "Get Texel Density"
    bl_options = {"REGISTER"}

    def act(self, context: bpy.types.Context) -> None:
        from ..pipelines.texel_density import texel_density

        found = texel_density([reading for _, reading in read_objects(context)], self.texels(context))
        target = context.window_manager.operator_properties_last(UV_OT_omt_density_set.bl_idname)
        target.density, target.texture_size = found, self.texture_size
        self.report({"INFO"}, f"{found:.4g} pixels per metre of a texture {self.texture_size} pixels wide")


class UV_OT_omt_density_set(TextureSize, QuickOperator, bpy.types.Operator):
    """Scale UV islands to a texel density. Islands with pins are scaled like any other: this is asked for"""

    bl_idname = "uv.omt_density_set"
    bl_label = "Set Texel Density"
    bl_options = {"REGISTER", "UNDO"}

    density: FloatProperty(
        name="Density",
        description="Pixels of the texture for every metre of the surface",
        default=512.0,
        min=1e-6,
        soft_min=1.0,
        soft_max=16384.0,
        precision=1,
    )
    scope: EnumProperty(
        name="Scope", description="What is scaled by a factor of its own", items=SCOPES, default="ISLANDS"
    )

    def act(self, context: bpy.types.Context) -> None:
        from ..blender.mesh import write_uv
        from ..pipelines.texel_density import with_texel_density

        objects, readings = read_writable(context)
        scaled = with_texel_density(readings, self.density, self.texels(context), self.scope == "ISLANDS")
        for obj, (corners, uv) in zip(objects, scaled, strict=True):
            write_uv(obj, obj.data.uv_layers.active.name, corners, uv)
