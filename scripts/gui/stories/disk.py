"""The other way in: Install from Disk, in the extensions' own page of the preferences, and the tab is there."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

# The extension is not there yet: run.py lays its zip beside the story, and installs nothing.
FRESH = True
ADDON = "bl_ext.user_default.omt_uv"
# The button with what else can be done, pixels from the upper right corner of the page.
SETTINGS = (20, 26)


def tell(story):
    """The page, its menu, the file; then the tab."""
    obj = story.head(16)
    story.facts["there before"] = ADDON in bpy.context.preferences.addons
    # In the same window: another one has no keyboard without a window manager.
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    area = story.area("VIEW_3D")
    area.ui_type = "PREFERENCES"
    bpy.context.preferences.active_section = "EXTENSIONS"
    yield from story.pause(2)
    yield from story.shoot("extensions")
    story.clicks = 0
    yield from choose(story, area)
    yield from story.until(lambda: ADDON in bpy.context.preferences.addons, 120)
    story.facts["clicks to install"] = story.clicks
    yield from story.until(lambda: any(a.type == "PREFERENCES" for a in areas()), 20)
    yield from story.shoot("installed_from_disk")
    next(a for a in areas() if a.type == "PREFERENCES").ui_type = "VIEW_3D"
    yield from story.pause(1)
    tab = yield from story.tab("VIEW_3D")
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    story.facts["unwrapped"] = story.figures(obj)
    yield from story.shoot("unwrapped_from_disk")


def choose(story, area):
    """The menu's last entry, and the zip's path."""
    region = story.window_region(area)
    window = bpy.context.window_manager.windows[0]
    x, y = region.x + region.width - SETTINGS[0], window.height - (region.y + region.height - SETTINGS[1])
    yield from story.click(x, y)
    yield from story.pause(0.5)
    yield from story.shoot("menu")
    yield from story.key("Up")
    yield from story.key("Return")
    story.clicks += 1
    yield from story.until(lambda: any(a.type == "FILE_BROWSER" for a in areas()), 30)
    yield from story.pause(1)
    archive = next(Path(os.environ["OMT_UV_ZIP"]).glob("*.zip"))
    browser = next(a for a in areas() if a.type == "FILE_BROWSER")
    browser.spaces.active.params.directory = str(archive.parent).encode()
    browser.spaces.active.params.filename = archive.name
    yield from story.pause(1)
    yield from story.shoot("file")
    # What the button Install from Disk does.
    inside = story.window_region(browser)
    yield from story.move(inside.x + inside.width // 2, window.height - (inside.y + inside.height // 4))
    yield from story.key("Return")
    story.clicks += 1


def areas():
    """What the window shows."""
    return bpy.context.window_manager.windows[0].screen.areas
