"""A run of several seconds, and Esc in the middle of it."""

from __future__ import annotations

import time


def tell(story):
    """Start, wait a moment, press Esc."""
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
