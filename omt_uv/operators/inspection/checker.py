"""Put a checker on the selected objects and take it off again: uv.omt_checker, uv.omt_checker_remove."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ...display import overlay, shading
from ..base import Complaint, QuickOperator, check_all_local, mesh_objects

KINDS = (
    ("COLOR_GRID", "Labelled", "Coloured squares with a letter and a number, so that every place can be told"),
    ("UV_GRID", "Plain", "Grey squares with small crosses in colours"),
    ("CIRCLES", "Circle Packing", "Equal circles that touch: round where angles are kept, equal where areas are"),
    ("WORLD", "World Map", "A map of the world in longitude and latitude, for globes"),
)

# Blender has no generator for these.
DRAWN = ("CIRCLES", "WORLD")


class UV_OT_omt_checker(QuickOperator, bpy.types.Operator):
    """Show a checker on the selected objects. Their own materials are kept, and come back by one click"""

    bl_idname = "uv.omt_checker"
    bl_label = "Show UV Checker"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Checker", description="What the checker shows", items=KINDS, default="COLOR_GRID")
    size: IntProperty(
        name="Size",
        description="Width of the image in pixels; its squares stay as wide, so more of them fit into a larger one",
        default=2048,
        min=256,
        max=8192,
        subtype="PIXEL",
    )

    def act(self, context: bpy.types.Context) -> None:
        from ...blender import checker

        objects = mesh_objects(context, shared=True)
        check_all_local([(obj, None) for obj in objects])
        bare = [obj.name for obj in objects if not obj.data.uv_layers]
        if len(bare) == len(objects):
            raise Complaint(f"{', '.join(bare)}: There are no UVs to look at. Unwrap the mesh first.")
        overlay.hide(context)
        for obj in objects:
            # Another checker gives way.
            checker.take_off(obj)
        picture = None
        if self.kind in DRAWN:
            from ...display.textures.patterns import picture_of

            picture = picture_of(self.kind.lower(), self.size)
        for obj in objects:
            checker.put(obj, self.kind, self.size, picture)
        checker.tidy()
        shading.show_textures(context)


class UV_OT_omt_checker_remove(QuickOperator, bpy.types.Operator):
    """Give the selected objects their own materials back; all objects, if none of the selected ones has a checker"""

    bl_idname = "uv.omt_checker_remove"
    bl_label = "Remove UV Checker"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        from ...blender import checker

        worn = [obj for obj in bpy.data.objects if obj.type == "MESH" and checker.wears_one(obj)]
        chosen = [obj for obj in worn if obj.select_get() or obj.mode == "EDIT"]
        for obj in chosen or worn:
            checker.take_off(obj)
        checker.tidy()
        if len(chosen or worn) == len(worn):
            shading.hide_textures(context)
