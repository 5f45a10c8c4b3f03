"""What was remeshed hides what it was made of; one click shows the other in the same place."""

from __future__ import annotations

import bpy

import pytest
import scenes


def shown():
    return [obj.name for obj in bpy.context.view_layer.objects if not obj.hide_get()]


def test_the_original_is_hidden_and_comes_back_by_undo():
    scenes.bump()
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.object.omt_remesh("EXEC_DEFAULT", True, target_vertices=60)
    assert shown() == ["Bump_remesh"]
    bpy.ops.ed.undo()
    assert shown() == ["Bump"]


def test_it_stays_where_that_is_asked_for():
    scenes.bump()
    bpy.ops.object.omt_remesh(target_vertices=60, hide_original=False)
    assert set(shown()) == {"Bump", "Bump_remesh"}


def test_levels_stand_in_a_collection_and_are_shown_in_turn():
    scenes.bump()
    bpy.ops.object.omt_remesh(target_vertices=80, levels=3)
    collection = bpy.data.collections["Bump LODs"]
    assert sorted(obj.name for obj in collection.objects) == ["Bump_LOD0", "Bump_LOD1", "Bump_LOD2"]
    assert bpy.context.view_layer.objects.active.name == "Bump_LOD0"
    counts = [len(bpy.data.objects[f"Bump_LOD{k}"].data.vertices) for k in range(3)]
    assert counts == sorted(counts, reverse=True)
    seen = []
    for _ in range(4):
        assert bpy.ops.object.omt_compare() == {"FINISHED"}
        (name,) = shown()
        seen.append(name)
        assert bpy.context.view_layer.objects.active.name == name
        # What is worked on next is what is seen.
        assert [obj.name for obj in bpy.context.view_layer.objects if obj.select_get()] == [name]
    assert seen == ["Bump_LOD1", "Bump_LOD2", "Bump", "Bump_LOD0"]


@pytest.mark.parametrize("away", [0, 2])
def test_what_is_in_no_collection_of_the_view_layer_is_left_out(away):
    scenes.bump()
    bpy.ops.object.omt_remesh(target_vertices=40, levels=2)
    names = ["Bump_LOD0", "Bump_LOD1", "Bump"]
    obj = bpy.data.objects[names[away]]
    for collection in list(obj.users_collection):
        collection.objects.unlink(obj)
    there = [name for name in names if name != obj.name]
    bpy.context.view_layer.objects.active = bpy.data.objects[there[0]]
    seen = []
    for _ in range(4):
        assert bpy.ops.object.omt_compare() == {"FINISHED"}
        seen += shown()
    assert seen == [there[1], there[0]] * 2


def test_nothing_to_compare_with_is_said():
    scenes.bump()
    assert "Remesh it first" in scenes.error_of(bpy.ops.object.omt_compare)


def test_of_two_that_were_remeshed_the_active_one_is_shown_with_its_own():
    first, second = scenes.bump(name="First"), scenes.bump(name="Second", offset=3.0)
    for obj in (first, second):
        scenes.select([obj])
        bpy.ops.object.omt_remesh(target_vertices=60, hide_original=False)
    for active, others in ((second, {"First", "First_remesh"}), (first, {"Second", "Second_remesh"})):
        for obj in bpy.context.view_layer.objects:
            obj.hide_set(False)
        scenes.select([first, second])
        bpy.context.view_layer.objects.active = active
        assert bpy.ops.object.omt_compare() == {"FINISHED"}
        assert set(shown()) == {f"{active.name}_remesh", *others}
    # A lamp that is active says nothing: what is selected does.
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.collection.objects.link(lamp)
    scenes.select([second])
    bpy.context.view_layer.objects.active = lamp
    assert bpy.ops.object.omt_compare() == {"FINISHED"}
    assert "Second_remesh" in shown() and "Second" not in shown()
