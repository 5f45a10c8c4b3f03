"""The worst faces are found, by area, by shear and by folds."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np
import pytest
import scenes


def selected(obj):
    scenes.leave_edit()
    return {p.index for p in obj.data.polygons if p.select}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("figure", ["AREA", "SHEAR"])
def test_the_one_bad_face_is_selected(figure, mode):
    obj = scenes.bump(8, 6, height=0.0)
    uv = scenes.seen_from_above(obj)
    corners = list(obj.data.polygons[20].loop_indices)
    if figure == "AREA":
        uv[corners] *= 3
    else:
        uv[corners] *= [4, 0.25]
    scenes.set_uv(obj, uv)
    if mode == "EDIT":
        scenes.edit(obj, faces=[0])
    assert bpy.ops.uv.omt_worst(figure=figure, share=1.0) == {"FINISHED"}
    assert selected(obj) == {20}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_the_uv_editor_shows_the_same_selection(mode):
    """Where corners have a selection of their own, that of before is not left there."""
    obj = scenes.bump(8, 6, height=0.0)
    uv = scenes.seen_from_above(obj)
    uv[list(obj.data.polygons[20].loop_indices)] *= 3
    scenes.set_uv(obj, uv)
    scenes.edit(obj, faces=[0])
    edit = bmesh.from_edit_mesh(obj.data)
    if not hasattr(edit, "uv_select_sync_valid"):
        pytest.skip("corners have no selection of their own before Blender 5.0")
    edit.uv_select_sync_from_mesh()
    assert edit.uv_select_sync_valid
    if mode == "OBJECT":
        scenes.leave_edit()
    assert bpy.ops.uv.omt_worst(figure="AREA", share=1.0) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="EDIT")
    edit = bmesh.from_edit_mesh(obj.data)
    if not edit.uv_select_sync_valid:
        edit.uv_select_sync_from_mesh()
    assert [face.index for face in edit.faces if face.uv_select] == [20]


def test_folded_faces_are_selected_all_of_them():
    obj = scenes.bump(8, 6, height=0.0)
    uv = scenes.seen_from_above(obj)
    # Over the edge on the right of its faces.
    uv[[loop.index for loop in obj.data.loops if loop.vertex_index == 22]] += [1.5 / 8, 0]
    scenes.set_uv(obj, uv)
    bpy.ops.uv.omt_worst(figure="FOLDS", share=0.01)
    found = selected(obj)
    assert found and found <= {p.index for p in obj.data.polygons if 22 in p.vertices}


def test_the_share_bounds_what_is_selected_over_all_objects():
    objects = [scenes.bump(8, 6, height=h, name=f"B{h}") for h in (0.2, 1.0)]
    for obj in objects:
        scenes.set_uv(obj, scenes.seen_from_above(obj))
    scenes.select(objects)
    bpy.ops.uv.omt_worst(share=10.0)
    scenes.leave_edit()
    areas = [(p.area, p.select) for obj in objects for p in obj.data.polygons]
    share = sum(a for a, s in areas if s) / sum(a for a, _ in areas)
    assert 0.05 < share <= 0.1
    # The steeper one is worse.
    counts = [sum(p.select for p in obj.data.polygons) for obj in objects]
    assert counts[1] > counts[0]


def test_no_fold_is_said():
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    assert "No face is folded" in scenes.error_of(bpy.ops.uv.omt_worst, figure="FOLDS")
    assert bpy.context.mode == "OBJECT"


def test_without_uvs_it_says_so():
    scenes.bump()
    assert "Unwrap the mesh first" in scenes.error_of(bpy.ops.uv.omt_worst)


def test_polygons_of_several_readings_keep_their_numbers(package):
    objects = [scenes.bump(4, 3, name=name) for name in "AB"]
    for obj in objects:
        scenes.set_uv(obj, scenes.seen_from_above(obj))
    readings = [package("blender.mesh").read(obj) for obj in objects]
    found = package("pipelines.distortion").worst_faces(readings, "AREA", 1.0)
    assert [f.tolist() for f in found] == [list(range(12))] * 2
    assert all(f.dtype.kind == "i" for f in map(np.asarray, found))


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("before", ["vertex", "edge", "face"])
def test_faces_are_what_edit_mode_shows_and_nothing_else_is_selected(mode, before):
    """Faces that were selected as vertices would have all between them selected, too."""
    obj = scenes.bump(8, 6, height=0.0)
    uv = scenes.seen_from_above(obj)
    # Around one face in their midst.
    around = [11, 12, 13, 19, 21, 27, 28, 29]
    for face in around:
        uv[list(obj.data.polygons[face].loop_indices)] *= 3
    scenes.set_uv(obj, uv)
    tools = bpy.context.scene.tool_settings
    tools.mesh_select_mode = tuple(kind == before for kind in ("vertex", "edge", "face"))
    if mode == "EDIT":
        scenes.edit(obj, faces=[0])
        tools.mesh_select_mode = tuple(kind == before for kind in ("vertex", "edge", "face"))
    assert bpy.ops.uv.omt_worst(figure="AREA", share=100 * 8.5 / 48) == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH" and tuple(tools.mesh_select_mode) == (False, False, True)
    assert selected(obj) == set(around)


@pytest.mark.parametrize("beside", ["curve", "mesh", "nothing"])
def test_what_is_active_beside_the_meshes_is_not_edited(beside):
    """A curve that is active has an Edit Mode of its own, a mesh that is not selected faces of its own."""
    obj = scenes.bump(8, 6, height=0.0)
    uv = scenes.seen_from_above(obj)
    uv[list(obj.data.polygons[20].loop_indices)] *= 3
    scenes.set_uv(obj, uv)
    if beside == "curve":
        other = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
        bpy.context.collection.objects.link(other)
    else:
        other = scenes.bump(name="Other", offset=2.0) if beside == "mesh" else None
    scenes.select([obj] if beside == "mesh" else list(filter(None, [obj, other])))
    bpy.context.view_layer.objects.active = other
    assert bpy.ops.uv.omt_worst(figure="AREA", share=1.0) == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH" and list(bpy.context.objects_in_mode) == [obj]
    assert selected(obj) == {20}
