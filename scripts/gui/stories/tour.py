"""What an artist does in the first two minutes: one click, a look, the redo panel, Esc, the UV editor."""

from __future__ import annotations

import math

import bpy


def tell(story):
    obj = head(80)
    yield from story.pause(1)
    view = story.area("VIEW_3D")
    view.spaces.active.show_region_ui = True
    yield from story.pause(1)
    yield from story.shoot("fresh")
    yield from story.click(*story.place("VIEW_3D", 10, 263))
    yield from story.shoot("tab")
    story.facts["object"] = obj.name


def head(count):
    """A bust of quads, open at the neck, selected."""
    points, faces = [], []
    for k in range(1, count + 1):
        for s in range(count):
            t, a = math.pi * 0.85 * k / count, 2 * math.pi * s / count
            points.append((math.sin(t) * math.cos(a), 0.8 * math.sin(t) * math.sin(a), 1.2 * math.cos(t)))
    for k in range(count - 1):
        for s in range(count):
            n = (s + 1) % count
            faces.append((k * count + s, (k + 1) * count + s, (k + 1) * count + n, k * count + n))
    faces.append(tuple(range(count)))
    for centre, amount, width in (((1, 0, 0), 0.5, 0.2), ((0, 1, 0.1), 0.4, 0.25), ((0, -1, 0.1), 0.4, 0.25)):
        for k, p in enumerate(points):
            d = sum((x - c) ** 2 for x, c in zip(p, centre, strict=True))
            factor = 1 + amount * math.exp(-d / (2 * width**2))
            points[k] = tuple(factor * x for x in p)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    mesh = bpy.data.meshes.new("Head")
    mesh.from_pydata(points, [], faces)
    obj = bpy.data.objects.new("Head", mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    return obj
