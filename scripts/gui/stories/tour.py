"""What an artist does in the first two minutes: one click, a look, the redo panel."""

from __future__ import annotations

import bpy

# Places in an editor, pixels from its upper right corner, before and after the box with figures has come.
TAB = (10, 213)
UNWRAP = (127, 105)
AREA = (127, 453)
SHEAR = (68, 453)
OFF = (185, 453)
HISTOGRAM = (81, 506)
# The redo panel, pixels of the window from its lower left corner.
REDO = (150, 104)


def tell(story):
    """Unwrap, look at it in colours, change a setting."""
    obj = story.head(60)
    yield from story.open_tab(TAB)
    yield from first_unwrap(story, obj)
    yield from colours(story)
    yield from redo(story)


def first_unwrap(story, obj):
    """One click in the tab."""
    yield from story.shoot("tab")
    yield from story.click(*story.place("VIEW_3D", *UNWRAP))
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    story.facts["clicks to an unwrap"] = story.clicks
    story.facts["unwrapped"] = story.figures(obj)
    yield from story.shoot("unwrapped")


def colours(story):
    """Both colourings and the histogram, on and off."""
    obj = bpy.context.object
    shading = story.area("VIEW_3D").spaces.active.shading
    for name, place in (("area", AREA), ("shear", SHEAR)):
        yield from story.click(*story.place("VIEW_3D", *place))
        yield from story.shoot(name)
        story.facts[f"{name} colours"] = [a.name for a in obj.data.color_attributes], shading.color_type
    yield from story.click(*story.place("VIEW_3D", *HISTOGRAM))
    yield from story.shoot("histogram")
    yield from story.click(*story.place("VIEW_3D", *OFF))
    story.facts["colours off"] = [a.name for a in obj.data.color_attributes], shading.color_type


def redo(story):
    """Unwrap once more, open the redo panel, change a setting there."""
    yield from story.click(*story.place("VIEW_3D", *UNWRAP))
    yield from story.until(lambda: not story.running())
    yield from story.pause(1)
    yield from story.click(REDO[0], 900 - REDO[1])
    yield from story.shoot("redo")
