"""Draw docs/pictures/hard.png: one click on bodies of hard surfaces, beside Smart UV Project and Minimum Stretch.

    python scripts/pictures/hard_plate.py [OUT.png]

A flange, a nut, a bracket and a crate, cut out of cubes and cylinders, with bevels but for the nut; a barrel and a
wheel, turned about their axes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

import bmesh
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import compare
import renders
import rival_maps

PIXELS = 300
CELLS = 250  # of the checker, on a body
COLUMNS = ["Smart UV Project", "Minimum Stretch, our seams", "OMT UV"]
HOLES = 6  # of the flange


def added(add, *place, scale=(1, 1, 1), **shape):
    """A new primitive of Blender, moved and scaled."""
    add(location=place or (0, 0, 0), **shape)
    obj = bpy.context.object
    obj.scale = scale
    bpy.ops.object.transform_apply(location=False, rotation=False)
    return obj


def cylinder(*place, radius, depth, vertices=48):
    """A cylinder along Z."""
    return added(bpy.ops.mesh.primitive_cylinder_add, *place, radius=radius, depth=depth, vertices=vertices)


def cube(*place, scale):
    """A box of these half sides."""
    return added(bpy.ops.mesh.primitive_cube_add, *place, scale=scale)


def cut(body, tool, operation="DIFFERENCE"):
    """The body with the tool taken off or joined to it."""
    body.modifiers.new("cut", "BOOLEAN").object = tool
    body.modifiers["cut"].operation = operation
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.modifier_apply(modifier="cut")
    bpy.data.objects.remove(tool)
    return body


def bevelled(body, width):
    """The body with its sharp edges rounded in two segments."""
    bevel = body.modifiers.new("bevel", "BEVEL")
    bevel.width, bevel.segments, bevel.angle_limit = width, 2, np.radians(40)
    bpy.ops.object.modifier_apply(modifier="bevel")
    return body


def flange():
    """A disk with holes and a shaft."""
    body = cut(cylinder(radius=0.3, depth=2, vertices=32), cylinder(0, 0, -0.8, radius=1, depth=0.3), "UNION")
    for angle in 2 * np.pi * np.arange(HOLES) / HOLES:
        body = cut(body, cylinder(0.65 * np.cos(angle), 0.65 * np.sin(angle), -0.8, radius=0.12, depth=2, vertices=24))
    return bevelled(body, 0.02)


def nut():
    """A prism of six sides with a hole."""
    return cut(cylinder(radius=1, depth=0.8, vertices=6), cylinder(radius=0.5, depth=2))


def bracket():
    """Two plates at a right angle, one with a hole."""
    body = cut(cube(scale=(1, 0.6, 0.15)), cube(-0.85, 0, 0.7, scale=(0.15, 0.6, 0.7)), "UNION")
    return bevelled(cut(body, cylinder(0.4, 0, 0, radius=0.25, depth=2, vertices=32)), 0.02)


def crate():
    """A cube with a hollow and a block."""
    body = cut(cube(scale=(1, 1, 1)), cube(0, 0, 1, scale=(0.5, 0.5, 0.5)))
    return bevelled(cut(body, cube(1, 0, 0, scale=(0.5, 0.5, 0.5)), "UNION"), 0.04)


def turned(profile, sectors=32, ring=False):
    """A profile of radii and heights turned about Z, a ring where it is closed."""
    edit = bmesh.new()
    vertices = [edit.verts.new((radius, 0, height)) for radius, height in profile]
    for k in range(len(vertices) - (not ring)):
        edit.edges.new((vertices[k], vertices[(k + 1) % len(vertices)]))
    whole = {"geom": edit.verts[:] + edit.edges[:], "axis": (0, 0, 1), "cent": (0, 0, 0), "angle": 2 * np.pi}
    bmesh.ops.spin(edit, steps=sectors, use_merge=False, **whole)
    bmesh.ops.remove_doubles(edit, verts=edit.verts[:], dist=1e-5)
    bmesh.ops.recalc_face_normals(edit, faces=edit.faces[:])
    mesh = bpy.data.meshes.new("turned")
    edit.to_mesh(mesh)
    edit.free()
    body = bpy.data.objects.new("turned", mesh)
    bpy.context.scene.collection.objects.link(body)
    bpy.context.view_layer.objects.active = body
    return body


def barrel():
    """Staves between two ends."""
    return bevelled(turned([(0, -0.7), (0.5, -0.7), (0.6, -0.25), (0.62, 0), (0.6, 0.25), (0.5, 0.7), (0, 0.7)]), 0.02)


def wheel():
    """A tyre, its edges rounded."""
    return bevelled(
        turned([(0.6, -0.25), (0.95, -0.3), (1, -0.25), (1, 0.25), (0.95, 0.3), (0.6, 0.25)], ring=True), 0.03
    )


BODIES = {"flange": flange, "nut": nut, "bracket": bracket, "crate": crate, "barrel": barrel, "wheel": wheel}
VIEWS = {
    "flange": renders.View("Z", 30, -40),
    "nut": renders.View("Z", 30, 35),
    "bracket": renders.View("Z", 50, 25),
    "crate": renders.View("Z", 50, 35),
    "barrel": renders.View("Z", 35, 25),
    "wheel": renders.View("Z", 35, 50),
}


def made(body):
    """The body, alone in its scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return body()


def maps_of(body):
    """The maps of a body by column."""
    ours = rival_maps.ours(made(body))
    stretch = rival_maps.blender_unwrap(made(body), ours.cut, "Minimum Stretch 50")
    return {"smart": rival_maps.smart_project(made(body)), "stretch": stretch, "ours": ours}


def draw(bodies, views, default):
    """Map bodies, draw them, and write the plate to what the command names, or else to a default."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / default
    compare.draw_bodies(path, COLUMNS, {name: maps_of(body) for name, body in bodies.items()}, views, CELLS, PIXELS)


if __name__ == "__main__":
    draw(BODIES, VIEWS, "docs/pictures/hard.png")
