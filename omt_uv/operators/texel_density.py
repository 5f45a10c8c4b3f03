"""Measure and set pixels of the texture for a length of the surface: uv.omt_density_get, uv.omt_density_set."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..settings import DEFAULT_TEXTURE_SIZE
from .base import QuickOperator, blaming, read_objects, read_writable

SCOPES = (
    ("ISLANDS", "Every Island", "Every island gets this density, about its own middle"),
    (
        "ALL",
        "All Together",
        "The whole layout is scaled by one factor; islands keep the densities they have among themselves",
    ),
)


# Pixels per metre are so many times those per unit.
UNITS = (
    ("CM", "px/cm", "Pixels for every centimetre of the surface, as games count"),
    ("M", "px/m", "Pixels for every metre of the surface"),
    ("IN", "px/in", "Pixels for every inch of the surface"),
)
UNITS_PER_METRE = {"CM": 100.0, "M": 1.0, "IN": 1 / 0.0254}


class TextureSize:
    """How wide the texture is that densities refer to."""

    unit: EnumProperty(name="Unit", description="Length that densities are counted for", items=UNITS, default="CM")
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

        pairs = read_objects(context)
        with blaming(pairs):
            found = texel_density([reading for _, reading in pairs], self.texels(context))
        target = context.window_manager.operator_properties_last(UV_OT_omt_density_set.bl_idname)
        found /= UNITS_PER_METRE[self.unit]
        target.density, target.texture_size, target.unit = found, self.texture_size, self.unit
        unit = next(label for name, label, _ in UNITS if name == self.unit)
        self.report({"INFO"}, f"{found:.4g} {unit} of a texture {self.texture_size} pixels wide")


class UV_OT_omt_density_set(TextureSize, QuickOperator, bpy.types.Operator):
    """Scale UV islands to a texel density. Islands with pins are scaled like any other: this is asked for"""

    bl_idname = "uv.omt_density_set"
    bl_label = "Set Texel Density"
    bl_options = {"REGISTER", "UNDO"}

    density: FloatProperty(
        name="Density",
        description="Pixels of the texture for every unit of length of the surface",
        default=5.12,
        min=1e-6,
        soft_min=0.01,
        soft_max=16384.0,
        precision=2,
    )
    scope: EnumProperty(
        name="Scope", description="What is scaled by a factor of its own", items=SCOPES, default="ISLANDS"
    )

    def act(self, context: bpy.types.Context) -> None:
        from ..blender.mesh import write_uv
        from ..pipelines.texel_density import with_texel_density

        objects, readings = read_writable(context)
        target = self.density * UNITS_PER_METRE[self.unit]
        with blaming(list(zip(objects, readings, strict=True))):
            scaled = with_texel_density(readings, target, self.texels(context), self.scope == "ISLANDS")
        for obj, (corners, uv) in zip(objects, scaled, strict=True):
            write_uv(obj, obj.data.uv_layers.active.name, corners, uv)
