"""A mesh that several selected objects have is worked on once and counted once; new objects stand in every collection
of what they are made of; what is shown goes whole when it is hidden, whatever was there before."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
import whole_file
from operator_runs import lines_told

DRAFT = {"quality": "DRAFT"}
# Operators and what they are called with.
RUNS: list[tuple[str, dict]] = [
    ("uv.omt_unwrap", {**DRAFT, "max_shear": 0.0}),
    ("uv.omt_refine", DRAFT),
    ("uv.omt_magnify", {**DRAFT, "weight_group": "region", "source": "UV", "factor": 1.5}),
    ("uv.omt_seams", {"max_shear": 0.0}),
    ("uv.omt_density_set", {"density": 40.0}),
    ("uv.omt_density_get", {}),
    ("uv.omt_measure", {}),
    ("uv.omt_regions", {"kind": "GROUPS"}),
    ("uv.omt_worst", {"share": 20.0}),
    ("uv.omt_attributes", {}),
    ("uv.omt_overlay", {"show": "AREA"}),
    ("uv.omt_stack", {}),
    *(("uv.omt_remedy", {"action": action}) for action in ("MERGE", "DISSOLVE", "NORMALS")),
    ("object.omt_weights", {"kind": "GAUSSIAN", "weight_group": "new", "show": False}),
    *(("mesh.omt_partition", {"cells": 3, "relax": 0, "write": write}) for write in ("ATTRIBUTE", "SEAMS")),
]  # fmt: skip


def body(name: str, seed: int):
    """A curved patch with UVs and a region, on which two vertices lie on one another, an edge has no length, and a
    face looks the other way."""
    obj = scenes.bump(4 + seed, 3, 0.4 + 0.1 * seed, name, offset=3.0 * seed)
    obj.vertex_groups.new(name="region").add([0, 1, 5, 6], 1.0, "REPLACE")
    scenes.set_uv(obj, 0.3 * scenes.seen_from_above(obj) * [1, 0.5 + 0.2 * seed])
    return obj


def spoiled(obj) -> None:
    mesh = obj.data
    for first, second in ((0, 1), (5, 6)):
        mesh.vertices[first].co = mesh.vertices[second].co
    mesh.polygons[4].flip()
    mesh.update()


def told_and_left(package, capfd, name, given, shared: bool):
    """What an operator says of two meshes, of which one may be that of two objects more, and leaves of them."""
    scenes.open_empty()
    objects = [body("A", 0), body("B", 1)]
    if "remedy" in name:
        for obj in objects:
            spoiled(obj)
        package("session.last_run").forget()
    if shared:
        for k in range(2):
            obj = objects[0].copy()
            obj.name, obj.location.x = f"C{k}", 9.0 + k
            for group in list(obj.vertex_groups):
                obj.vertex_groups.remove(group) if group.name != "region" else None
            bpy.context.collection.objects.link(obj)
            objects.insert(0, obj)
    # The first ones are looked at first.
    scenes.select([*(obj for obj in objects if obj.name != "A"), bpy.data.objects["A"]])
    bpy.context.view_layer.update()
    lines = [line for line in lines_told(capfd, name, **given) if line.startswith(("Info", "Warn"))]
    if bpy.context.mode == "EDIT_MESH":
        scenes.leave_edit()
    meshes = [bpy.data.objects[letter] for letter in "AB"]
    return lines, [scenes.state(obj) for obj in meshes], [[p.select for p in obj.data.polygons] for obj in meshes]


@pytest.mark.parametrize(("name", "given"), RUNS, ids=[f"{name} {list(given.values())[-1:]}" for name, given in RUNS])
def test_a_mesh_of_several_objects_is_worked_on_once_and_counted_once(package, capfd, name, given):
    alone, shared = (told_and_left(package, capfd, name, given, several) for several in (False, True))
    assert shared[0] == alone[0]
    assert shared[1] == alone[1]
    assert name != "uv.omt_worst" or shared[2] == alone[2]


# What makes objects, of one or of two, and how they are called.
MAKERS: list[tuple[str, dict, bool]] = [
    ("mesh.omt_partition", {"cells": 3, "relax": 0, "write": "MESH"}, False),
    ("mesh.omt_partition", {"cells": 3, "relax": 0, "write": "POINTS"}, False),
    ("object.omt_remesh", {"target_vertices": 40}, False),
    ("object.omt_diagram", {"domain": "SQUARE"}, False),
    ("object.omt_landmarks_suggest", {"most": 3}, True),
]  # fmt: skip


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize(("name", "given", "pair"), MAKERS, ids=[f"{m[0]} {list(m[1].values())[-1]}" for m in MAKERS])
def test_new_objects_stand_in_every_collection_of_what_they_are_made_of(package, name, given, pair, count):
    objects = [scenes.bump(5, 4, 0.6 + 0.1 * k, "AB"[k], offset=3.0 * k) for k in range(1 + pair)]
    for k, obj in enumerate(objects):
        for j in range(count):
            collection = bpy.data.collections.new(f"{obj.name} {j}")
            bpy.context.scene.collection.children.link(collection)
            collection.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
        obj.location.z = k
    scenes.select(objects)
    if "landmarks" in name:
        place = package("operators.shapes.landmarks").place
        for obj in objects:
            place(tuple(objects), obj, "LM_", obj.matrix_world @ obj.data.vertices[7].co, False)
    else:
        module, verb = name.split(".")
        assert getattr(getattr(bpy.ops, module), verb)(**given) == {"FINISHED"}
    new = [obj for obj in bpy.data.objects if obj not in objects]
    assert new
    for obj in new:
        like = next(o for o in objects if (obj.parent == o if pair else obj.name.startswith(o.name)))
        assert {c.name for c in obj.users_collection} == {f"{like.name} {j}" for j in range(count)}


SHOWN = {"overlay": ("uv.omt_overlay", {"show": "SHEAR"}, "uv.omt_overlay", {"show": "NONE"}),
         "checker": ("uv.omt_checker", {"size": 256}, "uv.omt_checker_remove", {})}  # fmt: skip
# What is shown, how often, and the colours and materials that there are.
THERE = [
    *(("overlay", times, colours, ("red",)) for times in (1, 2) for colours in ((), ("Mine",), ("Mine", "Other"))),
    *(("checker", times, ("Mine",), slots) for times in (1, 2)
      for slots in ((), (None,), (None, "red"), ("red", None, "blue"))),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "times", "colours", "slots"), THERE, ids=str)
def test_what_is_shown_goes_whole_when_it_is_hidden(kind, times, colours, slots):
    """Of objects that have something and of one that has nothing, shown once or again and again."""
    objects = [body("A", 0), body("B", 1)]
    mesh = objects[0].data
    for name in colours:
        values = mesh.color_attributes.new(name, "BYTE_COLOR", "CORNER").data
        values.foreach_set("color", np.linspace(0, 1, 4 * len(mesh.loops)))
    for name in slots:
        mesh.materials.append(bpy.data.materials.new(name) if name else None)
    for face in mesh.polygons if slots else ():
        face.material_index = face.index % len(slots)
    mesh["mine"] = 1
    scenes.select(objects)
    before = whole_file.told()
    show, given, hide, nothing = SHOWN[kind]
    for _ in range(times):
        for name, arguments in [(show, given)] * times + [(hide, nothing)]:
            module, verb = name.split(".")
            assert getattr(getattr(bpy.ops, module), verb)(**arguments) == {"FINISHED"}
    found = whole_file.changed(before, whole_file.told())
    assert not found, found[:20]


@pytest.mark.parametrize("chosen", [(1,), (0, 2)], ids=str)
def test_modifiers_that_change_areas_are_told_of_every_object_that_has_some(capfd, chosen):
    objects = [body("ABC"[k], k) for k in range(3)]
    for k in chosen:
        objects[k].modifiers.new(f"Bent {k}", "SIMPLE_DEFORM")
    # One that nobody sees.
    hidden = objects[1].modifiers.new("Hidden", "SIMPLE_DEFORM")
    hidden.show_viewport = hidden.show_render = False
    scenes.select(objects)
    lines = lines_told(capfd, "uv.omt_unwrap", **DRAFT, max_shear=0.0, use_subdivision=True)
    told = sorted(line.partition(": ")[2] for line in lines if "modifiers" in line)
    assert [text.partition(":")[0] for text in told] == ["ABC"[k] for k in chosen]
    for k, text in zip(chosen, told, strict=True):
        assert f"Bent {k}" in text and "Hidden" not in text


@pytest.mark.parametrize(("hide", "sharers"), [(False, 0), (True, 2)])
def test_all_objects_that_new_ones_stand_in_for_are_hidden_or_none(hide, sharers):
    objects = [body("A", 0), body("B", 1)]
    for k in range(sharers):
        obj = objects[k % 2].copy()
        obj.name, obj.location.z = f"C{k}", 2.0 + k
        bpy.context.collection.objects.link(obj)
        objects.append(obj)
    beside = body("D", 2)
    scenes.select(objects)
    bpy.context.view_layer.update()
    assert bpy.ops.object.omt_remesh(target_vertices=30, hide_original=hide) == {"FINISHED"}
    assert [obj.hide_get() for obj in objects] == [hide] * len(objects) and not beside.hide_get()
    new = [obj for obj in bpy.data.objects if obj not in objects and obj != beside]
    assert len(new) == len(objects) and not any(obj.hide_get() for obj in new)
    assert set(bpy.context.selected_objects) == set(new)
    # Each knows the one that it stands in for.
    assert {obj.name: obj["omt_uv_source"].name for obj in new} == {f"{obj.name}_remesh": obj.name for obj in objects}


def test_uvs_of_a_new_mesh_are_looked_at_once_for_all_that_have_it(package, monkeypatch):
    objects, looked, levels = [body("A", 0), body("B", 1)], [], 2
    for _ in range(2):
        twin = objects[0].copy()
        bpy.context.collection.objects.link(twin)
        objects.append(twin)
    scenes.select(objects)
    module = package("blender.remesh_objects")
    monkeypatch.setattr(module, "carried_gate", lambda obj, made: looked.append((obj.name, list(made))) or [])
    assert bpy.ops.object.omt_remesh(target_vertices=40, levels=levels) == {"FINISHED"}
    assert len(looked) == 2
    for _, made in looked:
        meshes = [bpy.data.objects[name].data for name in made]
        assert len(set(meshes)) == len(meshes) == levels


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("active", range(4))
@pytest.mark.parametrize("meshes_of", ["aabb", "abab", "abba", "aaab", "baaa", "abaa"])
def test_of_objects_with_a_mesh_for_each_the_active_one_comes_first(package, mode, active, meshes_of):
    """Whichever share one: what is read, told or made of one object is that of the active one."""
    scenes.open_empty()
    first = {letter: body(letter, k) for k, letter in enumerate(sorted(set(meshes_of)))}
    objects = []
    for k, letter in enumerate(meshes_of):
        obj = bpy.data.objects.new(f"{k}{letter}", first[letter].data)
        bpy.context.collection.objects.link(obj)
        objects.append(obj)
    scenes.select([obj for obj in objects if obj != objects[active]] + [objects[active]])
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="EDIT")
    base = package("operators.base")
    one, every = base.mesh_objects(bpy.context), base.mesh_objects(bpy.context, shared=True)
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    assert one[0].data == objects[active].data and every[0].data == objects[active].data
    assert [obj.data for obj in one] == list({obj.data: 0 for obj in every}) and len(one) == 2
    if mode == "OBJECT":
        assert one[0] == every[0] == objects[active] and len(every) == 4
