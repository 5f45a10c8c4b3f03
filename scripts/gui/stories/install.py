"""The way in, every click of it counted: the zip is dropped on Blender, one good unwrap, its checker, its figures."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

# The extension is not there yet: run.py lays its zip beside the story, and installs nothing.
FRESH = True
ADDON = "bl_ext.user_default.omt_uv"


def tell(story):
    """Drop, confirm, unwrap, checker, read."""
    obj = story.head(40)
    story.look_at_it(story.area("VIEW_3D"))
    story.facts["there before"] = ADDON in bpy.context.preferences.addons
    yield from install(story)
    tab = yield from at_the_tab(story)
    story.clicks = 0
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    story.facts["clicks to an unwrap"] = story.clicks
    story.facts["unwrapped"] = story.figures(obj)
    # The figures stand there by themselves.
    story.facts["clicks to its figures"], story.facts["figures"] = 0, story.said()
    story.clicks = 0
    yield from tab.click("omt_checker(")
    story.facts["clicks to a checker"] = story.clicks
    story.facts["checker"] = [slot.material.name for slot in obj.material_slots]
    yield from story.shoot("first_minute")


def install(story):
    """One drop and one OK."""
    archive = next(Path(os.environ["OMT_UV_ZIP"]).glob("*.zip"))
    place = story.place("VIEW_3D", 700, 400)
    story.clicks = 0
    yield from story.move(*place)
    yield from story.drop(archive, *place)
    story.clicks += 1
    yield from story.pause(1.5)
    yield from story.shoot("drop")
    # OK is what Return presses.
    yield from story.key("Return")
    story.clicks += 1
    yield from story.until(lambda: ADDON in bpy.context.preferences.addons, 120)
    story.facts["clicks to install"] = story.clicks


def at_the_tab(story):
    """The tab is there by itself; told how it came about."""
    area = story.area("VIEW_3D")
    region = next(r for r in area.regions if r.type == "UI")

    def shown():
        return region.width > 1 and getattr(region, "active_panel_category", "") == "OMT"

    if bpy.app.version >= (5, 0, 0):
        yield from story.until(shown, 60)
        story.facts["tab is open by itself"] = True
    yield from story.shoot("installed")
    return (yield from story.tab("VIEW_3D"))
