"""What a new object has of the old one besides its shape: place, parent, shared and linked data, marks of edges."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from remesh_scenes import arrays, ball, dressed, fill, made, remesh, values


def cube_with_marks():
    """A cube whose top edges are sharp, creased, to be bevelled, and marked with an attribute."""
    obj = scenes.cube()
    mesh = obj.data
    top = np.array([all(mesh.vertices[v].co.z > 0 for v in edge.vertices) for edge in mesh.edges])
    mesh.edges.foreach_set("use_edge_sharp", top)
    fill(mesh, "crease_edge", "FLOAT", "EDGE", np.where(top, 0.5, 0).astype(np.float32))
    fill(mesh, "bevel_weight_edge", "FLOAT", "EDGE", np.where(top, 0.25, 0).astype(np.float32))
    fill(mesh, "top", "INT", "EDGE", np.where(top, 7, 0).astype(np.int32))
    fill(mesh, "way", "FLOAT_VECTOR", "EDGE", np.outer(top, [1, 2, 3]).astype(np.float32), "vector")
    fill(mesh, "everywhere", "FLOAT", "EDGE", np.ones(len(top), np.float32))
    return obj


def test_marks_and_attributes_of_edges_are_carried_along_lines_that_are_kept(capfd):
    obj = cube_with_marks()
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=400, use_preserve_sharp=True, sharp_angle=3.1)
    assert scenes.state(obj) == before
    mesh = new.data
    co, _ = arrays(new)
    z = co[np.array([edge.vertices[:] for edge in mesh.edges])][:, :, 2]
    ends = np.array([edge.vertices[:] for edge in mesh.edges])
    # The cube is that from 0 to 1; those of the top lie in one of its four sides.
    on_side = np.abs(np.concatenate([co[:, :2], 1 - co[:, :2]], axis=1)) < 1e-5
    top = (np.abs(z - 1) < 1e-5).all(axis=1) & on_side[ends].all(axis=1).any(axis=1)
    assert top.sum() > 12
    sharp = np.array([edge.use_edge_sharp for edge in mesh.edges])
    assert (sharp == top).all()
    assert (values(mesh, "crease_edge") == np.where(top, 0.5, 0)).all()
    assert (values(mesh, "bevel_weight_edge") == np.where(top, 0.25, 0)).all()
    assert (values(mesh, "top") == np.where(top, 7, 0)).all()
    assert (values(mesh, "way", "vector", 3) == np.outer(top, [1, 2, 3])).all()
    # A mark that is everywhere cannot be followed.
    assert "everywhere" not in mesh.attributes
    assert "everywhere" in capfd.readouterr().out


def test_a_child_lies_where_its_brother_does():
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.location, parent.rotation_euler, parent.scale = (1, -2, 0.5), (0.2, 0.7, -0.4), (2, 2, 2)
    obj = ball()
    obj.parent, obj.scale, obj.location = parent, (1, 1, 3), (0, 0.5, 0)
    bpy.context.view_layer.update()
    obj.matrix_parent_inverse = parent.matrix_world.inverted()
    bpy.context.view_layer.update()
    (new,) = remesh(target_vertices=200)
    assert new.parent == parent
    assert np.array(new.matrix_world) == pytest.approx(np.array(obj.matrix_world))
    assert np.abs(np.linalg.norm(arrays(new)[0], axis=1) - 1).max() < 0.1


def test_several_objects_are_remeshed_at_once_also_those_that_share_a_mesh():
    first, second = ball("First"), ball("Second")
    third = bpy.data.objects.new("Third", second.data)
    bpy.context.scene.collection.objects.link(third)
    third.location = (5, 0, 0)
    objects = [first, second, third]
    before = [scenes.state(obj) for obj in objects]
    scenes.select(objects)
    new = remesh(target_vertices=150)
    assert {obj.name for obj in new} == {"First_remesh", "Second_remesh", "Third_remesh"}
    assert {len(obj.data.vertices) for obj in new} == {150}
    assert [scenes.state(obj) for obj in objects] == before
    assert second.data == third.data
    assert bpy.data.objects["Third_remesh"].location.x == 5
    assert bpy.data.objects["Second_remesh"].data == bpy.data.objects["Third_remesh"].data


def test_objects_that_share_a_mesh_at_two_scales_get_one_each():
    first = ball("First")
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.scene.collection.objects.link(second)
    second.scale = (1, 1, 3)
    bpy.context.view_layer.update()
    scenes.select([first, second])
    new = remesh(target_vertices=150)
    assert new[0].data != new[1].data


def test_data_of_a_library_is_read_and_the_new_object_is_local(tmp_path):
    obj = dressed("Linked")
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {obj})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (source, target):
        target.objects = list(source.objects)
    (linked,) = target.objects
    bpy.context.scene.collection.objects.link(linked)
    scenes.select([linked])
    (new,) = remesh(target_vertices=200)
    assert (new.library, new.data.library) == (None, None)
    assert linked.data.library is not None
    assert [group.name for group in new.vertex_groups] == ["slope", "empty"]
    assert [key.name for key in new.data.shape_keys.key_blocks] == ["Basis", "Up", "Wide"]
    assert len(new.material_slots) == 2


def test_with_modifiers_applied_the_visible_shape_is_remeshed():
    """Shape keys are part of that shape, so the new mesh has none."""
    obj = dressed()
    obj.modifiers.new("Thick", "SOLIDIFY").thickness = 0.1
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=900, use_modifiers=True)
    assert scenes.state(obj) == before
    assert new.data.shape_keys is None
    assert not new.modifiers
    assert len(new.data.vertices) - len(new.data.edges) + len(new.data.polygons) == 2
    assert [layer.name for layer in new.data.uv_layers] == ["UVMap", "Second"]


def test_normals_follow_the_new_shape(capfd):
    obj = ball()
    mesh = obj.data
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    mesh.normals_split_custom_set([(0, 0, 1)] * len(mesh.loops))
    assert mesh.has_custom_normals
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=200)
    assert scenes.state(obj) == before
    assert not new.data.has_custom_normals
    normal = np.array([corner.vector for corner in new.data.corner_normals])
    co, faces = arrays(new)
    out = co[faces.ravel()] / np.linalg.norm(co[faces.ravel()], axis=1, keepdims=True)
    assert (normal * out).sum(axis=1).min() > 0.95
    assert "ustom normals" in capfd.readouterr().out


def test_colours_keep_their_kind_and_stay_within_bounds():
    obj = ball()
    mesh = obj.data
    co = np.array([v.co for v in mesh.vertices])
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    tint = np.concatenate([(co + 1) / 2, np.ones((len(co), 1))], axis=1).astype(np.float32)
    kinds = {(k, d) for k in ("BYTE_COLOR", "FLOAT_COLOR") for d in ("POINT", "CORNER")}
    for kind, domain in kinds:
        fill(mesh, f"{kind} {domain}", kind, domain, tint if domain == "POINT" else tint[corner], "color")
    (new,) = remesh(target_vertices=400)
    where, faces = arrays(new)
    for kind, domain in kinds:
        attribute = new.data.attributes[f"{kind} {domain}"]
        assert (attribute.data_type, attribute.domain) == (kind, domain)
        got = values(new.data, attribute.name, "color", 4)
        at = where if domain == "POINT" else where[faces.ravel()]
        assert np.abs(got[:, :3] - (at + 1) / 2).max() < 0.03
        assert got.min() >= 0
        assert got.max() <= 1


def test_objects_elsewhere_are_left_alone():
    obj, other = ball("Ball"), ball("Other")
    scenes.select([obj])
    before, all_before = scenes.state(other), set(bpy.data.objects)
    remesh(target_vertices=100)
    assert scenes.state(other) == before
    assert len(made(all_before)) == 1


@pytest.mark.parametrize("levels", [1, 2, 3])
@pytest.mark.parametrize("shared", [False, True])
def test_new_objects_and_their_meshes_are_named_after_their_object_and_level(levels, shared):
    obj = scenes.cube("Box")
    objects = [obj]
    if shared:
        other = bpy.data.objects.new("Twin", obj.data)
        bpy.context.collection.objects.link(other)
        objects.append(other)
        bpy.context.view_layer.update()
    scenes.select(objects)
    old = {o.name for o in bpy.data.objects}
    assert bpy.ops.object.omt_remesh(target_vertices=60, levels=levels) == {"FINISHED"}
    made = [o for o in bpy.data.objects if o.name not in old]
    endings = ["_remesh"] if levels == 1 else [f"_LOD{k}" for k in range(levels)]
    assert {o.name for o in made} == {o.name + e for o in objects for e in endings}
    for new in made:
        (ending,) = [e for e in endings if new.name.endswith(e)]
        assert new.data.name in {o.name + ending for o in objects}
    assert len({o.data.name for o in made}) == levels


@pytest.mark.parametrize("way", ["remesh", "cells"])
def test_what_was_active_and_locked_stays_so(way):
    obj = dressed()
    obj.vertex_groups.active_index, obj.active_shape_key_index = 0, 1
    obj.vertex_groups["empty"].lock_weight = True
    before = set(bpy.data.objects)
    if way == "remesh":
        remesh(target_vertices=60)
    else:
        assert bpy.ops.mesh.omt_partition(cells=3, relax=0, write="MESH") == {"FINISHED"}
    (new,) = made(before)
    assert new.vertex_groups.active.name == "slope" and new.active_shape_key.name == "Up"
    assert [group.name for group in new.vertex_groups if group.lock_weight] == ["empty"]
    scenes.select([obj])
    obj.vertex_groups.active_index = 1
    assert new.vertex_groups.active.name == "slope"
