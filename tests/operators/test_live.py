"""Live balance: the UVs follow the slider and the pins; Esc gives every bit back."""

from __future__ import annotations

import types

import bpy

import bmesh
import numpy as np
import pytest
import scenes


@pytest.fixture
def slider(package):
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    yield properties
    properties.property_unset("balance")
    assert package("session.following").current is None


@pytest.fixture(params=["OBJECT", "EDIT"])
def patch(request):
    obj = scenes.bump(12, 10)
    scenes.set_uv(obj, scenes.seen_from_above(obj) * [1.0, 0.6])
    if request.param == "EDIT":
        scenes.edit(obj)
    return obj


def event(kind, value="NOTHING"):
    return types.SimpleNamespace(type=kind, value=value)


def begin(**options):
    operator = scenes.stand_in("uv.omt_live", **{"pack": False, **options})
    assert operator.begin(bpy.context) == {"RUNNING_MODAL"}
    return operator


def tick(operator, count=1):
    for _ in range(count):
        state = operator.modal(bpy.context, event("TIMER"))
    return state


def test_the_uvs_follow_the_slider(patch, slider, package):
    operator, seen = begin(), []
    for balance in (0.0, 0.5, 1.0):
        slider.balance = balance
        assert tick(operator, 30) == {"PASS_THROUGH"}
        seen.append(scenes.uv_of(patch))
    assert not (seen[0] == seen[1]).all() and not (seen[1] == seen[2]).all()
    assert operator.modal(bpy.context, event("RET", "PRESS")) == {"FINISHED"}
    assert (scenes.uv_of(patch) == seen[2]).all()


def test_figures_of_the_moment_are_of_these_objects_and_of_this_moment(patch, slider, package):
    state = package("session.last_run").state
    operator, told = begin(), []
    for balance in (0.0, 1.0):
        slider.balance = balance
        tick(operator, 40)
        operator._show_now(bpy.context, package("session.following").current)
        rows = dict(state.summary.rows)
        told.append([float(rows[key].split()[0]) for key in ("Area error", "Shear")])
        assert state.summary.objects == (patch.name,) and state.summary.beyond <= set(rows)
        assert not state.outdated and not state.marks
    # Areas get worse along the slider, and shear better.
    assert told[0][0] < told[1][0] and told[0][1] > told[1][1]
    operator.modal(bpy.context, event("ESC", "PRESS"))


@pytest.mark.parametrize("tile", [1001, 1010, 1013, 1100])
def test_what_is_accepted_is_packed_into_the_tile_of_the_last_unwrap(patch, slider, tile):
    operator, before = begin(pack=True), slider.tile
    slider.tile, slider.balance = tile, 0.7
    try:
        tick(operator, 3)
        assert operator.modal(bpy.context, event("RET", "PRESS")) == {"FINISHED"}
    finally:
        slider.tile = before
    corner = divmod(tile - 1001, 10)[::-1]
    uv = scenes.uv_of(patch)
    assert (np.floor((uv.min(axis=0) + uv.max(axis=0)) / 2) == corner).all()
    assert (uv >= corner).all() and (uv <= np.add(corner, 1)).all()


def test_escape_gives_every_bit_back(patch, slider):
    before = scenes.state(patch)
    operator = begin()
    slider.balance = 0.7
    tick(operator, 3)
    assert scenes.state(patch) != before
    assert operator.modal(bpy.context, event("ESC", "PRESS")) == {"CANCELLED"}
    assert scenes.state(patch) == before


def test_a_second_click_ends_it(patch, slider, package):
    operator = begin()
    again = scenes.stand_in("uv.omt_live")
    assert again.invoke(bpy.context, event("LEFTMOUSE")) == {"CANCELLED"}
    assert tick(operator) == {"FINISHED"}


def test_scripts_run_it_to_the_end(patch, slider):
    slider.balance = 0.5
    assert bpy.ops.uv.omt_live() == {"FINISHED"}
    first = scenes.uv_of(patch)
    bpy.ops.uv.omt_live()
    assert np.abs(scenes.uv_of(patch) - first).max() < 0.01


def test_a_dragged_pin_takes_the_island_along(slider):
    obj = scenes.bump(12, 10)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    pinned = scenes.pin(obj, [0, 12, 70])
    scenes.edit(obj)
    operator = begin()
    edit = bmesh.from_edit_mesh(obj.data)
    layer = edit.loops.layers.uv.active
    corners = [loop for face in edit.faces for loop in face.loops]
    moved = [loop for loop, is_pin in zip(corners, pinned, strict=True) if is_pin and loop.vert.index == 70]
    before = scenes.uv_of(obj)
    for loop in moved:
        loop[layer].uv = (loop[layer].uv[0] + 0.05, loop[layer].uv[1] + 0.03)
    tick(operator, 30)
    operator.modal(bpy.context, event("RET", "PRESS"))
    after = scenes.uv_of(obj)
    places = [i for i, loop in enumerate(corners) if loop in moved]
    np.testing.assert_allclose((after - before)[places], [[0.05, 0.03]] * len(moved), atol=1e-6)
    still = pinned & ~np.array([loop in moved for loop in corners])
    assert (after[still] == before[still]).all()
    scenes.leave_edit()
    assert (scenes.areas(obj)[1] > 0).all()


@pytest.mark.parametrize("kind", ["mode", "deleted", "changed"])
def test_a_mesh_that_changes_ends_it(kind, slider):
    obj = scenes.bump(8, 8)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    operator = begin()
    if kind == "mode":
        scenes.edit(obj)
    elif kind == "deleted":
        bpy.data.objects.remove(obj)
    else:
        obj.data.clear_geometry()
    assert tick(operator) == {"FINISHED"}
    assert "ended" in operator.reports[0][1]


def test_without_uvs_it_says_so(slider):
    scenes.bump()
    assert "Unwrap the mesh first" in scenes.error_of(bpy.ops.uv.omt_live)


def test_uvs_without_area_are_refused(slider):
    obj = scenes.bump()
    obj.data.uv_layers.new()
    obj.data.uv_layers[0].uv.foreach_set("vector", [0.0] * (2 * len(obj.data.loops)))
    assert "no area" in scenes.error_of(bpy.ops.uv.omt_live)


def test_another_operator_ends_it_and_its_uvs_are_kept(patch, slider, package):
    """Nothing of the other one is written over, and nothing of the session is lost."""
    operator = begin()
    slider.balance = 0.6
    tick(operator, 30)
    followed = scenes.uv_of(patch)
    assert bpy.ops.uv.omt_measure() == {"FINISHED"}
    assert package("session.following").current is None
    assert (scenes.uv_of(patch) == followed).all()
    assert operator.modal(bpy.context, event("TIMER")) == {"CANCELLED"}
    operator = begin()
    assert bpy.ops.uv.omt_unwrap(boundary="DISK") == {"FINISHED"}
    unwrapped = scenes.uv_of(patch)
    slider.balance = 0.1
    assert operator.modal(bpy.context, event("TIMER")) == {"CANCELLED"}
    assert (scenes.uv_of(patch) == unwrapped).all()


def test_uvs_that_somebody_else_writes_stay(patch, slider):
    operator = begin()
    tick(operator, 20)
    scenes.leave_edit()
    uv = scenes.seen_from_above(patch)[:, ::-1]
    if operator.modal(bpy.context, event("TIMER")) == {"FINISHED"}:
        return  # the mode was changed
    scenes.set_uv(patch, uv)
    slider.balance = 0.9
    assert tick(operator) == {"FINISHED"}
    assert "UVs were changed" in operator.reports[0][1]
    assert (scenes.uv_of(patch) == uv).all()


def test_blenders_operators_end_it_however_long_the_list_of_those_that_were_run(patch, slider, package):
    """The list is cut at the front: one more is not seen by its length."""
    operator, done = begin(), bpy.context.window_manager.operators
    followed = tick(operator, 20) and scenes.uv_of(patch)
    assert not operator._others_began(bpy.context)
    made = [types.SimpleNamespace(bl_idname="OBJECT_OT_shade_smooth", as_pointer=lambda k=k: k + 1) for k in range(32)]
    lists = types.SimpleNamespace(window_manager=types.SimpleNamespace(operators=made))
    operator._last = 31
    assert operator._others_began(lists) and not operator._others_began(lists)
    made.append(types.SimpleNamespace(bl_idname="TRANSFORM_OT_translate", as_pointer=lambda: 99))
    assert not operator._others_began(lists) and len(done) == len(bpy.context.window_manager.operators)
    operator._others_began = lambda _context: True
    slider.balance = 0.9
    assert tick(operator) == {"CANCELLED"} and (scenes.uv_of(patch) == followed).all()


def test_undo_goes_back_by_one_drag_and_ends_it(patch, slider, package):
    """To undo while it runs took the unwrap before it, too."""
    name, operator = patch.name, begin()
    seen = []
    for balance in (0.4, 0.9):
        slider.balance = balance
        tick(operator, 40)
        seen.append(scenes.uv_of(patch))
        assert operator.modal(bpy.context, event("LEFT_CTRL", "PRESS")) == {"PASS_THROUGH"}
        assert operator._unmarked
        assert operator.modal(bpy.context, event("LEFTMOUSE", "PRESS")) == {"PASS_THROUGH"}
        assert not operator._unmarked
    assert operator._marks == 2
    bpy.ops.ed.undo()
    assert tick(operator) == {"FINISHED"}
    assert (scenes.uv_of(bpy.data.objects[name]) == seen[0]).all()
    assert "undone" in operator.reports[0][1]


def test_figures_follow(patch, slider, package):
    operator, state, seen = begin(), package("session.last_run").state, []
    for balance in (0.0, 1.0):
        slider.balance = balance
        tick(operator, 30)
        operator._looked = 0.0
        operator._show_now(bpy.context, package("session.following").current)
        seen.append(dict(state.summary.rows))
    assert seen[0]["Area error"] != seen[1]["Area error"] and state.summary.title == "Live Balance"
    operator.modal(bpy.context, event("RET", "PRESS"))
    assert dict(state.summary.rows)["Area error"] == seen[1]["Area error"]


def test_the_figures_are_those_of_the_last_move(patch, slider, package):
    """Where all of it was over before the next look at the figures, too."""
    operator, state = begin(), package("session.last_run").state
    tick(operator, 30)
    slider.balance, operator._looked = 1.0, float("inf")
    tick(operator, 30)
    before, operator._looked = dict(state.summary.rows)["Area error"], 0.0
    tick(operator)
    assert dict(state.summary.rows)["Area error"] != before
    operator.modal(bpy.context, event("ESC", "PRESS"))


def test_it_is_packed_on_accept_and_not_on_cancel(patch, slider):
    operator = begin(pack=True)
    slider.balance = 0.3
    tick(operator, 20)
    assert operator.modal(bpy.context, event("RET", "PRESS")) == {"FINISHED"}
    uv = scenes.uv_of(patch)
    assert 0 <= uv.min() < 0.02 and 0.98 < uv.max() <= 1


@pytest.mark.parametrize("pins", ["HARD", "SOFT"])
@pytest.mark.parametrize("end", ["KEEP", "BACK"])
def test_buttons_end_it(patch, slider, end, pins):
    before = scenes.uv_of(patch)
    operator = begin(pins=pins)
    slider.balance = 0.8
    tick(operator, 10)
    moved = scenes.uv_of(patch)
    assert bpy.ops.uv.omt_live_end(end=end) == {"FINISHED"}
    slider.balance = 0.1
    assert tick(operator) == ({"FINISHED"} if end == "KEEP" else {"CANCELLED"})
    after = scenes.uv_of(patch)
    assert (after == before).all() if end == "BACK" else not (after == before).all()
    assert not (moved == before).all()
    assert not bpy.ops.uv.omt_live_end.poll()


def pinned_in_edit_mode(vertices):
    obj = scenes.bump(12, 10)
    scenes.set_uv(obj, scenes.seen_from_above(obj) * [1.0, 0.6])
    scenes.pin(obj, vertices)
    scenes.edit(obj)
    bpy.ops.mesh.select_all(action="DESELECT")
    edit = bmesh.from_edit_mesh(obj.data)
    edit.select_mode = {"VERT"}
    edit.verts.ensure_lookup_table()
    for vertex in vertices:
        edit.verts[vertex].select_set(True)
    bmesh.update_edit_mesh(obj.data)
    return obj, edit


def drag(edit, vertex, by):
    layer = edit.loops.layers.uv.active
    for loop in edit.verts[vertex].link_loops:
        loop[layer].uv = (loop[layer].uv[0] + by[0], loop[layer].uv[1] + by[1])


def test_a_selected_vertex_takes_its_island_and_a_single_pin_moves_it(slider):
    obj, edit = pinned_in_edit_mode([70])
    assert not any(face.select for face in edit.faces)
    operator = begin()
    tick(operator, 20)
    before = scenes.uv_of(obj)
    drag(edit, 70, (0.3, 0.2))
    tick(operator, 30)
    operator.modal(bpy.context, event("RET", "PRESS"))
    np.testing.assert_allclose(scenes.uv_of(obj) - before, [[0.3, 0.2]] * len(before), atol=2e-3)


def test_corners_stay_where_blender_drags_them(slider):
    """G in the UV editor keeps the addresses of what it drags, as a vector of UVs does that Python has."""
    obj, edit = pinned_in_edit_mode([70])
    operator = begin()
    tick(operator, 20)
    address = edit.verts[70].link_loops[0][edit.loops.layers.uv.active].uv
    before = address[:]
    # Nobody else has the mesh, and it is Blender that changes the UVs.
    del edit
    tick(operator, 3)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.uvs_rotate()
    seen = address[:]
    edit = bmesh.from_edit_mesh(obj.data)
    edit.verts.ensure_lookup_table()
    assert seen == edit.verts[70].link_loops[0][edit.loops.layers.uv.active].uv[:] != before
    operator.modal(bpy.context, event("ESC", "PRESS"))


@pytest.mark.parametrize("pins", ["HARD", "SOFT"])
def test_soft_pins_give_way_and_hard_ones_hold(slider, pins):
    obj, edit = pinned_in_edit_mode([0, 12])
    operator = begin(pins=pins)
    tick(operator, 20)
    before = scenes.uv_of(obj)
    drag(edit, 12, (0.4, 0.0))
    place = edit.verts[12].link_loops[0][edit.loops.layers.uv.active].uv[:]
    tick(operator, 60)
    # As Blender's drag does at its end, for the last time.
    layer = edit.loops.layers.uv.active
    for loop in edit.verts[12].link_loops:
        loop[layer].uv = place
    tick(operator, 5)
    operator.modal(bpy.context, event("RET", "PRESS"))
    after = scenes.uv_of(obj)
    scenes.leave_edit()
    at = {v: next(k for k, loop in enumerate(obj.data.loops) if loop.vertex_index == v) for v in (0, 12)}
    moved = np.abs(after - before).max(1)
    if pins == "HARD":
        assert np.abs(after[at[12]] - before[at[12]] - [0.4, 0]).max() < 1e-6 and moved[at[0]] == 0
    else:
        assert moved[at[0]] > 0.01 and moved[at[12]] < 0.39


@pytest.mark.parametrize("marks", [0, 1, 2])
def test_escape_is_a_step_of_undo_where_steps_were_made_on_the_way(patch, slider, marks):
    operator = begin()
    for k in range(marks):
        slider.balance = 0.3 + 0.3 * k
        tick(operator, 30)
        operator.modal(bpy.context, event("LEFTMOUSE", "PRESS"))
    assert operator._marks == marks
    assert operator.modal(bpy.context, event("ESC", "PRESS")) == ({"FINISHED"} if marks else {"CANCELLED"})
