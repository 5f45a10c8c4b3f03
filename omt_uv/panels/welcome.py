"""Open the tab once, when the extension is new, so that nobody has to look for it; later it stays as it was left."""

from __future__ import annotations

import bpy

TAB = "OMT"
# Blender can be told which tab is shown since then.
SINCE = (5, 0, 0)


def show_tab() -> bool:
    """Open the sidebar of the largest 3D View with our tab in front; whether that was possible."""
    if bpy.app.version < SINCE:
        return True
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    views = [area for area in areas if area.type == "VIEW_3D"]
    if not views:
        return False
    area = max(views, key=lambda view: view.width * view.height)
    area.spaces.active.show_region_ui = True
    region = next(region for region in area.regions if region.type == "UI")
    try:
        region.active_panel_category = TAB
    except (AttributeError, TypeError):
        # Tabs exist, and can be chosen, once the sidebar has been drawn.
        area.tag_redraw()
        return False
    area.tag_redraw()
    return True
