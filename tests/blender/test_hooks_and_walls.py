"""Handles of flows in a scene: hooks, groups, empties and walls, each with what it leaves out."""

from __future__ import annotations

from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from mathutils import Euler, Matrix, Vector


@pytest.fixture
def handles(package):
    return package("blender.volumes.flow_handles")


def body_of(obj):
    bpy.context.view_layer.update()
    matrix = np.array(obj.matrix_world)
    places = np.array([v.co[:] for v in obj.data.vertices])
    return SimpleNamespace(positions=places @ matrix[:3, :3].T + matrix[:3, 3])


def empty(name, place, turn=(0, 0, 0), scale=1.0, size=1.0):
    obj = bpy.data.objects.new(name, None)
    obj.matrix_world = Matrix.LocRotScale(Vector(place), Euler(turn), Vector((scale,) * 3))
    obj.empty_display_size = size
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


@pytest.mark.parametrize("group", [None, "some", "none", "gone"])
@pytest.mark.parametrize("indices", [[], [1, 3]])
def test_hooks_move_their_vertices_as_their_object_has_gone(handles, group, indices):
    obj = scenes.cube()
    obj.location = (1, 2, 3)
    bpy.context.view_layer.update()
    target = empty("hook", (0, 0, 1), (0, 0, 0.5))
    modifier = obj.modifiers.new("Hook", "HOOK")
    modifier.object = target
    if indices:
        modifier.vertex_indices_set(indices)
    if group is not None:
        members = obj.vertex_groups.new(name="some")
        members.add([3, 5], 1.0, "REPLACE")
        obj.vertex_groups.new(name="none")
        modifier.vertex_group = group if group != "gone" else "some"
    modifier.matrix_inverse = target.matrix_world.inverted() @ obj.matrix_world
    target.matrix_world = Matrix.Translation((0.5, 0, 0)) @ target.matrix_world
    bpy.context.view_layer.update()
    # Others hold nothing: modifiers of another kind, and hooks without an object.
    obj.modifiers.new("Other", "SUBSURF")
    obj.modifiers.new("Nobody", "HOOK")
    body = body_of(obj)
    rows = sorted({*indices, *([3, 5] if group in ("some", "gone") else [])})
    found = handles._hooks([obj], [body])
    if not rows:
        assert found == []
        return
    ((number, handle),) = found
    assert number == 0 and handle.vertices.tolist() == rows and handle.name == "Hook"
    np.testing.assert_allclose(handle.start, body.positions[rows], atol=1e-6)
    np.testing.assert_allclose(handle.end, body.positions[rows] + [0.5, 0, 0], atol=1e-5)


@pytest.mark.parametrize("there", [(True, True), (True, False), (False, True), (False, False)])
def test_groups_go_where_the_objects_of_their_names_are(handles, there):
    obj = scenes.cube()
    group = obj.vertex_groups.new(name="limb")
    group.add([0, 1, 2], 1.0, "REPLACE")
    obj.vertex_groups.new(name="nobody")
    obj.vertex_groups.new(name="alone").add([4], 1.0, "REPLACE")
    first, goal = there
    if first:
        empty("limb", (0, 0, 2), (0, 0, 0.25))
    if goal:
        empty("limb.to", (3, 0, 2), (0, 0, 0.25 + np.pi / 2), scale=2.0)
    body = body_of(obj)
    found = handles._groups([obj], [body])
    if not first and not goal:
        assert found == []
        return
    ((number, handle),) = found
    start = body.positions[:3]
    assert number == 0 and handle.name == "limb" and np.allclose(handle.start, start)
    if first and goal:
        # As a rigid body: a quarter turn, and no scale.
        turned = (start - [0, 0, 2]) @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [3, 0, 2]
        np.testing.assert_allclose(handle.end, turned, atol=1e-5)
    else:
        middle = np.array([0.0, 0, 2] if first else [3.0, 0, 2])
        np.testing.assert_allclose(handle.end, start - start.mean(axis=0) + middle, atol=1e-5)


@pytest.mark.parametrize(("scale", "size"), [(1.0, 0.5), (2.0, 0.5), (-1.0, 0.25)])
def test_empties_hold_a_ball_and_others_a_point(handles, scale, size):
    empty("a", (1, 0, 0), (0, 0, 0.3), scale, size)
    empty("a.to", (1, 5, 0), (0, 0, 0.3))
    empty("b", (2, 0, 0))
    lamp = bpy.data.objects.new("c", bpy.data.lights.new("c", "POINT"))
    bpy.context.collection.objects.link(lamp)
    empty("c.to", (0, 0, 9))
    bpy.context.view_layer.update()
    held = {handle.name: handle for _, handle in handles._empties()}
    assert set(held) == {"a", "c"}
    ball = held["a"]
    # What is mirrored has no rotation that would be its own.
    moved = (ball.end - ball.start)[: 7 if scale > 0 else 1]
    assert len(ball.start) == len(ball.end) == 7 and np.allclose(moved, [0, 5, 0], atol=1e-5)
    far = np.linalg.norm(ball.start[1:] - ball.start[0], axis=1)
    assert far == pytest.approx(np.full(6, size * abs(scale)), abs=1e-5)
    assert held["c"].start.tolist() == [[0, 0, 0]] and held["c"].end.tolist() == [[0, 0, 9]]


def test_walls_are_balls_around_what_there_is_or_meshes(handles):
    assert handles.wall_of("free", "nothing") is None
    with pytest.raises(handles.SceneHandleError, match="no object"):
        handles.wall_of("ball", "nothing")
    ball = empty("ball", (1, 2, 3), scale=3.0, size=0.5)
    found = handles.wall_of("ball", ball.name)
    assert found.ball and found.reach == pytest.approx(1.5) and found.middle == pytest.approx([1, 2, 3])
    with pytest.raises(handles.SceneHandleError, match="no mesh with faces"):
        handles.wall_of("mesh", ball.name)
    points = scenes.add([(0, 0, 0), (2, 0, 0), (0, 2, 0)], [], "points")
    with pytest.raises(handles.SceneHandleError, match="no mesh with faces"):
        handles.wall_of("mesh", points.name)
