"""The sidebar tab: settings before the first run, and the operators."""

from __future__ import annotations

import bpy

from ..operators.measure import UV_OT_omt_measure
from ..operators.refine import UV_OT_omt_refine
from ..operators.seams import UV_OT_omt_seams
from ..operators.unwrap import UV_OT_omt_unwrap, draw_settings


class SidebarPanel:
    bl_label = "OMT UV"
    bl_category = "OMT UV"
    bl_region_type = "UI"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.mode in {"OBJECT", "EDIT_MESH"}

    def draw(self, context: bpy.types.Context) -> None:
        layout: bpy.types.UILayout = self.layout  # type: ignore[attr-defined]
        # The operator starts from these, so nothing has to be kept in the scene.
        draw_settings(layout.column(), context.window_manager.operator_properties_last(UV_OT_omt_unwrap.bl_idname))
        layout.operator(UV_OT_omt_unwrap.bl_idname, icon="UV")
        # It starts from its own settings, which its redo panel shows: they are few, and mostly other ones.
        layout.operator(UV_OT_omt_refine.bl_idname)
        layout.operator(UV_OT_omt_seams.bl_idname)
        layout.operator(UV_OT_omt_measure.bl_idname)


class VIEW3D_PT_omt_uv(SidebarPanel, bpy.types.Panel):
    bl_idname = "VIEW3D_PT_omt_uv"
    bl_space_type = "VIEW_3D"


class IMAGE_PT_omt_uv(SidebarPanel, bpy.types.Panel):
    bl_idname = "IMAGE_PT_omt_uv"
    bl_space_type = "IMAGE_EDITOR"
