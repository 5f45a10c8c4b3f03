"""Two objects that correspond by construction: a body with all that it can carry, and the same in other polygons."""

from __future__ import annotations

import bpy

import numpy as np
import scenes
from sphere_shapes import blob

LANDMARKS = 5


def body(subdivisions=3):
    """Vertices and triangles of a body without symmetry."""
    V, F = blob(subdivisions, seed=1)
    return V * [1.0, 1.3, 0.8] + 0.15 * V[:, [1]] ** 2 * [1, 0, 0.5], F


def corners_of(V):
    """Vertices at the ends of a body: its landmarks."""
    return [int(k) for k in (V[:, 0].argmax(), V[:, 0].argmin(), V[:, 1].argmax(), V[:, 1].argmin(), V[:, 2].argmax())]


def pair(landmarks=True, turned=True):
    """A dressed source, and a target of the same shape with quads, other numbers, and another place; and the source's
    vertex of every vertex of the target."""
    V, F = body()
    source = dressed(scenes.add(V, F, "Source"))
    name = np.random.default_rng(0).permutation(len(V))
    W, G = V[np.argsort(name)], name[F]
    target = scenes.add(W, joined(G), "Target")
    if turned:
        target.location, target.rotation_euler, target.scale = (4, 1, 0), (0.2, 0.4, 1.0), (2, 2, 2)
    bpy.context.view_layer.update()
    if landmarks:
        for k, vertex in enumerate(corners_of(V)):
            source.vertex_groups.new(name=f"LM_{k}").add([vertex], 1.0, "REPLACE")
            target.vertex_groups.new(name=f"LM_{k}").add([int(name[vertex])], 1.0, "REPLACE")
    choose(source, target)
    return source, target, np.argsort(name)


def joined(triangles):
    """Pairs of neighbouring triangles as quads, the others as they are."""
    from omt_uv.solver.mesh.topology import twins

    twin, used, polygons = twins(triangles), set(), []
    for t, row in enumerate(triangles.tolist()):
        other = twin[3 * t] // 3
        if t in used:
            continue
        if other > t and other not in used:
            used |= {t, int(other)}
            apex = triangles[other][(twin[3 * t] + 2) % 3]
            polygons.append([row[0], int(apex), row[1], row[2]])
        else:
            used.add(t)
            polygons.append(row)
    return polygons


def choose(source, target):
    """Select both, the target active."""
    scenes.select([source])
    target.select_set(True)
    bpy.context.view_layer.objects.active = target


def dressed(obj):
    """A UV map with a seam, two groups that sum to one, a colour, a shape key, face sets and two materials."""
    mesh = obj.data
    co = np.array([v.co for v in mesh.vertices])
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    centre = np.array([p.center for p in mesh.polygons])
    side = np.repeat(centre[:, 0] > 0, 3)
    uv = co[corner][:, 1:] * 0.1 * np.where(side, 1, -1)[:, None] * [1, -1] + np.where(side, 0.25, 0.75)[:, None]
    scenes.set_uv(obj, uv)
    weight = np.clip(0.5 + 0.3 * co[:, 2], 0, 1)
    for name, values in (("up", weight), ("down", 1 - weight)):
        group = obj.vertex_groups.new(name=name)
        for k, value in enumerate(values.tolist()):
            group.add([k], value, "REPLACE")
    colour = mesh.attributes.new("paint", "FLOAT_COLOR", "POINT")
    colour.data.foreach_set("color", np.column_stack([co * 0.2 + 0.5, np.ones(len(co))]).astype(np.float32).ravel())
    sets = mesh.attributes.new(".sculpt_face_set", "INT", "FACE")
    sets.data.foreach_set("value", (1 + (centre[:, 2] > 0)).astype(np.int32))
    for name in ("red", "blue"):
        mesh.materials.append(bpy.data.materials.get(name) or bpy.data.materials.new(name))
    mesh.polygons.foreach_set("material_index", (centre[:, 0] > 0).astype(np.int32))
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Grow")
    key.data.foreach_set("co", (1.2 * co).astype(np.float32).ravel())
    return obj
