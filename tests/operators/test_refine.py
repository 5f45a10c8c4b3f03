"""uv.omt_refine and the command improve the UVs that are there and touch nothing else."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import bpy

import numpy as np
import pytest
import scenes
from uv_scenes import plain, ring

SHARED = Path(__file__).resolve().parents[3] / "shared"
JUDGE = Path(os.environ.get("OMT_UV_JUDGE", SHARED / "tools" / "judge_uv.py"))


def refine(**arguments):
    assert bpy.ops.uv.omt_refine(**arguments) == {"FINISHED"}


def error(obj):
    space, uv = scenes.polygon_areas(obj)
    return np.abs(uv / uv.sum() - space / space.sum()).sum()


def two_islands():
    """A bump whose faces in the upper half lie elsewhere in the UV map, without a seam; and these faces (f,) bool."""
    obj = plain()
    upper = np.arange(len(obj.data.polygons)) >= len(obj.data.polygons) // 2
    uv = scenes.uv_of(obj)
    uv[corners_of(obj, upper)] += [3, 0]
    scenes.set_uv(obj, uv)
    return obj, upper


def corners_of(obj, faces):
    corners = np.zeros(len(obj.data.loops), bool)
    for index in np.flatnonzero(faces):
        corners[list(obj.data.polygons[index].loop_indices)] = True
    return corners


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("make", [plain, ring])
def test_areas_become_right_in_place(make, mode):
    obj = make()
    before, area, start = error(obj), np.abs(scenes.areas(obj)[1]).sum(), scenes.uv_of(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    refine()
    if mode == "EDIT":
        scenes.leave_edit()
    assert error(obj) < 0.01 < 0.2 * before
    signed = scenes.areas(obj)[1]
    assert (signed * np.sign(signed.sum()) > 0).all()
    assert np.abs(signed).sum() == pytest.approx(area, rel=1e-5)
    assert np.abs(scenes.uv_of(obj) - start).max() < 0.1


def test_edit_mode_equals_object_mode():
    obj = plain()
    start = scenes.uv_of(obj)
    refine()
    expected = scenes.uv_of(obj)
    scenes.set_uv(obj, start)
    scenes.edit(obj)
    refine()
    scenes.leave_edit()
    assert (scenes.uv_of(obj) == expected).all()


def test_a_selected_face_refines_its_whole_island_and_no_other():
    obj, upper = two_islands()
    before = scenes.uv_of(obj)
    untouched = scenes.state(obj, leave_out={"UVMap"})
    scenes.edit(obj, faces=[int(np.flatnonzero(upper)[3])])
    refine()
    scenes.leave_edit()
    after, mine = scenes.uv_of(obj), corners_of(obj, upper)
    assert (after[~mine].tobytes()) == before[~mine].tobytes()
    assert (after[mine] != before[mine]).any(axis=1).mean() > 0.9
    assert scenes.state(obj, leave_out={"UVMap"}) == untouched


def test_islands_stay_islands(package):
    obj, _ = two_islands()
    refine()
    figures = package("pipelines.distortion").measure_readings([package("blender.mesh").read(obj)])
    assert figures.charts == 2
    assert figures.folds == 0
    assert figures.area_l1 < 0.01


def test_a_mirrored_island_stays_mirrored():
    obj = plain()
    scenes.set_uv(obj, scenes.uv_of(obj) * [-1, 1] + [1, 0])
    assert (scenes.areas(obj)[1] < 0).all()
    refine()
    assert (scenes.areas(obj)[1] < 0).all()
    assert error(obj) < 0.01


def test_several_objects_share_one_density():
    a, b = plain("A"), plain("B")
    b.scale = (3, 3, 3)
    scenes.select([a, b])
    total = sum(scenes.areas(obj)[1].sum() for obj in (a, b))
    refine()
    (space_a, uv_a), (space_b, uv_b) = scenes.areas(a), scenes.areas(b)
    assert uv_a.sum() / space_a.sum() == pytest.approx(uv_b.sum() / space_b.sum(), rel=1e-4)
    assert uv_a.sum() + uv_b.sum() == pytest.approx(total, rel=1e-5)


def test_packing_on_request():
    obj, _ = two_islands()
    refine(pack=True)
    uv = scenes.uv_of(obj)
    assert uv.min() >= 0 and uv.max() <= 1
    assert error(obj) < 0.01


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_pins_stay_to_the_bit(mode):
    obj = plain()
    pinned = scenes.pin(obj, {0, 8, 31, 54, 62})
    before = scenes.uv_of(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    refine()
    if mode == "EDIT":
        scenes.leave_edit()
    after = scenes.uv_of(obj)
    assert after[pinned].tobytes() == before[pinned].tobytes()
    assert (after[~pinned] != before[~pinned]).any()
    assert (scenes.areas(obj)[1] > 0).all()
    assert error(obj) < 0.02


def test_outlines_stay_on_request():
    obj = ring()
    outline = {
        v
        for e in obj.data.edges
        for v in e.vertices
        if sum(set(e.vertices) <= set(p.vertices) for p in obj.data.polygons) == 1
    }
    corners = np.array([loop.vertex_index in outline for loop in obj.data.loops])
    before, worse = scenes.uv_of(obj), error(obj)
    refine(keep_boundary=True)
    after = scenes.uv_of(obj)
    assert after[corners].tobytes() == before[corners].tobytes()
    assert error(obj) < 0.5 * worse


def test_balance_and_quality_count():
    obj = plain()
    start = scenes.uv_of(obj)
    errors = []
    for options in ({"quality": "EXACT"}, {}, {"quality": "DRAFT"}, {"balance": 0.7}, {"balance": 1.0}):
        scenes.set_uv(obj, start)
        refine(**options)
        errors.append(error(obj))
    exact, standard, draft, more, most = errors
    # Standard presses polygons no further than a quarter of what they may be off, and a draft may come out there.
    assert exact < min(standard, draft) and max(standard, draft) < more < most
    assert errors[0] < 1e-3 < errors[-1]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_undo_restores_everything(mode):
    obj = plain()
    name, before = obj.name, scenes.state(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.uv.omt_refine("EXEC_DEFAULT", True) == {"FINISHED"}
    assert scenes.state(bpy.data.objects[name]) != before
    bpy.ops.ed.undo()
    assert scenes.state(bpy.data.objects[name]) == before


# ---- what cannot be refined ---------------------------------------------------------------------------------


def all_zero(obj):
    scenes.set_uv(obj, np.zeros((len(obj.data.loops), 2)))
    return "no area"


def not_a_number(obj):
    uv = scenes.uv_of(obj)
    uv[5] = np.nan
    scenes.set_uv(obj, uv)
    return "not finite"


def folded_in_the_middle(obj):
    """One half lies exactly upon the other: neither side is the front."""
    uv = scenes.uv_of(obj)
    uv[:, 0] = np.abs(uv[:, 0] - np.median(uv[:, 0]))
    scenes.set_uv(obj, uv)
    return "folded beyond repair"


def crossed_pins(obj):
    uv = scenes.uv_of(obj)
    pinned = [0, 8, 54, 62, 30, 31, 39, 40]
    scenes.pin(obj, set(pinned))
    vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    a, b = uv[vertex == 30][0].copy(), uv[vertex == 40][0].copy()
    uv[vertex == 30], uv[vertex == 40] = b, a
    scenes.set_uv(obj, uv)
    return "without a fold"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("spoil", [all_zero, not_a_number, folded_in_the_middle, crossed_pins])
def test_refused_with_the_culprits_selected(spoil, mode):
    good, obj = plain("Good"), plain("Bad")
    message = spoil(obj)
    if mode == "EDIT":
        scenes.edit(good, obj)
    else:
        scenes.select([good, obj])
    before = scenes.state(obj), scenes.state(good)
    text = scenes.error_of(bpy.ops.uv.omt_refine)
    assert message in text
    assert "Bad" in text
    assert len(text.strip().splitlines()) == 1
    assert (scenes.state(obj), scenes.state(good)) == before
    if mode == "EDIT":
        obj.update_from_editmode()
        assert obj.data.total_vert_sel > 0


def test_without_uvs():
    obj = scenes.bump()
    assert "no UVs" in scenes.error_of(bpy.ops.uv.omt_refine)
    assert len(obj.data.uv_layers) == 0


def test_nothing_selected():
    obj = plain()
    scenes.edit(obj, faces=[])
    assert "No face is selected" in scenes.error_of(bpy.ops.uv.omt_refine)


def test_a_folded_island_is_straightened_and_said(capfd):
    obj = plain()
    vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    noise = 0.05 * np.random.default_rng(1).normal(size=(len(obj.data.vertices), 2))
    scenes.set_uv(obj, scenes.uv_of(obj) + noise[vertex])
    assert (scenes.areas(obj)[1] <= 0).any()
    refine()
    assert "straightened" in capfd.readouterr().out
    assert (scenes.areas(obj)[1] > 0).all()


# ---- pins of the unwrap ------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("vertices", [{31}, {0, 62}, {0, 8, 31, 54, 62}])
def test_unwrap_keeps_pins_to_the_bit_and_packs_the_others(mode, vertices):
    obj, other = plain(), scenes.bump(name="Other")
    scenes.set_uv(obj, scenes.uv_of(obj) + [2.3, -1])
    pinned, before = scenes.pin(obj, vertices), scenes.uv_of(obj)
    if mode == "EDIT":
        scenes.edit(obj, other)
    else:
        scenes.select([obj, other])
    assert bpy.ops.uv.omt_unwrap() == {"FINISHED"}
    if mode == "EDIT":
        scenes.leave_edit()
    after = scenes.uv_of(obj)
    assert after[pinned].tobytes() == before[pinned].tobytes()
    assert np.abs(after - before).max() < 0.3
    assert error(obj) < 0.02
    assert (scenes.areas(obj)[1] > 0).all()
    packed = scenes.uv_of(other)
    assert packed.min() >= 0 and packed.max() <= 1
    assert np.ptp(packed, axis=0).max() > 0.9
    assert (_pins(obj) == pinned).all()


def _pins(obj):
    values = np.zeros(len(obj.data.loops), bool)
    obj.data.attributes[".pn.UVMap"].data.foreach_get("value", values)
    return values


def test_pins_that_blender_set_are_seen():
    """Through BMesh, as the operator Pin does it, and not through the attribute."""
    import bmesh

    obj = plain()
    before = scenes.uv_of(obj)
    scenes.edit(obj)
    edit = bmesh.from_edit_mesh(obj.data)
    layer = edit.loops.layers.uv.active
    for vertex in {0, 8, 54, 62}:
        edit.verts.ensure_lookup_table()
        for loop in edit.verts[vertex].link_loops:
            loop[layer].pin_uv = True
    bmesh.update_edit_mesh(obj.data)
    assert bpy.ops.uv.omt_unwrap() == {"FINISHED"}
    scenes.leave_edit()
    pinned = np.array([loop.vertex_index in {0, 8, 54, 62} for loop in obj.data.loops])
    after = scenes.uv_of(obj)
    assert after[pinned].tobytes() == before[pinned].tobytes()
    assert (_pins(obj) == pinned).all()


def test_pins_outside_the_selection_do_not_count():
    obj = plain()
    scenes.pin(obj, {0})
    scenes.edit(obj, faces=[40, 41, 46, 47])
    assert bpy.ops.uv.omt_unwrap(boundary="SQUARE") == {"FINISHED"}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("boundary, spoil", [("FREE", crossed_pins), ("DISK", None), ("SQUARE", None)])
def test_unwrap_refuses_pins_it_cannot_keep(mode, boundary, spoil):
    obj = plain()
    if spoil:
        spoil(obj)
    else:
        scenes.pin(obj, {0, 8})
    if mode == "EDIT":
        scenes.edit(obj)
    before = scenes.state(obj)
    text = scenes.error_of(bpy.ops.uv.omt_unwrap, boundary=boundary)
    assert ("without a fold" if spoil else boundary.lower()) in text
    assert scenes.state(obj) == before
    assert bpy.context.scene.tool_settings.mesh_select_mode[0]


# ---- command ------------------------------------------------------------------------------------------------


# ---- judged -------------------------------------------------------------------------------------------------


def test_the_judge_finds_less_error_after_blender_unwrapped(tmp_path):
    if not JUDGE.is_file():
        pytest.skip(f"no judge at {JUDGE}: set OMT_UV_JUDGE to judge_uv.py")
    spec = importlib.util.spec_from_file_location("judge_uv", JUDGE)
    judge = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(judge)
    obj = scenes.bump(columns=20, rows=20, height=1.0)
    obj.data.uv_layers.new(name="UVMap")
    scenes.edit(obj)
    bpy.ops.uv.unwrap(method="ANGLE_BASED")
    scenes.leave_edit()
    found = []
    for name in ("before", "after"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{name}.blend"))
        path = str(tmp_path / f"{name}.blend")
        found.append(
            judge.judge(*judge.read_blend(path)) | {"polygon_l1": judge.polygon_error(*judge.read_polygons(path))}
        )
        if name == "before":
            scenes.select([bpy.data.objects["Bump"]])
            refine()
    before, after = found
    assert after["polygon_l1"] < 0.01 < before["polygon_l1"]
    assert (after["folds"], after["charts"], before["charts"]) == (0, 1, 1)
    assert after["overlap"] <= 1e-4
