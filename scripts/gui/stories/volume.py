"""A body's inside, mapped by clicks in the section Volume: shells of equal volume, then a slice."""

from __future__ import annotations

import bpy

# Few, for a window that draws without a graphics card.
TETS = 3000
SHELLS = 3


def tell(story):
    """Shells, looked at from the side of the cut, then a slice alone."""
    obj = blob()
    story.look_at_it(story.area("VIEW_3D"))
    tab = yield from story.tab("VIEW_3D")
    yield from tab.open("volume")
    yield from story.shoot("volume")
    chosen = last_chosen()
    chosen.tets, chosen.shells, chosen.result = TETS, SHELLS, "SHELLS"
    story.facts["shells"] = yield from made(story, tab, obj)
    yield from story.shoot("shells")
    last_chosen().result = "SLICE"
    story.facts["slice"] = yield from made(story, tab, obj)
    for each in bpy.data.objects:
        each.hide_set(each.name not in story.facts["slice"]["new"])
    yield from story.shoot("slice")


def last_chosen():
    """What the section shows, and the next click takes; each run may leave it elsewhere."""
    return bpy.context.window_manager.operator_properties_last("object.omt_volume")


def made(story, tab, obj):
    """Names and figures of what a click makes of a body."""
    before = set(bpy.data.objects.keys())
    for each in bpy.context.view_layer.objects:
        each.select_set(each == obj)
    bpy.context.view_layer.objects.active = obj
    story.forget()
    yield from tab.click("object.omt_volume(")
    yield from story.until(lambda: not story.running() and story.said())
    new = sorted(set(bpy.data.objects.keys()) - before)
    return {"new": new, "said": story.said(), "vertices": [len(bpy.data.objects[name].data.vertices) for name in new]}


def blob():
    """A closed body, longer than it is wide, instead of the cube."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
    obj = bpy.context.active_object
    for vertex in obj.data.vertices:
        x, y, z = vertex.co
        vertex.co = (x * (1 + 0.3 * z), y * (1 + 0.3 * z), z * 1.4)
    return obj
