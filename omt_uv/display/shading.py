"""Let the 3D Views show textures in solid shading, and give back how they were."""

from __future__ import annotations

import bpy

# How 3D Views were coloured, by pointer of their space.
_before: dict[int, str] = {}


def show_textures(context: bpy.types.Context) -> None:
    for space in _solid_views(context):
        _before.setdefault(space.as_pointer(), space.shading.color_type)
        space.shading.color_type = "TEXTURE"


def hide_textures(context: bpy.types.Context) -> None:
    for space in _solid_views(context):
        if space.shading.color_type == "TEXTURE" and space.as_pointer() in _before:
            space.shading.color_type = _before[space.as_pointer()]
    _before.clear()


def view_spaces(context: bpy.types.Context) -> list:
    """The 3D Views of all windows."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    return [area.spaces.active for area in areas if area.type == "VIEW_3D"]


def _solid_views(context: bpy.types.Context) -> list:
    return [space for space in view_spaces(context) if space.shading.type == "SOLID"]
