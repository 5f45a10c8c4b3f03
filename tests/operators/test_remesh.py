"""New meshes beside the old one: what they carry, how they are called, and that the old one keeps every bit."""

from __future__ import annotations

import math

import bpy

import numpy as np
import pytest
import scenes
from bodies import hourglass
from remesh_scenes import arrays, ball, dressed, fill, remesh, values


def test_a_new_object_beside_the_old_one():
    obj = ball()
    obj.location, obj.rotation_euler = (1, 2, 3), (0.3, 0.2, 0.1)
    other = bpy.data.collections.new("Other")
    bpy.context.scene.collection.children.link(other)
    other.objects.link(obj)
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=300)
    assert scenes.state(obj) == before
    assert new.name == "Ball_remesh"
    assert len(new.data.vertices) == 300
    assert set(new.users_collection) == set(obj.users_collection)
    assert new.matrix_basis == obj.matrix_basis
    assert bpy.context.view_layer.objects.active == new
    assert bpy.context.selected_objects == [new]
    co, faces = arrays(new)
    assert np.abs(np.linalg.norm(co, axis=1) - 1).max() < 0.06
    assert len(new.data.vertices) - len(new.data.edges) + len(faces) == 2
    assert not new.data.validate()


def test_the_panel_says_what_was_made(package):
    ball()
    (new,) = remesh(target_vertices=300)
    rows = dict(package("session.last_run").state.summary.rows)
    assert (int(rows["Vertices"]), int(rows["Triangles"])) == (len(new.data.vertices), len(new.data.polygons))
    assert 30 < float(rows["Angles, 99 %"].removeprefix("above ").removesuffix("°")) < 60


def test_faces_and_edges_are_counted_too():
    obj = ball()
    (new,) = remesh(count_of="FACES", target_faces=400)
    assert len(new.data.polygons) == 400
    scenes.select([obj])
    obj.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    (new,) = remesh(count_of="EDGE", edge_length=0.4)
    co, faces = arrays(new)
    edges = 2 * np.linalg.norm(co[faces] - co[faces[:, [1, 2, 0]]], axis=2)
    assert edges.mean() == pytest.approx(0.4, rel=0.05)


def test_everything_is_carried():
    obj = dressed()
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=700)
    assert scenes.state(obj) == before
    mesh = new.data
    co, faces = arrays(new)
    # A quad is two triangles, one of which the new vertex lies on; what is linear in the plane follows exactly.
    where = values(mesh, "where", "vector", 3)
    assert np.abs(where - co).max() < 0.02
    assert np.abs(values(mesh, "height") - where[:, 2]).max() < 1e-5
    assert np.abs(values(mesh, "tint", "color", 4)[:, :2] - where[:, :2]).max() < 1e-5
    assert np.abs(values(mesh, "paint", "color", 4)[:, :2] - where[faces.ravel()][:, :2]).max() < 0.02
    for name, expected in (("UVMap", where[:, :2]), ("Second", 1 - where[:, :2])):
        assert np.abs(scenes.uv_of(new, name) - expected[faces.ravel()]).max() < 1e-4
    assert mesh.uv_layers.active.name == "Second"
    assert [layer.name for layer in mesh.uv_layers if layer.active_render] == ["UVMap"]
    assert (mesh.attributes.active_color_name, mesh.attributes.default_color_name) == ("paint", "tint")
    source = np.array([v.co for v in obj.data.vertices])
    assert np.abs(source[values(mesh, "index").astype(int)] - where).max() < 0.15
    centre = where[faces].mean(axis=1)
    index = np.zeros(len(faces), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    # The border between the materials is kept, so every face is on one side of it.
    assert ((centre[:, 0] > 0.5) == index).all()
    assert [slot.material.name for slot in new.material_slots] == ["red", "blue"]
    assert all(p.use_smooth for p in mesh.polygons)
    assert "edge thing" not in mesh.attributes


def test_groups_and_shape_keys_are_carried():
    obj = dressed()
    (new,) = remesh(target_vertices=300)
    co, _ = arrays(new)
    where = values(new.data, "where", "vector", 3)
    assert [group.name for group in new.vertex_groups] == ["slope", "empty"]
    weights = np.array([sum(g.weight for g in v.groups if g.group == 0) for v in new.data.vertices])
    assert np.abs(weights - where[:, 0]).max() < 1e-5
    keys = new.data.shape_keys.key_blocks
    assert [key.name for key in keys] == ["Basis", "Up", "Wide"]
    assert keys["Wide"].relative_key == keys["Up"]
    for name, shift in (("Basis", (0, 0, 0)), ("Up", (0, 0, 1)), ("Wide", (1, 0, 0))):
        shape = np.zeros(co.size, np.float32)
        keys[name].data.foreach_get("co", shape)
        assert np.abs(shape.reshape(-1, 3) - co - np.array(shift) * where[:, :1]).max() < 1e-5
        assert keys[name].value == obj.data.shape_keys.key_blocks[name].value
    assert obj.data.shape_keys is not new.data.shape_keys


def write_places(obj, co):
    """At every corner of an object the place (n,3) of its vertex, as an attribute."""
    corner = np.array([loop.vertex_index for loop in obj.data.loops])
    fill(obj.data, "at", "FLOAT_VECTOR", "CORNER", co[corner].astype(np.float32), "vector")


def test_faces_that_look_the_other_way_are_turned_in_the_new_mesh_alone(capfd):
    obj = ball(rings=24, sectors=40)
    co = np.array([v.co for v in obj.data.vertices])
    for k in (5, 77, 200, 300):
        obj.data.polygons[k].flip()
    write_places(obj, co)
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=500)
    assert scenes.state(obj) == before
    assert "4 faces look to another side" in capfd.readouterr().out
    co, faces = arrays(new)
    volume = np.einsum("fj,fj->f", co[faces[:, 0]], np.cross(co[faces[:, 1]], co[faces[:, 2]]))
    assert (volume > 0).all()
    assert np.abs(values(new.data, "at", "vector", 3) - co[faces.ravel()]).max() < 0.02


def test_parts_that_are_joined_the_wrong_way_round_both_stay_outside(capfd):
    V, F = hourglass(20, 32)
    above = V[F][:, :, 2].mean(axis=1) > 0
    F[above] = F[above][:, ::-1]
    obj = scenes.add(V, F.tolist(), "Twisted")
    write_places(obj, V)
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=500)
    assert scenes.state(obj) == before
    assert "joined the wrong way round" in capfd.readouterr().out
    co, faces = arrays(new)
    middle = np.where(co[faces][:, :, 2].mean(axis=1) > 0, 0.5, -0.5)[:, None] * [0, 0, 1]
    a, b, c = (co[faces[:, k]] - middle for k in range(3))
    assert (np.einsum("fj,fj->f", a, np.cross(b, c)) > 0).mean() > 0.9
    assert np.abs(values(new.data, "at", "vector", 3) - co[faces.ravel()]).max() < 0.05


def test_attributes_can_be_left_out():
    dressed()
    (new,) = remesh(target_vertices=200, preserve_attributes=False)
    assert not new.data.uv_layers
    assert not new.vertex_groups
    assert new.data.shape_keys is None
    assert len(new.data.materials) == 2


def test_levels_make_a_series():
    obj = ball()
    before = scenes.state(obj)
    new = remesh(target_vertices=400, levels=3, ratio=0.5)
    assert sorted(o.name for o in new) == ["Ball_LOD0", "Ball_LOD1", "Ball_LOD2"]
    assert [len(bpy.data.objects[f"Ball_LOD{k}"].data.vertices) for k in range(3)] == [400, 200, 100]
    assert scenes.state(obj) == before


def test_a_scale_that_is_not_applied_is_seen():
    """Triangles are even in the world, where the object is three times as long, not in its own coordinates."""
    obj = ball(rings=24, sectors=40)
    obj.scale = (3, 1, 1)
    bpy.context.view_layer.update()
    (new,) = remesh(target_vertices=600)
    co, faces = arrays(new)
    assert np.abs(np.linalg.norm(co, axis=1) - 1).max() < 0.06
    edge = np.linalg.norm((co[faces] - co[faces[:, [1, 2, 0]]]) * [3, 1, 1], axis=2)
    own = np.linalg.norm(co[faces] - co[faces[:, [1, 2, 0]]], axis=2)
    assert edge.std() / edge.mean() < 0.2 < own.std() / own.mean()


def test_modifiers_are_applied_only_on_request():
    obj = ball()
    obj.modifiers.new("Long", "SIMPLE_DEFORM").deform_method = "STRETCH"
    obj.modifiers["Long"].factor = 1.0
    (plain,) = remesh(target_vertices=200)
    assert np.abs(np.linalg.norm(arrays(plain)[0], axis=1) - 1).max() < 0.1
    assert [m.name for m in plain.modifiers] == ["Long"]
    scenes.select([obj])
    (applied,) = remesh(target_vertices=200, use_modifiers=True)
    assert not applied.modifiers
    assert np.linalg.norm(arrays(applied)[0], axis=1).max() > 1.3


def test_a_painted_group_is_denser():
    obj = ball(rings=24, sectors=40)
    group = obj.vertex_groups.new(name="North")
    group.add([v.index for v in obj.data.vertices if v.co.z > 0], 1.0, "REPLACE")
    (new,) = remesh(target_vertices=1500, density="WEIGHTS", weight_group="North", weight_factor=4)
    z = arrays(new)[0][:, 2]
    # Away from the border, where the weight is neither 0 nor 1.
    assert (z > 0.3).sum() / (z < -0.3).sum() == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("arguments", [
    {"density": "CURVATURE", "amount": 2},
    {"density": "GAUSSIAN", "amount": 2},
    {"density": "SALIENCY", "weight_factor": 4},
    {"density": "ATTRIBUTE", "density_attribute": "fine"},
    {"density": "ATTRIBUTE", "density_attribute": "fine", "grading": 0.2},
])  # fmt: skip
def test_every_density_makes_some_place_denser(arguments):
    """A ball with a small bump at the top, where curvature, saliency and the attribute are large."""
    obj = ball(rings=24, sectors=40)
    co = np.array([v.co for v in obj.data.vertices])
    near = np.exp(-(((co - [0, 0, 1]) / 0.25) ** 2).sum(axis=1))
    obj.data.vertices.foreach_set("co", (co * (1 + 0.3 * near)[:, None]).ravel())
    fill(obj.data, "fine", "FLOAT", "POINT", (1 + 7 * near).astype(np.float32))
    (new,) = remesh(target_vertices=800, **arguments)
    co, faces = arrays(new)
    assert len(co) == 800
    p = co[faces]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    z = p[:, :, 2].mean(axis=1)
    assert area[z > 1].mean() < 0.8 * area[z < -0.8].mean()


def test_the_same_call_makes_the_same_mesh():
    obj = dressed()
    (first,) = remesh(target_vertices=200)
    scenes.select([obj])
    (second,) = remesh(target_vertices=200)
    one, two = scenes.state(first), scenes.state(second)
    assert one == two


def test_undo_takes_the_new_object_away():
    ball()
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.object.omt_remesh("EXEC_DEFAULT", True, target_vertices=100)
    assert "Ball_remesh" in bpy.data.objects
    bpy.ops.ed.undo()
    assert "Ball_remesh" not in bpy.data.objects
    assert "Ball" in bpy.data.objects


def no_faces():
    return scenes.add([(0, 0, 0), (1, 0, 0)], [], edges=[(0, 1)]), {}, "no faces"


def no_faces_but_uvs():
    obj, arguments, words = no_faces()
    obj.data.uv_layers.new(name="UVMap")
    return obj, arguments, words


def one_sided():
    """A Moebius strip."""
    t = 2 * np.pi * np.arange(24) / 24
    points = []
    for w in (-0.3, 0.3):
        r = 1 + w * np.cos(t / 2)
        points += np.stack([r * np.cos(t), r * np.sin(t), w * np.sin(t / 2)], axis=1).tolist()
    faces = [(i, i + 1, 24 + i + 1, 24 + i) for i in range(23)] + [(23, 24, 0, 47)]
    return scenes.add(points, faces), {}, "side"


def not_a_number():
    obj = ball()
    obj.data.vertices[7].co.x = math.nan
    return obj, {}, "not finite numbers"


def too_few():
    return dressed(), {"target_vertices": 4}, ""


def missing_group():
    return ball(), {"density": "WEIGHTS", "weight_group": "nowhere"}, "nowhere"


def missing_attribute():
    return ball(), {"density": "ATTRIBUTE", "density_attribute": "nothing"}, "nothing"


def flattened():
    obj = ball()
    obj.scale = (1, 1, 0)
    bpy.context.view_layer.update()
    return obj, {}, "scale"


@pytest.mark.parametrize(
    "make", [no_faces, no_faces_but_uvs, one_sided, not_a_number, too_few, missing_group, missing_attribute, flattened]
)
def test_bad_input_is_refused_by_name_and_nothing_changes(make):
    obj, arguments, words = make()
    before, objects, meshes = scenes.state(obj), set(bpy.data.objects), set(bpy.data.meshes)
    message = scenes.error_of(bpy.ops.object.omt_remesh, **{"target_vertices": 300, **arguments})
    assert words in message
    assert obj.name in message
    assert scenes.state(obj) == before
    assert (set(bpy.data.objects), set(bpy.data.meshes)) == (objects, meshes)


def test_much_finer_than_the_input_is_warned_of(capfd):
    scenes.cube()
    remesh(target_vertices=500, use_preserve_seams=False)
    assert "more than 50 times" in capfd.readouterr().out


def test_edit_mode_says_why_not():
    obj = ball()
    scenes.edit(obj)
    assert not bpy.ops.object.omt_remesh.poll()


@pytest.mark.parametrize("count", [150, 900])
def test_carried_uvs_have_no_fold_and_as_many_islands(count):
    """Closed, cut open by seams that zigzag over the faces, unwrapped, and remeshed coarser and finer."""
    obj = ball(rings=16, sectors=24)
    scenes.select([obj])
    bpy.ops.uv.omt_unwrap()
    space, area = scenes.areas(obj)
    (new,) = remesh(target_vertices=count)
    new_space, new_area = scenes.areas(new)
    assert (area > 0).all()
    assert (new_area > 0).all()
    # Texels per area stay what they were, which the source has even to a percent.
    density = new_area / new_space
    assert np.percentile(density, [5, 95]) == pytest.approx(area.sum() / space.sum(), rel=0.25)


@pytest.mark.parametrize("applied", [False, True])
def test_faces_that_are_refused_are_selected_unless_they_are_those_of_modifiers(applied):
    """What a modifier makes is nothing that could be selected, or mended there."""
    obj = scenes.add([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 1), (1, 0, 1), (2, 0, 1)], [(0, 1, 2), (3, 4, 5)])
    scenes.select([obj])
    for part in (obj.data.vertices, obj.data.edges, obj.data.polygons):
        part.foreach_set("select", [False] * len(part))
    with pytest.raises(RuntimeError, match="No face has an area"):
        bpy.ops.object.omt_remesh(target_vertices=40, use_modifiers=applied)
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    assert [p.select for p in obj.data.polygons] == [not applied] * 2
