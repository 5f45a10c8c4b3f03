"""Live Balance as an artist has it: in both editors, other operators and undo meanwhile, its hint, its two ends."""

from __future__ import annotations

from types import SimpleNamespace

import bpy

from following import UNWRAP, at_rest, begun, dragged, ended, farthest, figures, over, set_mode, slider, uvs

# The part of the status bar that has the hint.
HINT = SimpleNamespace(x=0, y=0, width=700, height=20)


def tell(story):
    """In the 3D View, then in the UV editor; stories `pins` and `uv_editor` have Edit Mode."""
    obj = story.head(24)
    slider(0.0)
    bpy.context.window_manager.operator_properties_last(UNWRAP).max_shear = 0
    story.look_at_it(story.area("VIEW_3D"))
    tab = yield from story.tab("VIEW_3D")
    yield from tab.click("omt_unwrap(")
    yield from story.until(lambda: not story.running() and obj.data.uv_layers)
    # So that undo has a step to stop at.
    yield from story.pause(0.5)
    yield from accepted(story, tab, obj)
    yield from undone(story, tab, obj)
    yield from blenders_own(story, tab, obj)
    yield from ours(story, tab, obj)
    window = bpy.context.window_manager.windows[0]
    window.workspace = bpy.data.workspaces["UV Editing"]
    yield from story.pause(2)
    tab = yield from story.tab("IMAGE_EDITOR")
    if bpy.context.object.mode == "EDIT":
        set_mode(story, "OBJECT")
    yield from cancelled(story, tab, bpy.context.object)


def accepted(story, tab, obj):
    """The slider dragged in the 3D View; figures, hint and looks while it runs; packed on Accept."""
    before = figures(story)
    place = yield from begun(story, tab)
    yield from story.shoot("hint", HINT)
    seen = []
    yield from dragged(story, place, lambda: seen.append(figures(story)))
    yield from story.pause(1)
    yield from story.shoot("hint_after_drag", HINT)
    yield from story.shoot("object_mode")
    story.facts["figures before"], story.facts["figures while dragged"] = before, seen
    yield from ended(story, tab, "KEEP")
    yield from story.pause(0.5)
    yield from story.shoot("hint_at_the_end", HINT)
    shots = [picture(story.out / f"{name}.png") for name in ("hint", "hint_after_drag", "hint_at_the_end")]
    story.facts["hint stays"], story.facts["hint goes"] = shots[0] == shots[1], shots[0] != shots[2]
    uv = uvs(obj)
    story.facts["extent on accept"] = [min(uv), max(uv)]
    story.facts["accepted"] = story.figures(obj)


def undone(story, tab, obj):
    """Two drags, and Ctrl Z: the second one is undone, the session ends, and the unwrap before it stays."""
    name = obj.name
    slider(0.0)
    place = yield from begun(story, tab)
    yield from at_rest(story, obj)
    yield from dragged(story, place)
    yield from at_rest(story, obj)
    first = uvs(obj)
    yield from dragged(story, place)
    yield from at_rest(story, obj)
    second = uvs(obj)
    yield from over(story, "VIEW_3D")
    yield from story.key("ctrl+z")
    yield from story.until(lambda: not story.following(), 20)
    now = uvs(bpy.data.objects[name])
    story.facts["second drag"], story.facts["undone to the first"] = farthest(first, second), farthest(first, now)


def blenders_own(story, tab, obj):
    """A key of Blender's: the session ends, kept; to undo what the key did leaves the session's UVs."""
    obj = bpy.data.objects["Head"]
    slider(0.6)
    yield from begun(story, tab)
    yield from at_rest(story, obj)
    followed = uvs(obj)
    obj.location.x = 0.5
    yield from over(story, "VIEW_3D")
    yield from story.key("alt+g")
    yield from story.until(lambda: not story.following(), 20)
    story.facts["location cleared"] = obj.location.x == 0
    story.facts["kept when Blender's began"] = farthest(followed, uvs(obj))
    slider(0.0)
    yield from story.pause(1)
    yield from story.key("ctrl+z")
    yield from story.pause(1)
    obj = bpy.data.objects["Head"]
    story.facts["location is back"] = obj.location.x == 0.5
    story.facts["kept when Blender's is undone"] = farthest(followed, uvs(obj))


def ours(story, tab, obj):
    """Unwrap as a disk meanwhile, move the slider, undo: neither of the two is lost."""
    obj = bpy.data.objects["Head"]
    slider(0.4)
    yield from begun(story, tab)
    yield from at_rest(story, obj)
    followed = uvs(obj)
    window, view = bpy.context.window_manager.windows[0], story.area("VIEW_3D")
    bpy.context.window_manager.operator_properties_last(UNWRAP).boundary = "DISK"
    with bpy.context.temp_override(window=window, area=view, region=story.window_region(view)):
        bpy.ops.uv.omt_unwrap("INVOKE_DEFAULT", True)
    yield from story.until(lambda: not story.running() and uvs(obj) != followed)
    yield from story.pause(0.5)
    story.facts["session ended by Unwrap"] = story.following() is None
    disk = uvs(obj)
    slider(0.9)
    yield from story.pause(1)
    story.facts["moved by the slider after Unwrap"] = farthest(disk, uvs(obj))
    yield from story.shoot("unwrapped_meanwhile")
    yield from over(story, "VIEW_3D")
    yield from story.key("ctrl+z")
    yield from story.pause(1)
    story.facts["kept when Unwrap is undone"] = farthest(followed, uvs(bpy.data.objects["Head"]))
    # A run brings properties of its own: those of before are gone.
    bpy.context.window_manager.operator_properties_last(UNWRAP).boundary = "FREE"


def cancelled(story, tab, obj):
    """Object Mode in the UV editor: dragged, and every bit is back."""
    slider(0.0)
    before = uvs(obj)
    place = yield from begun(story, tab)
    yield from dragged(story, place)
    moved = uvs(obj)
    yield from story.shoot("uv_editor_object_mode")
    yield from ended(story, tab, "BACK")
    story.facts["moved before Cancel"] = farthest(before, moved)
    story.facts["moved after Cancel"] = farthest(before, uvs(obj))


def picture(path):
    """The pixels of a file."""
    image = bpy.data.images.load(str(path))
    pixels = list(image.pixels)
    bpy.data.images.remove(image)
    return pixels
