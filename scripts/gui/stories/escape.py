"""A run of several seconds, and Esc in the middle of it."""

from __future__ import annotations

import time

# Places in the 3D View, pixels from its upper right corner.
TAB = (10, 213)
UNWRAP = (127, 105)


def tell(story):
    """Start, wait a moment, press Esc."""
    obj = story.head(200)
    yield from story.open_tab(TAB)
    yield from story.click(*story.place("VIEW_3D", *UNWRAP))
    yield from story.until(lambda: story.running() and story.running().seconds > 1.5)
    yield from story.shoot("progress")
    story.facts["stage cancelled"] = story.running().stage
    begin = time.monotonic()
    yield from story.x("key", "Escape")
    yield from story.until(lambda: not story.running())
    story.facts["cancelled after"] = time.monotonic() - begin
    yield from story.pause(0.5)
    yield from story.shoot("cancelled")
    story.facts["layers after cancel"] = len(obj.data.uv_layers)
