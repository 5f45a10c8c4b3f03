"""A run of several seconds, and Esc in the middle of it; another one, and Enter once there is a map to keep."""

from __future__ import annotations

import time

import bpy


def tell(story):
    """Start, wait a moment, press Esc; start anew, press Enter."""
    obj = story.head(200)
    story.look_at_it(story.area("VIEW_3D"))
    tab = yield from story.tab("VIEW_3D")
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: story.running() and story.running().seconds > 1.5)
    yield from story.shoot("progress")
    story.facts["stage cancelled"] = story.running().stage
    # A slip of the mouse cancels nothing.
    yield from story.click(*story.place("VIEW_3D", 600, 300), button=3)
    story.facts["still running after a right click"] = story.running() is not None
    begin = time.monotonic()
    yield from story.x("key", "Escape")
    yield from story.until(lambda: not story.running())
    story.facts["cancelled after"] = time.monotonic() - begin
    yield from story.pause(0.5)
    yield from story.shoot("cancelled")
    story.facts["layers after cancel"] = len(obj.data.uv_layers)
    yield from keep(story, tab, obj)


def keep(story, tab, large):
    """A bound that takes several rounds of seams: Enter keeps what the first had."""
    bpy.data.objects.remove(large)
    obj = story.head(80)
    bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").max_shear = 1.03
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running() or story.running().early)
    story.facts["offered"] = story.running() is not None
    yield from story.shoot("keep")
    story.facts["keys"] = story.running().keys() if story.running() else ""
    yield from story.x("key", "Return")
    yield from story.until(lambda: not story.running())
    story.facts["layers after keep"] = len(obj.data.uv_layers)
    story.facts["kept"] = story.figures(obj)
    story.facts["notices"] = [n.text for n in story.package("session.last_run").state.summary.notices]
    yield from story.shoot("kept")
