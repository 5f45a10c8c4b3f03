"""Bodies in the space of the world: read and written back through any transform, in any mode, and keyed by frames."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes

TRANSFORMS = {"plain": (1, 1, 1), "scaled": (2, 0.5, 3), "mirrored": (-1, 2, 1), "twice": (-1, -2, 1)}


@pytest.fixture
def bodies(package):
    return package("blender.volumes.bodies")


@pytest.fixture(params=TRANSFORMS)
def cube(request):
    obj = scenes.cube()
    obj.scale, obj.rotation_euler, obj.location = TRANSFORMS[request.param], (0.3, -0.8, 1.2), (3, -2, 5)
    bpy.context.view_layer.update()
    return obj


def world(obj, points=None):
    matrix = np.array(obj.matrix_world)
    points = np.array([v.co[:] for v in obj.data.vertices]) if points is None else points
    return points @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_body_is_where_it_is_in_the_world_and_looks_outside(cube, bodies, mode):
    cube.vertex_groups.new(name="half").add([0, 1], 0.5, "REPLACE")
    cube.vertex_groups["half"].add([2], 0.49, "REPLACE")
    expected = world(cube)
    bpy.ops.object.mode_set(mode=mode)
    found, plain = bodies.read_body(cube, "half"), bodies.read_body(cube)
    np.testing.assert_allclose(found.positions, expected, atol=1e-5)
    assert found.name == cube.name and plain.stays is None
    # From half of the weight on.
    assert np.flatnonzero(found.stays).tolist() == [0, 1]
    a, b, c = (found.positions[found.triangles[:, k]] - found.positions.mean(axis=0) for k in range(3))
    assert (np.einsum("ij,ij->i", a, np.cross(b, c)) > 0).all() and len(found.triangles) == 12
    assert sorted(found.polygons) == sorted(list(range(6)) * 2)
    np.testing.assert_allclose(bodies.read_positions(cube), [v.co[:] for v in cube.data.vertices], atol=1e-6)
    assert len(bpy.data.meshes) == 1


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("some", [False, True])
@pytest.mark.parametrize("keys", [False, True])
def test_positions_in_the_world_are_written_and_what_does_not_move_keeps_its_bits(cube, bodies, mode, some, keys):
    if keys:
        cube.shape_key_add(name="Basis", from_mix=False)
    before, old = bodies.read_positions(cube).copy(), world(cube)
    goal = old + np.random.default_rng(0).normal(0, 0.2, old.shape)
    moved = np.arange(8) % 3 == 0 if some else None
    bpy.ops.object.mode_set(mode=mode)
    bodies.write_positions(cube, goal, moved)
    after = bodies.read_positions(cube)
    which = np.ones(8, bool) if moved is None else moved
    np.testing.assert_allclose(world(cube, after)[which], goal[which], atol=1e-5)
    assert (after[~which] == before[~which]).all() and (after[which] != before[which]).any(axis=1).all()
    bodies.set_positions(cube, before)
    assert (bodies.read_positions(cube) == before).all()
    bodies.write_positions(cube, goal, moved)
    bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_array_equal([v.co[:] for v in cube.data.vertices], after)
    if keys and mode == "OBJECT":
        np.testing.assert_array_equal([p.co[:] for p in cube.data.shape_keys.reference_key.data], after)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("keyed", [False, True])
def test_frames_are_shape_keys_each_the_shape_at_its_time(cube, bodies, mode, count, keyed):
    frames = [world(cube) + 0.1 * (k + 1) * np.arange(24).reshape(8, 3) for k in range(count)]
    base = bodies.read_positions(cube).copy()
    bpy.ops.object.mode_set(mode=mode)
    names = bodies.write_frames(cube, frames, 10, keyed)
    assert cube.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    blocks = cube.data.shape_keys.key_blocks
    assert names == ([bodies.KEY] if count == 1 else [f"{bodies.KEY} {k + 1}" for k in range(count)])
    assert [block.name for block in blocks] == [bodies.BASIS, *names]
    np.testing.assert_array_equal([p.co[:] for p in blocks[0].data], base)
    for name, frame in zip(names, frames, strict=True):
        np.testing.assert_allclose(world(cube, np.array([p.co[:] for p in blocks[name].data])), frame, atol=1e-4)
    assert cube.active_shape_key.name == names[-1]
    if not keyed:
        assert [blocks[name].value for name in names] == [0.0] * (count - 1) + [1.0]
        assert cube.data.shape_keys.animation_data is None
        return
    # One at a time: up from its frame to the next, down to the one after, the last one stays.
    for time, expected in ((10, [0, 0, 0]), (10.5, [0.5, 0, 0]), (11, [1, 0, 0]), (11.25, [0.75, 0.25, 0]),
                           (12, [0, 1, 0]), (13, [0, 0, 1]), (20, [0, 0, 1])):  # fmt: skip
        bpy.context.scene.frame_set(int(time), subframe=time % 1)
        own = [1.0 if time >= 11 else expected[0]] if count == 1 else expected
        assert [blocks[name].value for name in names] == pytest.approx(own, abs=1e-5), time


def test_what_cannot_be_undone_or_is_kept_by_no_group_is_refused(package, bodies):
    obj, other = scenes.cube("One"), scenes.cube("Other")
    other.vertex_groups.new(name="still")
    bodies.check_keep([obj, other], "still")
    bodies.check_keep([obj], "")
    with pytest.raises(package("blender.vertex_groups").GroupError, match="One: There is no vertex group 'still'"):
        bodies.check_keep([obj], "still")
    assert bodies.members(obj, "still") is None
    obj.scale = (0, 1, 1)
    bpy.context.view_layer.update()
    with pytest.raises(package("solver.errors").NonFiniteError, match="cannot be undone"):
        bodies.read_body(obj)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("log", [-3.0, -1.0, -0.25, 0.0, 0.5, 1.0, 4.0])
def test_a_slice_is_red_where_volumes_grow_blue_where_they_shrink_and_no_colour_is_out_of_range(
    package, monkeypatch, log, axis
):
    """The cut is that of one tetrahedron on the axes; dilations are logarithms of two, given here."""
    tets = package("blender.volumes.tet_objects")
    points = np.vstack([np.zeros(3), np.eye(3)])
    volume = SimpleNamespace(points=points, positions=points, tets=np.array([[0, 1, 2, 3]]))
    cut = tets.plane_slice
    monkeypatch.setattr(tets, "plane_slice", lambda *given: replace(cut(*given), dilation=np.array([log])))
    obj = tets.slice_object(scenes.cube(), SimpleNamespace(map=volume), axis, 0.25)
    (values,) = {d.value for d in obj.data.attributes[tets.DILATION].data}
    assert values == log
    places = np.array([v.co[:] for v in obj.data.vertices])
    np.testing.assert_allclose(places[:, axis], 0.25, atol=1e-6)
    np.testing.assert_allclose(sorted(p.area for p in obj.data.polygons), [0.75**2 / 2], rtol=1e-5)
    t = min(1, max(-1, values))
    expected = (1, 1 - t, 1 - t, 1) if t >= 0 else (1 + t, 1 + t, 1, 1)
    colours = {d.color[:] for d in obj.data.color_attributes[f"{tets.DILATION} Colour"].data}
    np.testing.assert_allclose(list(colours), [expected], atol=1e-5)


@pytest.mark.parametrize("count", [1, 3])
def test_shells_and_points_of_a_body_are_as_many_as_asked_and_inside(package, count):
    tets = package("blender.volumes.tet_objects")
    points = np.vstack([np.zeros(3), np.eye(3)])
    volume = SimpleNamespace(points=points, positions=points, tets=np.array([[0, 1, 2, 3]]))
    found = SimpleNamespace(map=volume, ball=points - points.mean(axis=0))
    like = scenes.cube("Body")
    dots = tets.point_object(like, found, 5 * count, 0)
    assert len(dots.data.vertices) == 5 * count and not dots.data.polygons and dots.name == "Body Points"
    at = np.array([v.co[:] for v in dots.data.vertices])
    assert (at > -1e-6).all() and (at.sum(axis=1) < 1 + 1e-6).all()


def test_places_that_are_written_are_those_of_the_vertices_in_the_domain(package):
    """Not those in the ball, which are others where the domain is a body."""
    tets, obj = package("blender.volumes.tet_objects"), scenes.cube()
    rng = np.random.default_rng(4)
    found = SimpleNamespace(surface=rng.random((8, 3)), ball=rng.random((12, 3)), map=None)
    tets.write_places(obj, found)
    values = np.zeros(24, np.float32)
    obj.data.attributes[tets.PLACES].data.foreach_get("vector", values)
    np.testing.assert_allclose(values.reshape(8, 3), found.surface, rtol=1e-6)
