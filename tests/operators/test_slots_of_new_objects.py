"""A new object that is made of the faces of another has its slots of materials: as many, in the same order, each linked
as there."""

from __future__ import annotations

import bpy

import meshes
import pytest
import scenes

RUNS = {
    "remesh": ("object", "omt_remesh", {"target_vertices": 20}),
    "cells": ("mesh", "omt_partition", {"cells": 4, "relax": 0, "write": "MESH"}),
}
# Of every slot: what it is linked to, and whether it is empty.
SLOTS = {
    "none": (),
    "of the object": (("OBJECT", True), ("OBJECT", False)),
    "of both": (("DATA", False), ("OBJECT", False), ("DATA", True), ("OBJECT", False)),
}


def slots_of(obj):
    return [(slot.link, slot.material.name if slot.material else "") for slot in obj.material_slots]


@pytest.mark.parametrize("slots", SLOTS)
@pytest.mark.parametrize("run", RUNS)
def test_slots_are_those_of_the_object_that_it_was_made_of(package, run, slots):
    scenes.open_empty()
    V, F = meshes.icosphere(1)
    first, second = scenes.add(V, F, "First"), scenes.add(1.5 * V + [5, 0, 0], F, "Second")
    for k, (link, empty) in enumerate(SLOTS[slots]):
        first.data.materials.append(bpy.data.materials.new(f"of mesh {k}"))
        first.material_slots[k].link = link
        first.material_slots[k].material = None if empty else bpy.data.materials.new(f"{link} {k}")
    second.data.materials.append(bpy.data.materials.new("Second"))
    before = {obj.name: slots_of(obj) for obj in (first, second)}
    group, name, given = RUNS[run]
    assert getattr(getattr(bpy.ops, group), name)(**given) == {"FINISHED"}
    made = [obj for obj in bpy.data.objects if obj.type == "MESH" and obj.name not in before]
    assert len(made) == 2
    for obj in made:
        assert slots_of(obj) == before[obj.name.partition("_")[0]], obj.name
    assert {obj.name: slots_of(obj) for obj in (first, second)} == before
