"""Live Balance in Edit Mode: in the 3D View, and pins that are dragged in the UV editor, hard and soft ones."""

from __future__ import annotations

import bpy

import bmesh
from following import at_rest, begun, dragged, ended, farthest, figures, over, set_mode, slider, uvs

# Pixels that a pin is moved by, in so many steps: what is moved at the first shall be what is moved at the last.
FAR = 60
STEPS = 4
# Vertices that are pinned: one, or two.
ONE = [100]
TWO = [100, 300]


def tell(story):
    """A head in one piece, in Edit Mode."""
    story.head(24)
    slider(0.0)
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        bpy.ops.uv.omt_unwrap("EXEC_DEFAULT", max_shear=0)
    story.look_at_it(story.area("VIEW_3D"))
    set_mode(story, "EDIT")
    yield from story.pause(0.5)
    tab = yield from story.tab("VIEW_3D")
    yield from in_the_3d_view(story, tab, bpy.context.object)
    window.workspace = bpy.data.workspaces["UV Editing"]
    yield from story.pause(2)
    tab = yield from story.tab("IMAGE_EDITOR")
    if bpy.context.object.mode != "EDIT":
        set_mode(story, "EDIT")
    bpy.context.scene.tool_settings.use_uv_select_sync = True
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    yield from one_pin(story, tab, bpy.context.object)
    yield from two_pins(story, tab, bpy.context.object)


def in_the_3d_view(story, tab, obj):
    """The slider is dragged, and the UVs follow with their figures; Cancel has every bit back."""
    before, said = uvs(obj), figures(story)
    place = yield from begun(story, tab)
    yield from at_rest(story, obj)
    started, seen = uvs(obj), []
    yield from dragged(story, place, lambda: seen.append(figures(story)))
    yield from at_rest(story, obj)
    yield from story.shoot("edit_mode")
    story.facts["moved in Edit Mode"] = farthest(started, uvs(obj))
    story.facts["figures in Edit Mode"] = [said, *seen, figures(story)]
    yield from ended(story, tab, "BACK")
    story.facts["moved after Cancel"] = farthest(before, uvs(obj))


def one_pin(story, tab, obj):
    """Nothing is selected but a pinned vertex: it is moved, and its island comes along."""
    pin(obj, ONE)
    slider(0.0)
    yield from begun(story, tab)
    yield from at_rest(story, obj)
    before, place = uvs(obj), place_of(obj, ONE[0])
    yield from grabbed(story)
    yield from at_rest(story, obj)
    steps = [b - a for a, b in zip(before, uvs(obj), strict=True)][::2]
    story.facts["pin moved by"] = place_of(obj, ONE[0])[0] - place[0]
    story.facts["its island moved by"] = [min(steps), max(steps)]
    yield from story.shoot("one_pin")
    yield from ended(story, tab, "KEEP")


def two_pins(story, tab, obj):
    """Two pins, one of them moved: hard ones stay where they are put, soft ones give way."""
    for kind in ("HARD", "SOFT"):
        pin(obj, TWO, selected=TWO[1:])
        bpy.context.window_manager.operator_properties_last("uv.omt_live").pins = kind
        yield from begun(story, tab)
        yield from at_rest(story, obj)
        before = [place_of(obj, vertex) for vertex in TWO]
        yield from grabbed(story)
        yield from at_rest(story, obj)
        after = [place_of(obj, vertex) for vertex in TWO]
        story.facts[f"{kind.lower()} pins moved by"] = [b[0] - a[0] for a, b in zip(before, after, strict=True)]
        story.facts[f"folds with {kind.lower()} pins"] = dict(story.said()[1:])["Folded faces"]
        yield from story.shoot(f"{kind.lower()}_pins")
        yield from ended(story, tab, "BACK")
    bpy.context.window_manager.operator_properties_last("uv.omt_live").pins = "HARD"


def grabbed(story):
    """G in the UV editor, to the right, and a click."""
    x, y = yield from over(story, "IMAGE_EDITOR")
    yield from story.key("g")
    for k in range(1, STEPS + 1):
        yield from story.move(x + FAR * k // STEPS, y)
        yield from story.pause(0.5)
    yield from story.click(x + FAR, y)


def pin(obj, vertices, selected=None):
    """These vertices alone are pinned and selected."""
    edit = bmesh.from_edit_mesh(obj.data)
    layer = edit.loops.layers.uv.verify()
    for element in (*edit.faces, *edit.edges, *edit.verts):
        element.select = False
    for vertex in edit.verts:
        vertex.select = vertex.index in (vertices if selected is None else selected)
        for loop in vertex.link_loops:
            loop[layer].pin_uv = vertex.index in vertices
    edit.select_flush_mode()
    if hasattr(edit, "uv_select_sync_valid"):
        edit.uv_select_sync_valid = False
    bmesh.update_edit_mesh(obj.data)


def place_of(obj, vertex):
    """Where one of the corners of a vertex is."""
    edit = bmesh.from_edit_mesh(obj.data)
    edit.verts.ensure_lookup_table()
    return list(edit.verts[vertex].link_loops[0][edit.loops.layers.uv.active].uv)
