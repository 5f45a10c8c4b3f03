"""What an artist does in the first two minutes: one click, a look, a checker, the redo panel."""

from __future__ import annotations

import bpy

# The redo panel, pixels of the window from its lower left corner.
REDO = (150, 104)


def tell(story):
    """Unwrap, look at it in colours and with a checker, change a setting."""
    obj = story.head(40)
    story.look_at_it(story.area("VIEW_3D"))
    tab = yield from story.tab("VIEW_3D")
    yield from first_unwrap(story, tab, obj)
    yield from colours(story, tab)
    yield from checker(story, tab, obj)
    yield from outdated(story, obj)
    yield from redo(story, tab)


def first_unwrap(story, tab, obj):
    """One click in the tab."""
    yield from story.shoot("tab")
    story.clicks = 0
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    story.facts["clicks to an unwrap"] = story.clicks
    story.facts["unwrapped"] = story.figures(obj)
    yield from story.shoot("unwrapped")


def colours(story, tab):
    """Both colourings and the histogram, on and off; no button moves by it."""
    obj = bpy.context.object
    shading = story.area("VIEW_3D").spaces.active.shading
    for name in ("area", "shear"):
        yield from tab.click("omt_overlay", f"'{name.upper()}'")
        yield from story.shoot(name)
        story.facts[f"{name} colours"] = [a.name for a in obj.data.color_attributes], shading.color_type
    yield from tab.click("omt_histogram")
    yield from story.shoot("histogram")
    yield from tab.click("omt_overlay", "'NONE'")
    story.facts["colours off"] = [a.name for a in obj.data.color_attributes], shading.color_type


def checker(story, tab, obj):
    """One click puts it on, one takes it off."""
    story.clicks = 0
    yield from tab.click("omt_checker(")
    story.facts["clicks to a checker"] = story.clicks
    story.facts["checker"] = [slot.material.name for slot in obj.material_slots]
    yield from story.shoot("checker")
    yield from tab.click("omt_checker_remove")
    story.facts["checker off"] = len(obj.material_slots)


def outdated(story, obj):
    """A vertex moves: the figures hold no more, and the panel says so by itself."""
    state = story.package("session.last_run").state
    story.facts["outdated before"] = state.outdated
    obj.data.vertices[0].co.z += 0.2
    obj.data.update()
    yield from story.until(lambda: state.outdated, 10)
    yield from story.shoot("outdated")
    story.facts["outdated"] = state.outdated


def redo(story, tab):
    """Unwrap once more, open the redo panel, change a setting there."""
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running())
    yield from story.pause(1)
    yield from story.click(REDO[0], 900 - REDO[1])
    yield from story.shoot("redo")
