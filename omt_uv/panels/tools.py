"""The sections of one operator each: a painted region magnified, weights, a new mesh, a globe."""

from __future__ import annotations

import bpy

from .section import Section, big_button, draw_settings, operator_section, settings_of

REMESH_NAME = "object.omt_remesh"


def draw_remesh(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    draw_settings(layout.column(), REMESH_NAME, settings_of(context, REMESH_NAME))
    big_button(layout, REMESH_NAME, "MOD_REMESH")
    layout.operator("object.omt_compare", text="Compare", icon="UV_SYNC_SELECT")


MAGNIFY = operator_section("magnify", "Magnify", "uv.omt_magnify", "VIEWZOOM")
WEIGHTS = operator_section("weights", "Weights", "object.omt_weights", "MOD_VERTEX_WEIGHT", parent="magnify")
REMESH = Section("remesh", "Remesh", draw_remesh, (REMESH_NAME, "object.omt_compare"))
SPHERE = operator_section("sphere", "Sphere", "uv.omt_sphere", "WORLD")
