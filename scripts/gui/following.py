"""Steps of stories about Live Balance: its button, its slider, its two ends, and the UVs that follow."""

from __future__ import annotations

import bpy

import bmesh

# Where the buttons are, as shares of the width: the one beside the slider, and the two ends.
LIVE = (0.72, 0.63, 0.77)
ENDS = (0.25, 0.5, 0.75, 0.65)
UNWRAP = "uv.omt_unwrap"


def begun(story, tab):
    """The session, by a click; where that was."""
    place = yield from tab.click("omt_live(", places=LIVE)
    yield from story.until(story.following)
    yield from story.pause(0.6)
    return place


def ended(story, tab, end):
    """The session, by one of its two buttons: "KEEP" or "BACK"."""
    yield from tab.click("omt_live_end", f"'{end}'", places=ENDS)
    yield from story.until(lambda: not story.following())


def dragged(story, place, keep=None):
    """The slider, from its left end to about two thirds."""
    yield from story.drag((place[0] - 115, place[1]), (place[0] - 40, place[1]), steps=6, keep=keep)


def at_rest(story, obj):
    """Until the UVs move no more."""
    before = None
    while before != (before := uvs(obj)):
        yield from story.pause(0.6)


def over(story, kind):
    """The mouse in the middle of an editor."""
    region, window = story.window_region(story.area(kind)), bpy.context.window_manager.windows[0]
    place = region.x + region.width // 2, window.height - (region.y + region.height // 2)
    yield from story.move(*place)
    return place


def slider(balance):
    """Put the slider somewhere."""
    bpy.context.window_manager.operator_properties_last(UNWRAP).balance = balance


def set_mode(story, mode):
    """Edit Mode or Object Mode."""
    window, view = bpy.context.window_manager.windows[0], story.area("VIEW_3D")
    with bpy.context.temp_override(window=window, area=view, region=story.window_region(view)):
        bpy.ops.object.mode_set(mode=mode)


def uvs(obj):
    """All UVs as they are now, in any mode."""
    if obj.mode != "EDIT":
        return [x for each in obj.data.uv_layers.active.uv for x in each.vector]
    edit = bmesh.from_edit_mesh(obj.data)
    layer = edit.loops.layers.uv.active
    return [x for face in edit.faces for loop in face.loops for x in loop[layer].uv]


def figures(story):
    """The area error that the panel shows."""
    said = story.said()
    return dict(said[1:]).get("Area error", "") if said else ""


def farthest(one, other):
    """The greatest difference of two lists of numbers."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))
