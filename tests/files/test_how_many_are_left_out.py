"""What a format does not hold is counted: as many are told as there are of every kind, and none where there is none."""

from __future__ import annotations

import bpy

import pytest
import scenes

# How one of each kind of object is made.
OTHERS = {
    "rigs": [lambda: bpy.data.armatures.new("x")],
    "cameras": [lambda: bpy.data.cameras.new("x")],
    "lights": [lambda: bpy.data.lights.new("x", "SUN")],
    "empties": [lambda: None],
    "metaballs": [lambda: bpy.data.metaballs.new("x")],
    "hair curves": [lambda: bpy.data.hair_curves.new("x")],
    "lattices": [lambda: bpy.data.lattices.new("x")],
    "speakers": [lambda: bpy.data.speakers.new("x")],
    "volumes": [lambda: bpy.data.volumes.new("x")],
    "curves and texts": [lambda: bpy.data.curves.new("x", "CURVE"), lambda: bpy.data.curves.new("x", "FONT"),
                         lambda: bpy.data.curves.new("x", "SURFACE")],
}  # fmt: skip


def colours(obj):
    obj.data.color_attributes.new("One", "BYTE_COLOR", "CORNER")


def more_colours(obj):
    colours(obj)
    obj.data.color_attributes.new("Two", "FLOAT_COLOR", "CORNER")


def attributes(obj):
    for name, kind in (("a", "FLOAT"), ("b", "INT")):
        obj.data.attributes.new(name, kind, "FACE")


def seams(obj):
    obj.data.edges[0].use_seam = obj.data.edges[3].use_seam = True


def creases(obj):
    obj.data.attributes.new("crease_edge", "FLOAT", "EDGE")


# How a mesh comes to have each kind.
OF_MESHES = {
    "materials": lambda obj: obj.data.materials.append(bpy.data.materials.new("x")),
    "colours": colours,
    "colours beside the active ones": more_colours,
    "shape keys": lambda obj: (obj.shape_key_add(name="a"), obj.shape_key_add(name="b")),
    "weights": lambda obj: (obj.vertex_groups.new(name="a"), obj.vertex_groups.new(name="b")),
    "modifiers": lambda obj: (obj.modifiers.new("a", "SUBSURF"), obj.modifiers.new("b", "BEVEL")),
    "attributes": attributes,
    "seams": seams,
    "creases": creases,
    "UV maps beside the one written": lambda obj: [obj.data.uv_layers.new(name=name) for name in "abc"],
}  # fmt: skip


@pytest.mark.parametrize("count", [0, 1, 3])
@pytest.mark.parametrize("kind", [*OTHERS, *OF_MESHES, "animations"])
def test_as_many_as_there_are_are_told_for_every_format(package, kind, count):
    losses = package("files.losses")
    scenes.open_empty()
    objects = [scenes.bump(2, 2, name=f"Mesh {k}") for k in range(4)]
    for k in range(count):
        if kind == "animations":
            bpy.data.actions.new(f"Action {k}")
        elif kind in OTHERS:
            data = OTHERS[kind][k % len(OTHERS[kind])]()
            bpy.context.scene.collection.objects.link(bpy.data.objects.new(f"Other {k}", data))
        else:
            OF_MESHES[kind](objects[1 + k])
    for suffix, held in losses.HOLDS.items():
        told = " ".join(losses.losses(suffix, objects))
        assert (f"{kind} ({count})" in told) == (count > 0 and kind not in held), (suffix, told)
        assert count or f"{kind} (" not in told
        # What is not written is not left out of it.
        few = " ".join(losses.losses(suffix, objects[:2]))
        number = min(count, 1) if kind in OF_MESHES else count
        assert (f"{kind} ({number})" in few) == (number > 0 and kind not in held), (suffix, few)
