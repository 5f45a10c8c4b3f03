"""The list of further regions: edited, undone, saved with its object, and magnified as the text of a script is."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

WHOLE = {"left": np.s_[2:5], "middle": np.s_[7:10], "right": np.s_[12:15]}
GIVEN = {"source": "UV", "weight_group": "left", "factor": 2.0, "quality": "DRAFT"}


@pytest.fixture
def striped():
    """A bump with UVs and a group on each of three patches, the first of which is active."""
    obj = scenes.bump(16, 16)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    for name, part in WHOLE.items():
        columns = range(part.start, part.stop + 1)
        members = [17 * row + column for row in range(5, 12) for column in columns]
        obj.vertex_groups.new(name=name).add(members, 1.0, "REPLACE")
    obj.vertex_groups.active_index = 0
    return obj


def shares(obj):
    areas = np.abs(scenes.polygon_areas(obj)[1]).reshape(16, 16)
    return np.array([areas[5:11, part].sum() for part in WHOLE.values()]) / areas.sum()


def rows(obj):
    return [(row.group, row.factor) for row in obj.omt_uv_regions.rows]


def test_rows_are_added_removed_and_undone(striped):
    name = striped.name
    bpy.ops.ed.undo_push()
    for _ in range(2):
        assert bpy.ops.uv.omt_region_add("EXEC_DEFAULT", True) == {"FINISHED"}
    # The active group is the region itself.
    assert rows(striped) == [("middle", 4.0), ("right", 4.0)] and striped.omt_uv_regions.active == 1
    bpy.ops.ed.undo()
    assert rows(bpy.data.objects[name]) == [("middle", 4.0)]
    bpy.ops.ed.undo()
    assert rows(bpy.data.objects[name]) == []
    bpy.ops.ed.redo()
    striped = bpy.data.objects[name]
    assert bpy.ops.uv.omt_region_remove() == {"FINISHED"} and rows(striped) == []
    assert "no further regions" in scenes.error_of(bpy.ops.uv.omt_region_remove)


def test_the_list_gives_what_the_text_gives(striped):
    begin = scenes.uv_of(striped).copy()
    assert bpy.ops.uv.omt_magnify(**GIVEN, further="middle=0.5, right=1.5") == {"FINISHED"}
    by_text, before = scenes.uv_of(striped).copy(), shares(striped)
    scenes.set_uv(striped, begin)
    for factor in (0.5, 1.5):
        bpy.ops.uv.omt_region_add()
        striped.omt_uv_regions.rows[-1].factor = factor
    assert bpy.ops.uv.omt_magnify(**GIVEN) == {"FINISHED"}
    assert np.array_equal(scenes.uv_of(striped), by_text)
    scenes.set_uv(striped, begin)
    # A text is in place of the list, and is not kept for the next click.
    assert bpy.ops.uv.omt_magnify(**GIVEN, further="right=0.5") == {"FINISHED"}
    assert shares(striped)[2] < 0.8 * before[2]
    assert bpy.context.window_manager.operator_properties_last("uv.omt_magnify").further == ""


def test_rows_that_are_no_regions_are_refused_by_name(striped):
    bpy.ops.uv.omt_region_add()
    begin = scenes.state(striped)
    row = striped.omt_uv_regions.rows[0]
    for group, factor, text in (
        ("", 2.0, "Row 1 names no vertex group"),
        ("gone", 2.0, "gone"),
        ("left", 2.0, "is the region itself"),
        ("middle", 0.0, "factor"),
        ("middle", float("nan"), "factor"),
    ):
        row.group, row.factor = group, factor
        assert text in scenes.error_of(bpy.ops.uv.omt_magnify, **GIVEN) and scenes.state(striped) == begin
    row.group, row.factor = "middle", 2.0
    bpy.ops.uv.omt_region_add()
    striped.omt_uv_regions.rows[1].group = "middle"
    assert "twice" in scenes.error_of(bpy.ops.uv.omt_magnify, **GIVEN)


def test_the_list_is_saved_with_its_object(striped, tmp_path):
    bpy.ops.uv.omt_region_add()
    name = striped.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert rows(bpy.data.objects[name]) == [("middle", 4.0)]


def test_a_region_may_be_painted_on_one_of_several_objects(striped):
    """The others keep what they have; a region that is nowhere is refused."""
    other = scenes.bump(8, 8, name="Other", offset=3.0)
    scenes.set_uv(other, scenes.seen_from_above(other, 1.0, (2.0, 0.0)))
    other.vertex_groups.new(name="left").add(list(range(20, 25)), 1.0, "REPLACE")
    scenes.select([other, striped])
    before = shares(striped)
    assert bpy.ops.uv.omt_magnify(**GIVEN, further="middle=0.5") == {"FINISHED"}
    assert shares(striped)[1] < 0.8 * before[1]
    for obj in (other, striped):
        obj.vertex_groups.new(name="nowhere")
    assert "nowhere" in scenes.error_of(bpy.ops.uv.omt_magnify, **GIVEN, further="nowhere=2")


@pytest.mark.parametrize("chosen, gone, then", [(0, 0, 0), (1, 1, 1), (2, 2, 1), (7, 2, 1), (-1, 0, 0)])
def test_the_chosen_row_goes_and_the_next_one_is_chosen(striped, chosen, gone, then):
    """Whatever a script has chosen; rows may be of one group, and their factors tell them apart."""
    for k in range(3):
        bpy.ops.uv.omt_region_add()
        striped.omt_uv_regions.rows[k].factor = 2.0 + k
    striped.omt_uv_regions.active = chosen
    bpy.ops.uv.omt_region_remove()
    assert [factor - 2.0 for _, factor in rows(striped)] == [k for k in range(3) if k != gone]
    assert striped.omt_uv_regions.active == then


@pytest.mark.parametrize("operator", ["omt_region_add", "omt_region_remove"])
def test_what_is_no_mesh_has_no_list(operator):
    bpy.ops.object.empty_add()
    assert "is no mesh. Select one." in scenes.error_of(getattr(bpy.ops.uv, operator))
