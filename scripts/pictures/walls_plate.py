"""Draw docs/pictures/walls.png: one click on thin walls and boxes, beside Smart UV Project and Minimum Stretch.

    python scripts/pictures/walls_plate.py [OUT.png]

A helmet, a shirt, a vase and a bottle, which were given a thickness; a chair and a sofa of boxes with rounded edges.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

import bmesh

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hard_plate
import renders

# Places and radii of the joints of a shirt, the trunk first, and the joints that belong together.
JOINTS = [(0, 0, 0), (0, 0, 0.6), (0, 0, 1.2), (0, 0, 1.35), (0.5, 0, 1.15), (1, 0, 0.8), (-0.5, 0, 1.15), (-1, 0, 0.8)]
RADII = [(0.42, 0.3), (0.42, 0.3), (0.4, 0.26), (0.18, 0.18), (0.2, 0.18), (0.15, 0.15), (0.2, 0.18), (0.15, 0.15)]
BONES = [(0, 1), (1, 2), (2, 3), (2, 4), (4, 5), (2, 6), (6, 7)]
CUT_OFF = 0.12  # of what a shirt has at its hem, its collar and its cuffs
VASE = [(0, 0), (0.3, 0), (0.55, 0.4), (0.6, 0.7), (0.4, 1.1), (0.2, 1.4), (0.25, 1.7), (0.4, 1.8)]
BOTTLE = [(0, 0), (0.4, 0), (0.45, 0.05), (0.45, 1), (0.4, 1.2), (0.15, 1.5), (0.13, 1.9), (0.17, 1.92), (0.17, 2)]


def modified(body, kind, **given):
    """The body with a modifier applied."""
    bpy.context.view_layer.objects.active = body
    modifier = body.modifiers.new(kind, kind)
    for name, value in given.items():
        setattr(modifier, name, value)
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    return body


def without(body, is_off):
    """The body without the faces whose middles are off."""
    edit = bmesh.new()
    edit.from_mesh(body.data)
    bmesh.ops.delete(edit, geom=[f for f in edit.faces if is_off(f.calc_center_median())], context="FACES")
    edit.to_mesh(body.data)
    edit.free()
    return body


def helmet():
    """A little more than half a sphere."""
    ball = hard_plate.added(bpy.ops.mesh.primitive_uv_sphere_add, segments=32, ring_count=16)
    return modified(modified(without(ball, lambda p: p.z < -0.2), "SOLIDIFY", thickness=0.08), "SUBSURF", levels=1)


def shirt():
    """A trunk with two sleeves."""
    mesh = bpy.data.meshes.new("shirt")
    mesh.from_pydata(JOINTS, BONES, [])
    body = bpy.data.objects.new("shirt", mesh)
    bpy.context.scene.collection.objects.link(body)
    body.modifiers.new("SKIN", "SKIN")
    mesh.skin_vertices[0].data[0].use_root = True
    for joint, radius in zip(mesh.skin_vertices[0].data, RADII, strict=True):
        joint.radius = radius
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.modifier_apply(modifier="SKIN")
    modified(body, "SUBSURF", levels=2)
    x, z = ([vertex.co[k] for vertex in mesh.vertices] for k in (0, 2))
    ends = max(x) - CUT_OFF, min(z) + CUT_OFF, max(z) - CUT_OFF
    without(body, lambda p: abs(p.x) > ends[0] or not ends[1] < p.z < ends[2])
    return modified(body, "SOLIDIFY", thickness=0.02)


def vase():
    """A profile turned about its axis, smoothed."""
    return modified(modified(hard_plate.turned(VASE), "SOLIDIFY", thickness=0.04), "SUBSURF", levels=1)


def bottle():
    """Another one, its edges rounded."""
    return hard_plate.bevelled(modified(hard_plate.turned(BOTTLE), "SOLIDIFY", thickness=0.03), 0.01)


def joined(parts):
    """Several bodies as one."""
    bpy.ops.object.select_all(action="DESELECT")
    for part in parts:
        part.select_set(True)
    bpy.context.view_layer.objects.active = parts[0]
    bpy.ops.object.join()
    bpy.ops.object.transform_apply()
    return parts[0]


def box(place, scale, width, levels=0):
    """A box with rounded edges, subdivided so many times."""
    body = modified(hard_plate.cube(*place, scale=scale), "BEVEL", width=width, segments=2)
    return modified(body, "SUBSURF", levels=levels) if levels else body


def chair():
    """A seat, its back and four legs."""
    legs = [box((x, y, 0.22), (0.05, 0.05, 0.25), 0.01) for x in (-0.42, 0.42) for y in (-0.42, 0.42)]
    return joined([box((0, 0, 0.5), (0.5, 0.5, 0.05), 0.02), box((0, 0.45, 0.95), (0.5, 0.04, 0.4), 0.02), *legs])


def sofa():
    """A seat, its back and two arms."""
    arms = [box((x, 0, 0.5), (0.15, 0.5, 0.35), 0.06, 2) for x in (-1, 1)]
    return joined([box((0, 0, 0.3), (1, 0.5, 0.2), 0.06, 2), box((0, 0.5, 0.6), (1, 0.15, 0.5), 0.06, 2), *arms])


BODIES = {"helmet": helmet, "shirt": shirt, "vase": vase, "bottle": bottle, "chair": chair, "sofa": sofa}
VIEWS = dict.fromkeys(BODIES, renders.View("Z", 30, 20)) | {"helmet": renders.View("Z", 5, 20)}

if __name__ == "__main__":
    hard_plate.draw(BODIES, VIEWS, "docs/pictures/walls.png")
