"""Handles of a scene move as their objects do, wherever these stand; walls are as large as what they are of."""

from __future__ import annotations

import math

import bpy

import numpy as np
import pytest
import scenes
from sphere_shapes import blob


@pytest.fixture
def found_of(package):
    """The handles that the scene has for some objects."""
    handles, bodies = package("blender.volumes.flow_handles"), package("blender.volumes.bodies")

    def found(kind, *objects, move=(0, 0, 0), rotate=(0, 0, 0)):
        bpy.context.view_layer.update()
        read = [bodies.read_body(obj) for obj in objects]
        return handles.scene_handles(kind, objects, read, move, rotate)

    return found


def body(name="Body", at=(3.0, -1.0, 0.5), scale=(1.5, 1.5, 1.5)):
    obj = scenes.add(*blob(1, seed=1), name)
    obj.location, obj.rotation_euler, obj.scale = at, (0.4, -0.3, 0.8), scale
    bpy.context.view_layer.update()
    return obj


def empty(name, at, turn=(0, 0, 0), size=0.2, scale=1.0):
    obj = bpy.data.objects.new(name, None)
    obj.location, obj.rotation_euler, obj.empty_display_size, obj.scale = at, turn, size, (scale,) * 3
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


def choose(obj, vertices):
    for part in (obj.data.vertices, obj.data.edges, obj.data.polygons):
        part.foreach_set("select", [part == obj.data.vertices and k in vertices for k in range(len(part))])


def motion_of(handle):
    """The rotation (3,3) and the shift (3,) of a handle, which moves rigidly."""
    a, b = handle.start - handle.start.mean(axis=0), handle.end - handle.end.mean(axis=0)
    np.testing.assert_allclose(
        np.linalg.norm(a[:, None] - a, axis=2), np.linalg.norm(b[:, None] - b, axis=2), atol=1e-5
    )
    u, _, v = np.linalg.svd(a.T @ b)
    turn = (u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v).T
    return turn, handle.end.mean(axis=0) - turn @ handle.start.mean(axis=0)


def test_selected_vertices_of_all_objects_turn_about_their_common_middle(found_of):
    one, other = body(), body("Other", (0, 2, 1))
    choose(one, {0, 3, 5}), choose(other, {1, 2})
    found = found_of("selected", one, other, move=(0.5, 0, 0), rotate=(0, 0, math.pi / 2))
    assert [k for k, _ in found] == [0, 1] and [h.vertices.tolist() for _, h in found] == [[0, 3, 5], [1, 2]]
    start, end = (np.concatenate([getattr(h, key) for _, h in found]) for key in ("start", "end"))
    np.testing.assert_allclose(end.mean(axis=0) - start.mean(axis=0), [0.5, 0, 0], atol=1e-6)
    off = start - start.mean(axis=0)
    np.testing.assert_allclose(end - end.mean(axis=0), off[:, [1, 0, 2]] * [-1, 1, 1], atol=1e-5)


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_an_empty_holds_a_ball_of_its_size_and_takes_it_to_its_partner(found_of, scale):
    obj = body()
    first = empty("pull", (1, 2, 3), (0.3, 0.2, 0.1), 0.25, scale)
    goal = empty("pull.to", (2, 2, 4), (0.5, -0.4, 1.0), 0.25, scale)
    ((k, handle),) = found_of("empties", obj)
    assert k == -1 and handle.vertices is None
    np.testing.assert_allclose(handle.start[0], first.location, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(handle.start[1:] - handle.start[0], axis=1), 0.25 * scale, atol=1e-6)
    turn, shift = motion_of(handle)
    expected = np.array(goal.matrix_world.to_3x3() @ first.matrix_world.to_3x3().inverted())
    np.testing.assert_allclose(turn, expected, atol=1e-5)
    np.testing.assert_allclose(turn @ np.array(first.location) + shift, goal.location, atol=1e-5)


def test_a_group_goes_as_one_object_to_another_or_with_its_middle_to_a_place(found_of):
    obj = body()
    obj.vertex_groups.new(name="tip").add([1, 4, 6, 9], 1.0, "REPLACE")
    obj.vertex_groups.new(name="low").add([2, 3], 1.0, "REPLACE")
    turn = (0.7, 0.1, -0.5)
    empty("tip", (1, 0, 0), turn), empty("tip.to", (1, 2, 0), turn), empty("low", (7, 7, 7))
    found = {handle.name: handle for _, handle in found_of("groups", obj)}
    # Both are turned alike: nothing turns.
    np.testing.assert_allclose(found["tip"].end - found["tip"].start, np.tile([0, 2, 0], (4, 1)), atol=1e-5)
    np.testing.assert_allclose(found["low"].end.mean(axis=0), [7, 7, 7], atol=1e-5)
    bpy.data.objects["tip.to"].rotation_euler = (0.7, 0.1, 0.9)
    again = {handle.name: handle for _, handle in found_of("groups", obj)}["tip"]
    first, goal = (bpy.data.objects[name].matrix_world for name in ("tip", "tip.to"))
    np.testing.assert_allclose(motion_of(again)[0], np.array((goal @ first.inverted()).to_3x3()), atol=1e-5)


def test_hooks_move_nothing_until_their_object_moves_and_then_as_it_does(found_of):
    obj = body()
    hook = empty("hook", (1, 1, 1), (0.2, 0.3, 0.4))
    modifier = obj.modifiers.new("Hook", "HOOK")
    modifier.object = hook
    modifier.vertex_indices_set([2, 5, 7])
    # As Blender does when vertices are hooked.
    modifier.matrix_inverse = hook.matrix_world.inverted() @ obj.matrix_world
    ((_, still),) = found_of("hooks", obj)
    np.testing.assert_allclose(still.end, still.start, atol=1e-5)
    hook.location = (1, 3, 1)
    ((_, moved),) = found_of("hooks", obj)
    np.testing.assert_allclose(moved.end, moved.start + [0, 2, 0], atol=1e-5)


def test_balls_hold_all_of_a_mesh_about_the_middle_of_its_box_and_empties_are_as_large_as_they_look(package):
    wall_of = package("blender.volumes.flow_handles").wall_of
    V, F = blob(1, seed=2)
    # Many more vertices at one end.
    W = np.concatenate([V, V * 0.1 + [V[:, 0].max() - 0.2, 0, 0], V * 0.05 + [V[:, 0].max() - 0.1, 0, 0]])
    dense = scenes.add(W, np.concatenate([F, F + len(V), F + 2 * len(V)]), "Dense")
    found = wall_of("ball", dense.name)
    np.testing.assert_allclose(found.middle, (W.max(axis=0) + W.min(axis=0)) / 2, atol=1e-5)
    assert found.reach == pytest.approx(np.linalg.norm(W - found.middle, axis=1).max(), rel=1e-5)
    large = wall_of("ball", empty("Large", (1, 2, 3), size=0.5, scale=4.0).name)
    assert large.reach == pytest.approx(2.0, rel=1e-6) and np.allclose(large.middle, (1, 2, 3))
    assert wall_of("free", "") is None


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (0.5, 3.0, 2.0), (-4.0, 1.0, 1.0)])
def test_a_wall_around_an_empty_is_as_large_as_it_is_drawn_at_most(package, scale):
    obj = empty("Wall", (1.0, 2.0, 3.0), (0.3, 0.2, 0.1), 0.25)
    obj.scale = scale
    bpy.context.view_layer.update()
    wall, radius = package("blender.volumes.flow_handles").wall_of("ball", "Wall"), 0.25 * max(map(abs, scale))
    assert np.allclose(np.linalg.norm(wall.points - [1.0, 2.0, 3.0], axis=1), radius, rtol=1e-5)
