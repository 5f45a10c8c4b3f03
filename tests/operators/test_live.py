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
    assert package("operators.live").current is None


@pytest.fixture(params=["OBJECT", "EDIT"])
def patch(request):
    obj = scenes.bump(12, 10)
    scenes.set_uv(obj, scenes.seen_from_above(obj) * [1.0, 0.6])
    if request.param == "EDIT":
        scenes.edit(obj)
    return obj


def event(kind, value="NOTHING"):
    return types.SimpleNamespace(type=kind, value=value)


def begin():
    operator = scenes.stand_in("uv.omt_live")
    assert operator.start(bpy.context) == {"RUNNING_MODAL"}
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
