"""A checker comes by one click and goes by another, and materials are what they were."""

from __future__ import annotations

import bpy

import pytest
import scenes


def with_uvs(name="Bump"):
    obj = scenes.bump(name=name)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    return obj


def shown(obj):
    return [slot.material.name if slot.material else None for slot in obj.material_slots]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("kind", ["COLOR_GRID", "UV_GRID"])
def test_materials_come_back(mode, kind):
    obj = with_uvs()
    for name in ("Skin", "Cloth"):
        obj.data.materials.append(bpy.data.materials.new(name))
    obj.data.materials.append(None)
    obj.material_slots[1].link = "OBJECT"
    obj.material_slots[1].material = bpy.data.materials["Skin"]
    before, indices = shown(obj), [p.material_index for p in obj.data.polygons]
    if mode == "EDIT":
        scenes.edit(obj)
    assert bpy.ops.uv.omt_checker(kind=kind, size=512) == {"FINISHED"}
    assert all(name.startswith("OMT UV Checker") for name in shown(obj))
    image = next(i for i in bpy.data.images if i.name.startswith("OMT UV Checker"))
    assert image.generated_type == kind and tuple(image.size) == (512, 512)
    # Another one in its place keeps what was kept.
    bpy.ops.uv.omt_checker(kind=kind, size=256)
    assert bpy.ops.uv.omt_checker_remove() == {"FINISHED"}
    scenes.leave_edit()
    assert shown(obj) == before == ["Skin", "Skin", None]
    assert [slot.link for slot in obj.material_slots] == ["DATA", "OBJECT", "DATA"]
    assert [p.material_index for p in obj.data.polygons] == indices
    assert not [m for m in (*bpy.data.materials, *bpy.data.images) if m.name.startswith("OMT UV")]
    assert not obj.keys() and not obj.data.keys()


def test_without_a_material_none_is_left():
    obj = with_uvs()
    bpy.ops.uv.omt_checker()
    assert len(obj.material_slots) == 1
    bpy.ops.uv.omt_checker_remove()
    assert not obj.material_slots


def test_what_is_edited_is_chosen_whether_it_is_selected_or_not():
    first, second = with_uvs("First"), with_uvs("Second")
    scenes.select([first, second])
    bpy.ops.uv.omt_checker()
    scenes.edit(first)
    first.select_set(False)
    assert bpy.ops.uv.omt_checker_remove() == {"FINISHED"}
    scenes.leave_edit()
    assert not first.material_slots and second.material_slots


def test_objects_that_share_a_mesh():
    first = with_uvs()
    first.data.materials.append(bpy.data.materials.new("Skin"))
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.collection.objects.link(second)
    scenes.select([first, second])
    bpy.ops.uv.omt_checker()
    assert shown(first) == shown(second)
    bpy.ops.uv.omt_checker_remove()
    assert shown(first) == shown(second) == ["Skin"]


def test_only_the_selected_ones_give_it_back_unless_none_has_it():
    first, second = with_uvs("A"), with_uvs("B")
    scenes.select([first, second])
    bpy.ops.uv.omt_checker()
    scenes.select([first])
    bpy.ops.uv.omt_checker_remove()
    assert not first.material_slots and second.material_slots
    bpy.ops.uv.omt_checker_remove()
    assert not second.material_slots


def test_kept_materials_survive_a_file(tmp_path):
    obj = with_uvs()
    obj.data.materials.append(bpy.data.materials.new("Skin"))
    bpy.ops.uv.omt_checker()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.uv.omt_checker_remove()
    assert shown(bpy.data.objects["Bump"]) == ["Skin"]


def test_without_uvs_it_says_so():
    scenes.bump()
    assert "Unwrap the mesh first" in scenes.error_of(bpy.ops.uv.omt_checker)


def test_textures_are_hidden_with_the_last_checker_only(package, monkeypatch):
    hidden = []
    monkeypatch.setattr(package("display.shading"), "hide_textures", hidden.append)
    objects = [with_uvs(name) for name in "ABC"]
    scenes.select(objects)
    bpy.ops.uv.omt_checker()
    for k, obj in enumerate(objects):
        scenes.select([obj])
        bpy.ops.uv.omt_checker_remove()
        assert len(hidden) == (k == 2)


@pytest.mark.parametrize("worn", [(), (0,), (0, 1), (0, 1, 2)], ids=str)
@pytest.mark.parametrize("selected", [(), (0,), (2,), (0, 1), (0, 2), (0, 1, 2)], ids=str)
def test_textures_are_shown_as_long_as_anybody_wears_a_checker(package, monkeypatch, worn, selected):
    """Selected or not; of those that wear one the selected ones lose it, or all, if none is selected."""
    objects = [scenes.bump(2, 2, name="ABC"[k], offset=2.0 * k) for k in range(3)]
    checker, hidden = package("blender.checker"), []
    for k in worn:
        checker.put(objects[k], "COLOR_GRID", 64)
    monkeypatch.setattr(package("operators.inspection.checker").shading, "hide_textures", hidden.append)
    scenes.select([objects[k] for k in selected])
    assert bpy.ops.uv.omt_checker_remove() == {"FINISHED"}
    left = [k for k in worn if checker.wears_one(objects[k])]
    lose = [k for k in worn if k in selected] or list(worn)
    assert left == [k for k in worn if k not in lose]
    assert bool(hidden) == (not left)
