"""The same tab where the UVs are, on the selected faces in Edit Mode: unwrap, follow the slider, colours."""

from __future__ import annotations

import bpy

# Places in the editor, pixels from its upper right corner, before and after the box with the figures of a live session.
TAB = (14, 168)
UNWRAP = (127, 105)
LIVE = (50, 136)
SLIDER_START = (200, 136)
SLIDER_END = (110, 136)
AREA = (127, 415)
SHEAR = (68, 415)
OFF = (185, 415)


def tell(story):
    """Unwrap in the UV Editor, drag the slider, look at both colourings."""
    obj = story.head(60)
    window = bpy.context.window_manager.windows[0]
    window.workspace = bpy.data.workspaces["UV Editing"]
    yield from story.pause(2)
    if obj.mode != "EDIT":
        with bpy.context.temp_override(window=window, area=story.area("VIEW_3D")):
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
    story.look_at_it(story.area("VIEW_3D"))
    editor = story.area("IMAGE_EDITOR")
    editor.spaces.active.show_region_ui = True
    yield from story.pause(1)
    yield from story.click(*story.place("IMAGE_EDITOR", *TAB))
    yield from story.click(*story.place("IMAGE_EDITOR", *UNWRAP))
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    with bpy.context.temp_override(window=window, area=editor, region=story.window_region(editor)):
        bpy.ops.image.view_all(fit_view=True)
    yield from story.shoot("uv_unwrapped")
    story.facts["unwrapped in the UV editor"] = story.figures(obj)
    yield from live(story, obj)
    for name, place in (("uv_area", AREA), ("uv_shear", SHEAR)):
        yield from story.click(*story.place("IMAGE_EDITOR", *place))
        yield from story.shoot(name)
        story.facts[name] = [a.name for a in obj.data.color_attributes]
    yield from story.click(*story.place("IMAGE_EDITOR", *OFF))


def live(story, obj):
    """Drag the slider; the UVs follow before the button is let go."""
    seen = []
    yield from story.click(*story.place("IMAGE_EDITOR", *LIVE))
    start, end = (story.place("IMAGE_EDITOR", *place) for place in (SLIDER_START, SLIDER_END))
    yield from story.drag(start, end, steps=6, keep=lambda: seen.append(story.figures(obj)))
    yield from story.pause(2)
    yield from story.shoot("live")
    story.facts["while dragging"] = [round(figures["area_l1"], 4) for figures in seen]
    story.facts["after dragging"] = story.figures(obj)
    yield from story.move(*story.place("IMAGE_EDITOR", 400, 400))
    yield from story.key("Return")
