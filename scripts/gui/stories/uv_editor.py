"""The same tab where the UVs are, on the selected faces in Edit Mode: unwrap, follow the slider, colours."""

from __future__ import annotations

import bpy

# Where the button is beside the slider, as shares of the width.
LIVE = (0.72, 0.63, 0.77)


def tell(story):
    """Unwrap in the UV Editor, drag the slider, look at both colourings."""
    obj = story.head(40)
    window = bpy.context.window_manager.windows[0]
    window.workspace = bpy.data.workspaces["UV Editing"]
    yield from story.pause(2)
    if obj.mode != "EDIT":
        with bpy.context.temp_override(window=window, area=story.area("VIEW_3D")):
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
    # Which seams are best is another story, and the longest part of a run.
    bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").max_shear = 0
    story.look_at_it(story.area("VIEW_3D"))
    editor = story.area("IMAGE_EDITOR")
    tab = yield from story.tab("IMAGE_EDITOR")
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    with bpy.context.temp_override(window=window, area=editor, region=story.window_region(editor)):
        bpy.ops.image.view_all(fit_view=True)
    yield from story.shoot("uv_unwrapped")
    story.facts["unwrapped in the UV editor"] = story.figures(obj)
    yield from live(story, tab, obj)
    for name in ("uv_area", "uv_shear"):
        yield from tab.click("omt_overlay", f"'{name.removeprefix('uv_').upper()}'")
        yield from story.shoot(name)
        story.facts[name] = [a.name for a in obj.data.color_attributes]
    yield from discarded(story, tab, obj)
    yield from object_mode(story, tab, obj, window)


def live(story, tab, obj):
    """Drag the slider; the UVs follow before the button is let go. Then accept."""
    seen = []
    place = yield from tab.click("omt_live(", places=LIVE)
    yield from story.until(story.following)
    # The slider is to the left of its button and stands at 0, its left end: only a drag to the right moves it.
    start, end = (place[0] - 115, place[1]), (place[0] - 40, place[1])
    yield from story.drag(start, end, steps=6, keep=lambda: seen.append(story.figures(obj)))
    yield from story.pause(2)
    yield from story.shoot("live")
    story.facts["while dragging"] = [round(figures["area_l1"], 4) for figures in seen]
    story.facts["after dragging"] = story.figures(obj)
    story.facts["figures while it runs"] = story.said()
    yield from tab.click("omt_live_end", "'KEEP'", places=(0.25, 0.5))
    yield from story.until(lambda: not story.following())
    story.facts["accepted"] = story.figures(obj)


def discarded(story, tab, obj):
    """A session that is on when another unwrap is started: the new UVs stay, whatever the slider does."""
    yield from tab.click("omt_live(", places=LIVE)
    yield from story.until(story.following)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=story.area("IMAGE_EDITOR")):
        bpy.ops.uv.omt_unwrap("EXEC_DEFAULT", boundary="DISK", balance=0.0)
    yield from story.pause(1)
    before = story.figures(obj)
    bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").balance = 0.9
    yield from story.pause(2)
    story.facts["session after another unwrap"] = story.following() is not None
    story.facts["the other unwrap stays"] = before == story.figures(obj)
    bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").balance = 0.0


def object_mode(story, tab, obj, window):
    """Colours in the UV editor are there in Object Mode, too."""
    with bpy.context.temp_override(window=window, area=story.area("VIEW_3D")):
        bpy.ops.object.mode_set(mode="OBJECT")
    yield from tab.click("omt_overlay", "'AREA'")
    yield from story.shoot("uv_object_mode")
    yield from tab.click("omt_overlay", "'NONE'")
