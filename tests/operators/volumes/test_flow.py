"""object.omt_flow and uv.omt_flow: shape keys, meshes, handles of every kind, live drags, undo, and bad input."""

from __future__ import annotations

import math
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from bodies import icosphere
from mathutils import Vector

from omt_uv.solver.flows.enclosed_volume import component_volumes


def ball(levels=2, name="Ball", scale=(1, 1, 1), location=(0, 0, 0)):
    V, F = icosphere(levels)
    obj = scenes.add(V, F, name)
    obj.scale, obj.location = scale, location
    bpy.context.view_layer.update()
    return obj


def empty(name, location, rotation=(0, 0, 0), size=0.2):
    obj = bpy.data.objects.new(name, None)
    obj.location, obj.rotation_euler, obj.empty_display_size = location, rotation, size
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


def select_vertices(obj, chosen):
    flags = np.zeros(len(obj.data.vertices), bool)
    flags[chosen] = True
    obj.data.vertices.foreach_set("select", flags)
    obj.data.edges.foreach_set("select", np.zeros(len(obj.data.edges), bool))
    obj.data.polygons.foreach_set("select", np.zeros(len(obj.data.polygons), bool))


def positions(obj, key=None):
    data = obj.data.shape_keys.key_blocks[key].data if key else obj.data.vertices
    values = np.zeros(3 * len(data), np.float32)
    data.foreach_get("co", values)
    return values.reshape(-1, 3)


def triangles(obj):
    return np.array([p.vertices[:] for p in obj.data.polygons])


def top(obj):
    return int(positions(obj)[:, 2].argmax())


def test_selected_vertices_move_and_the_rest_flows_into_a_shape_key():
    obj = ball(scale=(2, 1, 1), location=(5, 0, 0))
    before, row = positions(obj).copy(), top(obj)
    select_vertices(obj, [row])
    assert bpy.ops.object.omt_flow(move=(0, 0, 0.4)) == {"FINISHED"}
    np.testing.assert_array_equal(positions(obj), before)
    after = positions(obj, "Flow")
    np.testing.assert_allclose(after[row], before[row] + [0, 0, 0.4], atol=1e-6)
    volumes = [component_volumes(x.astype(float), triangles(obj))[0][0] for x in (before, after)]
    assert abs(volumes[1] / volumes[0] - 1) < 1e-5
    assert obj.data.shape_keys.key_blocks["Flow"].value == 1


def test_undo_takes_it_back():
    obj = ball()
    select_vertices(obj, [top(obj)])
    name, before = obj.name, positions(obj).copy()
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.object.omt_flow(move=(0, 0, 0.4), result="MESH") == {"FINISHED"}
    assert np.abs(positions(obj) - before).max() > 0.1
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    np.testing.assert_array_equal(positions(bpy.data.objects[name]), before)


@pytest.mark.parametrize("count", [2, 3])
def test_frames_are_keyed_one_after_the_other(count):
    obj = ball()
    select_vertices(obj, [top(obj)])
    bpy.context.scene.frame_set(10)
    bpy.ops.object.omt_flow(move=(0, 0, 0.4), frames=count)
    names = [f"Flow {k + 1}" for k in range(count)]
    assert list(obj.data.shape_keys.key_blocks.keys()) == ["Basis", *names]
    for k in range(count):
        bpy.context.scene.frame_set(11 + k)
        values = [obj.data.shape_keys.key_blocks[name].value for name in names]
        np.testing.assert_allclose(values, np.eye(count)[k], atol=1e-6)
    bpy.context.scene.frame_set(10)
    assert not any(obj.data.shape_keys.key_blocks[name].value for name in names)
    # Between frames shapes change evenly, and the last one stays.
    bpy.context.scene.frame_set(11, subframe=0.25)
    values = [obj.data.shape_keys.key_blocks[name].value for name in names]
    np.testing.assert_allclose(values[:2], [0.75, 0.25], atol=1e-6)
    bpy.context.scene.frame_set(30)
    values = [obj.data.shape_keys.key_blocks[name].value for name in names]
    np.testing.assert_allclose(values, np.eye(count)[-1], atol=1e-6)


def test_a_mesh_with_shape_keys_moves_with_its_basis():
    obj = ball()
    obj.shape_key_add(name="Basis"), obj.shape_key_add(name="Other")
    row = top(obj)
    select_vertices(obj, [row])
    assert bpy.ops.object.omt_flow(move=(0, 0, 0.4), result="MESH") == {"FINISHED"}
    np.testing.assert_array_equal(positions(obj), positions(obj, "Basis"))
    assert positions(obj)[row, 2] == pytest.approx(1.4, abs=1e-5)


def test_empties_groups_and_hooks_take_their_surroundings_along():
    obj = ball()
    row = top(obj)
    empty("pull", (0, 0, 0.9)), empty("pull.to", (0, 0, 1.3), (0, 0, math.pi / 2))
    assert bpy.ops.object.omt_flow(handles="EMPTIES", result="MESH") == {"FINISHED"}
    assert positions(obj)[row, 2] > 1.2

    other = ball(name="Other")
    other.vertex_groups.new(name="tip").add([row], 1.0, "REPLACE")
    empty("tip", (0.1, 0, 1.3))
    scenes.select([other])
    assert bpy.ops.object.omt_flow(handles="GROUPS", result="MESH") == {"FINISHED"}
    np.testing.assert_allclose(positions(other)[row], [0.1, 0, 1.3], atol=1e-6)

    third = ball(name="Third")
    hook = empty("hook", (0, 0, 0))
    modifier = third.modifiers.new("Hook", "HOOK")
    modifier.object = hook
    modifier.vertex_indices_set([row])
    modifier.matrix_inverse = hook.matrix_world.inverted()
    hook.location = (0, 0.2, 0.3)
    bpy.context.view_layer.update()
    scenes.select([third])
    assert bpy.ops.object.omt_flow(handles="HOOKS", result="MESH") == {"FINISHED"}
    np.testing.assert_allclose(positions(third)[row], [0, 0.2, 1.3], atol=1e-6)


def test_several_objects_flow_in_one_field_and_a_group_stays():
    head, eye = ball(name="Head"), ball(1, "Eye", (0.2, 0.2, 0.2), (0, 0, 0.7))
    scenes.select([eye, head])
    low = np.flatnonzero(positions(head)[:, 2] < -0.5)
    head.vertex_groups.new(name="still").add(low.tolist(), 1.0, "REPLACE")
    before = positions(head).copy()
    select_vertices(head, [top(head)])
    select_vertices(eye, [])
    assert bpy.ops.object.omt_flow(move=(0.3, 0, 0.2), keep_group="still", result="MESH") == {"FINISHED"}
    assert positions(eye)[:, 0].mean() > 0.3
    np.testing.assert_array_equal(positions(head)[low], before[low])


def test_walls_hold():
    obj = ball()
    wall = ball(name="Wall")
    scenes.select([obj])
    obj.scale = (0.95, 0.95, 0.95)
    bpy.context.view_layer.update()
    side = int(positions(obj)[:, 0].argmax())
    select_vertices(obj, [side])
    for walls in ("BALL", "MESH"):
        assert bpy.ops.object.omt_flow(move=(0, 0.2, 0), walls=walls, wall_object="Wall") == {"FINISHED"}
        key = obj.data.shape_keys.key_blocks[-1].name
        assert np.linalg.norm(0.95 * positions(obj, key), axis=1).max() < 1.02
    assert "no object" in scenes.error_of(bpy.ops.object.omt_flow, move=(0, 0.2, 0), walls="BALL", wall_object="None")
    assert "no mesh" in scenes.error_of(
        bpy.ops.object.omt_flow, move=(0, 0.2, 0), walls="MESH", wall_object=empty("e", (0, 0, 0)).name
    )
    assert wall.name == "Wall"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"move": (0, 0, 0)}, "No handle moves"),
        ({"handles": "EMPTIES"}, "No object has a partner"),
        ({"handles": "GROUPS"}, "No vertex group has a goal"),
        ({"handles": "HOOKS"}, "no Hook modifier"),
        ({"move": (0, 0, 1), "keep_group": "none"}, "no vertex group 'none'"),
    ],
)
def test_what_cannot_flow_is_refused_and_nothing_changes(settings, words):
    obj = ball()
    before = positions(obj).copy()
    select_vertices(obj, [0])
    assert words in scenes.error_of(bpy.ops.object.omt_flow, **settings)
    np.testing.assert_array_equal(positions(obj), before)
    assert obj.data.shape_keys is None
    select_vertices(obj, [])
    assert "No vertex is selected" in scenes.error_of(bpy.ops.object.omt_flow, move=(0, 0, 1))
    obj.data.vertices[3].co.x = math.nan
    select_vertices(obj, [0])
    assert "not finite" in scenes.error_of(bpy.ops.object.omt_flow, move=(0, 0, 1))


def test_edit_mode_writes_the_mesh_and_shape_keys():
    obj = ball()
    row = top(obj)
    select_vertices(obj, [row])
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.object.omt_flow(move=(0, 0, 0.3), result="MESH") == {"FINISHED"}
    assert bpy.ops.object.omt_flow(move=(0, 0, 0.1), result="KEY") == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_allclose(positions(obj, "Flow")[row, 2], 1.4, atol=1e-5)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_drag_shows_about_what_is_written_and_leaves_no_trace(package, mode):
    obj = ball(3)
    select_vertices(obj, [top(obj)])
    before = positions(obj).copy()
    bpy.ops.object.mode_set(mode=mode)
    operator = scenes.stand_in("object.omt_flow")
    operator.begin_drag(bpy.context)
    drag, bodies = operator._drag, package("blender.volumes.bodies")
    assert drag.to(np.array([0.1, 0, 0.3])) and drag.to(np.array([0, 0, 0.4]))
    shown = bodies.read_positions(obj).copy()
    drag.restore()
    np.testing.assert_array_equal(bodies.read_positions(obj), before)
    operator.move = (0, 0, 0.4)
    _, job = operator.job(bpy.context)
    from omt_uv.pipelines.volumes.flow import flow_bodies
    from omt_uv.solver.progress import drain

    exact = drain(flow_bodies(job)).frames[-1][0]
    assert np.abs(shown - exact).max() < 5e-3
    assert drag.to(np.zeros(3))


def test_uvs_are_pushed_without_a_change_of_area_and_pins_stay():
    obj = scenes.bump(20, 20)
    bpy.ops.uv.omt_unwrap()
    before = scenes.uv_of(obj).copy()
    # Without this the corners count as pinned, or not, by version.
    assert bpy.ops.uv.omt_flow(start=(0.5, 0.5), move=(0.08, 0.0), radius=0.2) == {"FINISHED"}
    after = scenes.uv_of(obj)
    assert np.abs(after - before).max() > 0.05
    quads = [uv[np.array([p.loop_indices[:] for p in obj.data.polygons])] for uv in (before, after)]
    areas = [0.5 * np.cross(q[:, 2] - q[:, 0], q[:, 3] - q[:, 1]) for q in quads]
    np.testing.assert_allclose(areas[1], areas[0], rtol=0.08)
    assert abs(areas[1].sum() / areas[0].sum() - 1) < 0.01
    near = np.linalg.norm(after[[loop.index for loop in obj.data.loops]] - [0.55, 0.5], axis=1)
    vertex = obj.data.loops[int(near.argmin())].vertex_index
    pinned = scenes.pin(obj, {vertex}, obj.data.uv_layers.active.name)
    assert bpy.ops.uv.omt_flow(start=(0.5, 0.5), move=(0.05, 0.0), radius=0.2) == {"FINISHED"}
    again = scenes.uv_of(obj)
    np.testing.assert_array_equal(again[pinned], after[pinned])
    assert np.abs(again - after).max() > 0.02


def test_a_uv_drag_leaves_no_trace():
    obj = scenes.bump(10, 10)
    assert "no UVs" in scenes.error_of(bpy.ops.uv.omt_flow)
    bpy.ops.uv.omt_unwrap()
    before = scenes.uv_of(obj).copy()
    operator = scenes.stand_in("uv.omt_flow")
    operator.begin_drag(bpy.context)
    drag = operator._drag
    assert drag.to(np.array([0.5, 0.5]), np.array([0.6, 0.5]))
    assert np.abs(scenes.uv_of(obj) - before).max() > 0.05
    drag.restore()
    np.testing.assert_array_equal(scenes.uv_of(obj), before)


@pytest.mark.parametrize("name", ["object.omt_flow", "uv.omt_flow"])
def test_the_wheel_widens_and_narrows_the_reach_while_it_is_dragged(name, monkeypatch):
    obj = ball()
    select_vertices(obj, [top(obj)])
    if name == "uv.omt_flow":
        bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0)
    operator = scenes.stand_in(name)
    if name == "object.omt_flow":
        monkeypatch.setattr(type(operator), "_shift", lambda *_: Vector((0, 0, 0.1)), raising=False)
    operator.begin_drag(bpy.context)
    radii = [operator.radius]
    for kind in ("WHEELUPMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "WHEELDOWNMOUSE", "WHEELDOWNMOUSE"):
        event = SimpleNamespace(type=kind, value="PRESS", mouse_region_x=0, mouse_region_y=0)
        assert operator.modal(bpy.context, event) == {"RUNNING_MODAL"}
        radii.append(operator.radius)
    assert radii[0] < radii[1] < radii[2]
    np.testing.assert_allclose(radii[3:5], radii[1::-1], rtol=1e-6)
    assert radii[5] < radii[0]
    operator._drag.restore()


@pytest.mark.parametrize("editing", [False, True])
def test_faces_that_newly_meet_are_told_and_selected_outside_of_edit_mode(package, editing):
    """In Edit Mode the selection is what moves next."""
    one, two = scenes.bump(3, 3, name="One"), scenes.bump(3, 3, name="Two", offset=3.0)
    for obj in (one, two):
        for part in (obj.data.vertices, obj.data.edges, obj.data.polygons):
            part.foreach_set("select", [False] * len(part))
    scenes.select([one, two])
    if editing:
        bpy.ops.object.mode_set(mode="EDIT")
    told = []
    operator = SimpleNamespace(report=lambda kind, text: told.append((kind, text)))
    crossing = (np.zeros(0, int), np.array([1, 4]))
    package("operators.volumes.flow").OBJECT_OT_omt_flow._show_crossing(operator, bpy.context, [one, two], crossing)
    ((kind, text),) = told
    assert kind == {"WARNING"} and text.startswith("Two: Faces that newly pass through one another (2): 1, 4")
    if editing:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert [p.index for p in two.data.polygons if p.select] == ([] if editing else [1, 4])
    assert not any(p.select for p in one.data.polygons)
    assert editing or tuple(bpy.context.scene.tool_settings.mesh_select_mode) == (False, False, True)
