"""Bodies with all that a mesh may hold besides its shape, and their state with the layer that is written by itself."""

from __future__ import annotations

import bpy

import numpy as np
import scenes

LAYER = "UV map of mine"
# UVs of `bodies` by their names, once an unwrap has found them: it changes nothing else of these.
UVS: dict[str, np.ndarray] = {}


def body(name, segments, rings, at=0.0, squeeze=1.0):
    """A closed body that is nowhere like anywhere else, with two UV layers, a group, seams, creases and colours."""
    # Blender's own sphere has its faces in another order every time.
    turn, polar = np.arange(segments) * 2 * np.pi / segments, np.arange(1, rings) * np.pi / rings
    around = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    points = np.concatenate([p * around + [0, 0, q] for p, q in zip(np.sin(polar), np.cos(polar), strict=True)])
    k, last = np.arange(segments), segments * (rings - 2)
    top, bottom, following = len(points), len(points) + 1, (k + 1) % segments
    quads = [(a + i, a + segments + i, a + segments + j, a + j)
             for a in range(0, last, segments) for i, j in zip(k, following, strict=True)]  # fmt: skip
    tips = [(top, i, j) for i, j in zip(k, following, strict=True)]
    tips += [(bottom, last + j, last + i) for i, j in zip(k, following, strict=True)]
    obj = scenes.add([*points, (0, 0, 1), (0, 0, -1)], [*quads, *tips], name)
    obj.location.x = at
    obj.data.uv_layers.new(name="first")
    rough = np.random.default_rng(5).normal(1, 0.06, (len(obj.data.vertices), 3))
    for vertex, factor in zip(obj.data.vertices, rough, strict=True):
        x, y, z = factor * vertex.co
        vertex.co = (x * (1 + 0.2 * z), y * (1 + 0.15 * x), squeeze * z * (1 + 0.3 * x + 0.1 * y))
    weights = obj.vertex_groups.new(name="painted here")
    weights.add(list(range(segments)), 0.7, "REPLACE")
    obj.data.uv_layers.active = obj.data.uv_layers.new(name=LAYER)
    for k, edge in enumerate(obj.data.edges):
        edge.use_edge_sharp = k % 7 == 0
    crease = obj.data.attributes.new("crease_edge", "FLOAT", "EDGE")
    crease.data.foreach_set("value", np.linspace(0, 1, len(obj.data.edges)))
    mine = obj.data.attributes.new("of mine", "FLOAT", "FACE")
    mine.data.foreach_set("value", np.arange(len(obj.data.polygons), dtype=float))
    colour = obj.data.color_attributes.new("Colour", "BYTE_COLOR", "CORNER")
    colour.data.foreach_set("color", np.random.default_rng(0).random(4 * len(obj.data.loops)))
    return obj


def _made():
    found = [body("One of two", 7, 5), body("The other", 6, 6, 4.0, 1.6)]
    scenes.select(found)
    return found


def bodies():
    """Two different bodies, selected, with UVs."""
    found = _made()
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0) == {"FINISHED"}
    for obj in found:
        assert obj.data.uv_layers.active.name == LAYER
    return found


def state(obj):
    """`scenes.state` with the active layer under a name of its own, and what belongs to the object."""
    found = scenes.state(obj)
    found["UV"] = found.pop(obj.data.uv_layers.active.name)
    found["active"] = obj.data.uv_layers.active.name
    found["names"] = [group.name for group in obj.vertex_groups]
    found["sharp"] = [edge.use_edge_sharp for edge in obj.data.edges]
    found["matrix"] = [tuple(row) for row in obj.matrix_world]
    return found


def bodies_with_some_selected():
    """The same two, of which some vertices are selected; the UVs that they were given first are put there again."""
    found = _made() if UVS else bodies()
    for obj in found:
        scenes.set_uv(obj, UVS.setdefault(obj.name, scenes.uv_of(obj)), LAYER)
        for vertex in obj.data.vertices:
            vertex.select = vertex.index < 3
    bpy.context.view_layer.update()
    return found
