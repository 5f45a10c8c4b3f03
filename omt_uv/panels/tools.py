"""The sections of one operator each: a painted region magnified, weights, a new mesh, a globe."""

from __future__ import annotations

import bpy

from .section import Section, big_button, draw_settings, operator_section, settings_of

REMESH_NAME = "object.omt_remesh"


def draw_remesh(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    draw_settings(layout.column(), REMESH_NAME, settings_of(context, REMESH_NAME))
    big_button(layout, REMESH_NAME, "MOD_REMESH")
    layout.operator("object.omt_compare", text="Compare", icon="UV_SYNC_SELECT")


class UV_UL_omt_regions(bpy.types.UIList):
    """Vertex groups with factors of their own, a row each"""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_name) -> None:
        row = layout.row(align=True)
        owner = item.id_data
        # Fields take every click: here one chooses the row.
        row.label(text="", icon="DOT")
        if item.group and item.group not in owner.vertex_groups:
            # A search field would lose a name that is to come, or of another object.
            row.prop(item, "group", text="", icon="ERROR", emboss=False)
        else:
            row.prop_search(item, "group", owner, "vertex_groups", text="", icon="GROUP_VERTEX")
        part = row.row(align=True)
        part.ui_units_x = 4
        part.prop(item, "factor", text="")


MAGNIFY = operator_section("magnify", "Magnify", "uv.omt_magnify", "VIEWZOOM")
WEIGHTS = operator_section("weights", "Weights", "object.omt_weights", "MOD_VERTEX_WEIGHT", parent="magnify")
REMESH = Section("remesh", "Remesh", draw_remesh, (REMESH_NAME, "object.omt_compare"))
SPHERE = operator_section("sphere", "Sphere", "uv.omt_sphere", "WORLD")
