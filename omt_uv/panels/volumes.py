"""The sections of bodies: moved without a change of volume, and mapped with their insides."""

from __future__ import annotations

import bpy

from ..operators.volumes.volume import missing
from .section import Section, big_button, class_of, draw_settings, settings_of

OBJECT_FLOW = "object.omt_flow"
UV_FLOW = "uv.omt_flow"
MAP_VOLUME = "object.omt_volume"


def _draw_flow(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    draw_settings(layout.column(), OBJECT_FLOW, settings_of(context, OBJECT_FLOW))
    big_button(layout, OBJECT_FLOW, "MOD_FLUIDSIM")
    if class_of(UV_FLOW) is not None:
        layout.separator()
        draw_settings(layout.column(), UV_FLOW, settings_of(context, UV_FLOW))
        big_button(layout, UV_FLOW, "UV_DATA")


FLOW = Section("flow", "Move Incompressibly", _draw_flow, (OBJECT_FLOW, UV_FLOW))


def _draw_volume(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    settings = settings_of(context, MAP_VOLUME)
    packages = missing(settings.library)
    if packages:
        # In three lines: one is cut off in a sidebar of the usual width.
        column = layout.column(align=True)
        column.label(text="Needs a library for tetrahedra:", icon="INFO")
        for line in ("python -m pip install", packages):
            column.label(text=line, icon="BLANK1", translate=False)
    draw_settings(layout.column(), MAP_VOLUME, settings)
    big_button(layout, MAP_VOLUME, "MESH_ICOSPHERE")


VOLUME = Section("volume", "Volume", _draw_volume, (MAP_VOLUME,))
