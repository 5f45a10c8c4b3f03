"""A ball of 20,000 vertices is pulled in the 3D View, and its UVs are pushed in the UV editor, both while one looks."""

from __future__ import annotations

import time

import bpy

import bmesh

STEPS = 8
# How far from the middle of the view the mouse goes.
FAR = 120


def tell(story):
    """Pull, keep; push, let go; push again, and put back."""
    obj = ball()
    window = bpy.context.window_manager.windows[0]
    window.workspace = bpy.data.workspaces["UV Editing"]
    yield from story.pause(2)
    view, editor = story.area("VIEW_3D"), story.area("IMAGE_EDITOR")
    if obj.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for elements in (obj.data.edges, obj.data.polygons):
        elements.foreach_set("select", [False] * len(elements))
    for vertex in obj.data.vertices:
        vertex.select = vertex.co.z > 0.95
    with bpy.context.temp_override(window=window, area=view, region=story.window_region(view)):
        bpy.ops.object.mode_set(mode="EDIT")
    story.look_at_it(view)
    yield from pull(story, window, view, obj)
    with bpy.context.temp_override(window=window, area=view, region=story.window_region(view)):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    with bpy.context.temp_override(window=window, area=editor, region=story.window_region(editor)):
        bpy.ops.image.view_all(fit_view=True)
    yield from push(story, window, editor, obj)


def ball():
    """A ball with UVs, instead of the cube."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=142, ring_count=142)
    return bpy.context.active_object


def watched(story, kind):
    """Processor seconds of everything that a drag of a kind, "FlowDrag" or "UVDrag", shows from now on."""
    shown = []
    drag = getattr(story.package("operators.volumes.drag"), kind)
    show = drag.to

    def timed(self, *where):
        begin = time.process_time()
        there = show(self, *where)
        shown.append(time.process_time() - begin)
        return there

    drag.to = timed
    return shown


def middle(story, window, area):
    """Screen coordinates of the middle of an area."""
    region = story.window_region(area)
    return region.x + region.width // 2, window.height - (region.y + region.height // 2)


def started(story, window, area, operator):
    """The operator, from the middle of an area, as a key would start it."""
    yield from story.move(*middle(story, window, area))
    with bpy.context.temp_override(window=window, area=area, region=story.window_region(area)):
        operator("INVOKE_DEFAULT")
    yield from story.pause(0.5)


def pull(story, window, view, obj):
    """The selected vertices, upwards; a click keeps it."""
    shown = watched(story, "FlowDrag")
    yield from started(story, window, view, bpy.ops.object.omt_flow)
    x, y = middle(story, window, view)
    for k in range(1, STEPS + 1):
        yield from story.move(x + FAR * k // STEPS // 2, y - FAR * k // STEPS)
    yield from story.shoot("pulled")
    yield from story.click(x + FAR // 2, y - FAR)
    yield from story.until(lambda: not story.running() and story.said())
    story.facts["vertices"] = len(obj.data.vertices)
    story.facts["pulled"] = story.said()
    story.facts["shown while pulled"] = [round(t, 3) for t in shown]
    story.forget()


def push(story, window, editor, obj):
    """The UVs in the middle to the right, kept; then up, and put back."""
    before = uvs(obj)
    shown = watched(story, "UVDrag")
    yield from started(story, window, editor, bpy.ops.uv.omt_flow)
    x, y = middle(story, window, editor)
    yield from story.drag((x, y), (x + FAR, y), steps=STEPS)
    yield from story.until(lambda: not story.running() and uvs(obj) != before)
    yield from story.shoot("pushed")
    kept = uvs(obj)
    story.facts["uvs moved"] = farthest(before, kept)
    story.facts["shown while pushed"] = [round(t, 3) for t in shown]
    yield from started(story, window, editor, bpy.ops.uv.omt_flow)
    yield from story.x("mousedown", 1)
    yield from story.pause(0.5)
    yield from story.move(x, y - FAR)
    during = uvs(obj)
    yield from story.key("Escape")
    yield from story.x("mouseup", 1)
    yield from story.pause(0.5)
    story.facts["uvs moved before Esc"] = farthest(kept, during)
    story.facts["uvs moved after Esc"] = farthest(kept, uvs(obj))


def uvs(obj):
    """All UVs as they are in Edit Mode."""
    edit = bmesh.from_edit_mesh(obj.data)
    layer = edit.loops.layers.uv.active
    return [x for face in edit.faces for loop in face.loops for x in loop[layer].uv]


def farthest(one, other):
    """The greatest difference of two lists of numbers."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))
