"""What a mesh carries: written to a mesh of the same shape, it is read again."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import bpy

import numpy as np
import scenes
from remesh_scenes import dressed


def equal(a, b):
    if is_dataclass(a):
        return all(equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(equal, a, b))
    return a == b


def test_what_is_written_is_read(package):
    obj = dressed()
    read = package("blender.read_attributes").read_attributes
    names = tuple(group.name for group in obj.vertex_groups)
    first = read(obj.data, names)
    assert first.layers and names
    points = [tuple(v.co) for v in obj.data.vertices]
    bare = scenes.add(points, [tuple(p.vertices) for p in obj.data.polygons], "Bare")
    for material in obj.data.materials:
        bare.data.materials.append(material)
    package("blender.write_attributes").write_attributes(bare, first)
    second = read(bare.data, names)
    unlike = [f.name for f in fields(first) if not equal(getattr(first, f.name), getattr(second, f.name))]
    assert unlike == [], unlike
    assert bpy.context.mode == "OBJECT"
