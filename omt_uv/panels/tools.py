"""The sections of one operator each: a painted region magnified, weights, a new mesh, a globe."""

from __future__ import annotations

import bpy

from ..operators import magnify
from .section import Section, big_button, draw_settings, operator_section, settings_of

MAGNIFY_NAME = "uv.omt_magnify"
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


def draw_magnify(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    magnify.draw_main(layout.column(), settings_of(context, MAGNIFY_NAME))
    big_button(layout, MAGNIFY_NAME, "VIEWZOOM")


def draw_magnify_more(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    magnify.draw_more(layout.column(), settings_of(context, MAGNIFY_NAME))


def draw_magnify_image(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    properties = settings_of(context, MAGNIFY_NAME)
    if properties.source == "MESH":
        layout.label(text="Existing UVs alone take an image along")
    magnify.draw_image(layout.column(), properties)


MAGNIFY = Section("magnify", "Magnify", draw_magnify, (MAGNIFY_NAME,))
MAGNIFY_MORE = Section("magnify_more", "Seams and Packing", draw_magnify_more, (MAGNIFY_NAME,), parent="magnify")
MAGNIFY_IMAGE = Section("magnify_image", "Image", draw_magnify_image, (MAGNIFY_NAME,), parent="magnify")
WEIGHTS = operator_section(
    "weights", "Weights", "object.omt_weights", "MOD_VERTEX_WEIGHT", "magnify", button="Make Weights"
)
REMESH = Section("remesh", "Remesh", draw_remesh, (REMESH_NAME, "object.omt_compare"))
SPHERE = operator_section("sphere", "Sphere", "uv.omt_sphere", "WORLD", button="Project to Sphere")
