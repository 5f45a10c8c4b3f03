"""The sections of shapes and bodies: cells, two objects compared and matched, one moved without a change of volume."""

from __future__ import annotations

import bpy


def tell(story):
    """Open every section, look, and click its button where it needs nothing else."""
    first = story.head(16)
    story.look_at_it(story.area("VIEW_3D"))
    tab = yield from story.tab("VIEW_3D")
    yield from tab.open("result")
    story.facts["partition"] = yield from partition(story, tab, first)
    second = beside(first)
    yield from tab.open("inspect")
    yield from tab.click("omt_distance(")
    yield from story.shoot("distance")
    story.facts["distance"] = "OMT Distance" in second.data.attributes
    yield from tab.open("match")
    yield from story.shoot("match")
    yield from tab.click("omt_match(")
    yield from story.until(lambda: not story.running() and story.said())
    story.facts["match"] = story.said()
    # Behind the short one the last one is in sight.
    for name in ("arrange", "volume"):
        yield from tab.open(name)
        yield from story.shoot(name)
    story.facts["volume before"] = volume(second)
    yield from flow(story, tab, second)
    story.facts["volume after"] = volume(second)


def partition(story, tab, obj):
    """Cells as an attribute, by a click."""
    yield from tab.open("partition")
    yield from story.shoot("partition")
    bpy.context.window_manager.operator_properties_last("mesh.omt_partition").cells = 12
    yield from tab.click("omt_partition(")
    yield from story.until(lambda: not story.running() and story.said())
    said = story.said()
    story.forget()
    return [said, sorted(a.name for a in obj.data.attributes if "OMT" in a.name)]


def beside(first):
    """A copy that is wider, active; the first one stays selected."""
    second = first.copy()
    second.data = first.data.copy()
    bpy.context.collection.objects.link(second)
    for vertex in second.data.vertices:
        vertex.co.y *= 1.2
    second.select_set(True)
    bpy.context.view_layer.objects.active = second
    return second


def flow(story, tab, obj):
    """The vertices at the top, given a Move, by a click."""
    for each in bpy.context.view_layer.objects:
        each.select_set(each == obj)
    top = max(v.co.z for v in obj.data.vertices)
    for vertex in obj.data.vertices:
        vertex.select = vertex.co.z > top - 0.1
    chosen = bpy.context.window_manager.operator_properties_last("object.omt_flow")
    chosen.move = (0.0, 0.0, 0.3)
    yield from tab.open("flow")
    yield from story.shoot("flow")
    yield from tab.click("object.omt_flow(")
    yield from story.until(lambda: not story.running() and story.said())
    story.facts["flow"] = story.said()
    yield from story.shoot("flowed")


def volume(obj):
    """Inside of the mesh; the flat neck closes it."""
    mesh, total = obj.data, 0.0
    mesh.calc_loop_triangles()
    for triangle in mesh.loop_triangles:
        a, b, c = (mesh.vertices[k].co for k in triangle.vertices)
        total += a.dot(b.cross(c)) / 6
    return total
