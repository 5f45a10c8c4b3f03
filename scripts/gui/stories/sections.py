"""The sections below the main one: a painted region magnified, a globe, a new mesh beside the old."""

from __future__ import annotations

import bpy

import bmesh


def tell(story):
    """Open every section once and click its button."""
    obj = closed_head(story)
    paint(obj)
    dress(obj)
    space = story.area("VIEW_3D").spaces.active
    space.shading.color_type = "TEXTURE"
    space.overlay.show_stats = True
    story.look_at_it(story.area("VIEW_3D"))
    tab = yield from story.tab("VIEW_3D")
    # Others are in sight once this one alone is open.
    yield from tab.open("result")
    story.facts["magnified"] = yield from run(story, tab, "magnify", "omt_magnify(")
    story.facts["sphere"] = yield from run(story, tab, "sphere", "omt_sphere(")
    bpy.context.window_manager.operator_properties_last("object.omt_remesh").target_vertices = 2000
    story.facts["remeshed"] = yield from run(story, tab, "remesh", "omt_remesh(")
    story.facts["objects"] = sorted(bpy.data.objects.keys())
    story.facts["original is hidden"] = bpy.data.objects["Head"].hide_get()


def run(story, tab, name, button):
    """Open a section, click its button, and look."""
    yield from tab.open(name)
    yield from tab.click(button)
    yield from story.until(lambda: not story.running() and story.said())
    if name == "remesh":
        show_alone(story, bpy.context.view_layer.objects.active)
    yield from story.shoot(name)
    said = story.said()
    story.forget()
    return said


def show_alone(story, obj):
    """With its wires, not among those of the object that it was made from."""
    story.area("VIEW_3D").spaces.active.shading.color_type = "MATERIAL"
    obj.show_wire = obj.show_all_edges = True
    obj.select_set(False)


def closed_head(story):
    """The bust with its neck closed."""
    obj = story.head(40)
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    bmesh.ops.holes_fill(mesh, edges=[edge for edge in mesh.edges if edge.is_boundary])
    mesh.to_mesh(obj.data)
    mesh.free()
    return obj


def paint(obj):
    """A soft brush on the nose."""
    group = obj.vertex_groups.new(name="Nose")
    nose = max((vertex.co for vertex in obj.data.vertices), key=lambda place: place.x)
    for vertex in obj.data.vertices:
        group.add([vertex.index], max(0.0, min(1.0, 1.5 - 2 * (vertex.co - nose).length)), "REPLACE")


def dress(obj):
    """A checker: where texture is dense its squares are small."""
    image = bpy.data.images.new("Checker", 2048, 2048)
    image.generated_type = "UV_GRID"
    material = bpy.data.materials.new("Checker")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    obj.data.materials.append(material)
