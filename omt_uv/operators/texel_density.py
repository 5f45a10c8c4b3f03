"""uv.omt_density_get and uv.omt_density_set: pixels of the texture for every metre of the surface."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..settings import DEFAULT_TEXTURE_SIZE
from .base import Complaint, read_objects, ready, tell

SCOPES = (
    ("ISLANDS", "Every Island", "Every island gets this density, about its own middle"),
    (
        "ALL",
        "All Together",
        "The whole layout is scaled by one factor; islands keep the densities they have among themselves",
    ),
)


class TextureSize:
    texture_size: IntProperty(
        name="Texture Size",
        description="Width of the texture, in pixels",
        default=DEFAULT_TEXTURE_SIZE,
        min=16,
        max=65536,
        soft_max=8192,
        subtype="PIXEL",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context)

    def texels(self, context: bpy.types.Context):
        from ..pipelines.texel_density import Texels

        return Texels(self.texture_size, context.scene.unit_settings.scale_length)


class UV_OT_omt_density_get(TextureSize, bpy.types.Operator):
    """Measure the texel density of the selection, and take it over as the density to set"""

    bl_idname = "uv.omt_density_get"
    bl_label = "Get Texel Density"
    bl_options = {"REGISTER"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..pipelines.texel_density import texel_density
        from ..solver.errors import MeshError

        try:
            found = texel_density([reading for _, reading in read_objects(context)], self.texels(context))
        except Complaint as complaint:
            return tell(self, context, complaint)
        except MeshError as error:
            return tell(self, context, Complaint(str(error)))
        wanted = context.window_manager.operator_properties_last(UV_OT_omt_density_set.bl_idname)
        wanted.density, wanted.texture_size = found, self.texture_size
        self.report({"INFO"}, f"{found:.4g} pixels per metre of a texture {self.texture_size} pixels wide")
        return {"FINISHED"}


class UV_OT_omt_density_set(TextureSize, bpy.types.Operator):
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

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..blender import mesh as blender_mesh
        from ..pipelines.texel_density import with_texel_density
        from ..solver.errors import MeshError

        try:
            pairs = read_objects(context)
            for obj, _ in pairs:
                blender_mesh.check_target(obj.data, "")
            each = self.scope == "ISLANDS"
            scaled = with_texel_density([r for _, r in pairs], self.density, self.texels(context), each)
        except Complaint as complaint:
            return tell(self, context, complaint)
        except (MeshError, blender_mesh.TargetError) as error:
            return tell(self, context, Complaint(str(error)))
        for (obj, _), (corners, uv) in zip(pairs, scaled, strict=True):
            blender_mesh.write_uv(obj, obj.data.uv_layers.active.name, corners, uv)
        return {"FINISHED"}
