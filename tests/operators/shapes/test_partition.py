"""mesh.omt_partition as users call it: cells in each of their forms, nothing else changes, undo takes them back."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

CELL = "OMT Cell"


def ball(name="Ball"):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=16)
    bpy.context.object.name = name
    return bpy.context.object


def integers(obj, name):
    return np.array([item.value for item in obj.data.attributes[name].data])


def divide(**settings):
    assert bpy.ops.mesh.omt_partition(**{"cells": 8, "relax": 2, **settings}) == {"FINISHED"}


def test_face_sets_and_the_attribute_are_the_same_cells_and_nothing_else_changes():
    obj = ball()
    before = [tuple(v.co) for v in obj.data.vertices]
    divide()
    divide(write="ATTRIBUTE")
    cells = integers(obj, CELL)
    assert set(cells) == set(range(8)) and (integers(obj, ".sculpt_face_set") == cells + 1).all()
    area = np.bincount(cells, [p.area for p in obj.data.polygons])
    assert np.abs(area / area.mean() - 1).max() < 0.35
    assert [tuple(v.co) for v in obj.data.vertices] == before and len(bpy.data.objects) == 1


def test_materials_and_seams_part_the_same_cells():
    obj = ball()
    obj.data.materials.append(bpy.data.materials.new("Old"))
    divide(write="ATTRIBUTE")
    divide(write="MATERIALS")
    divide(write="SEAMS")
    assert len(obj.data.materials) == 9 and obj.data.materials[0].name == "Old"
    index = np.array([p.material_index for p in obj.data.polygons])
    assert (index == integers(obj, CELL) + 1).all()
    of_edge = {}
    for polygon in obj.data.polygons:
        for key in polygon.edge_keys:
            of_edge.setdefault(key, set()).add(index[polygon.index])
    assert {e.key for e in obj.data.edges if e.use_seam} == {key for key, cells in of_edge.items() if len(cells) > 1}


def test_the_cut_mesh_is_a_new_object_of_exact_cells_with_uvs_and_groups():
    obj = ball()
    obj.scale, obj.location = (1, 2, 1), (5, 0, 0)
    obj.vertex_groups.new(name="region").add(list(range(40)), 0.5, "REPLACE")
    for name in ("left", "right"):
        obj.data.materials.append(bpy.data.materials.new(name))
    for polygon in obj.data.polygons:
        polygon.material_index = int(polygon.center.x > 0)
    own = bpy.data.materials.new("of the object")
    obj.material_slots[1].link, obj.material_slots[1].material = "OBJECT", own
    bpy.context.view_layer.update()
    divide(write="MESH")
    new = bpy.context.object
    assert [(s.link, s.material.name) for s in new.material_slots] == [("DATA", "left"), ("OBJECT", own.name)]
    assert [m.name for m in new.data.materials] == [m.name for m in obj.data.materials]
    assert all((p.center.x > 0) == (p.material_index == 1) for p in new.data.polygons if abs(p.center.x) > 1e-4)
    assert new.name == "Ball_cells" and len(bpy.data.objects) == 2 and "region" in new.vertex_groups
    assert np.allclose(new.matrix_world, obj.matrix_world) and len(new.data.uv_layers) == 1
    seen = new.data.copy()
    seen.transform(new.matrix_world)
    area = np.bincount(integers(new, CELL), [p.area for p in seen.polygons])
    assert np.abs(area / area.mean() - 1).max() < 1e-3
    assert sum(p.area for p in new.data.polygons) == pytest.approx(sum(p.area for p in obj.data.polygons), rel=1e-5)
    cell, of_edge = integers(new, CELL), {}
    for polygon in new.data.polygons:
        for key in polygon.edge_keys:
            of_edge.setdefault(key, set()).add(cell[polygon.index])
    assert {e.key for e in new.data.edges if e.use_seam} >= {key for key, cells in of_edge.items() if len(cells) > 1}
    inside = [uv.vector for uv in new.data.uv_layers[0].uv]
    assert np.min(inside) > -1e-6 and np.max(inside) < 1 + 1e-6


def test_points_have_normals_and_radii():
    ball()
    divide(write="POINTS", cells=30)
    new = bpy.context.object
    assert new.name == "Ball_points" and len(new.data.vertices) == 30 and not new.data.polygons
    for vertex, normal in zip(new.data.vertices, new.data.attributes["normal"].data, strict=True):
        assert vertex.co.normalized().dot(normal.vector) > 0.95
    radii = [item.value for item in new.data.attributes["radius"].data]
    assert np.pi * np.square(radii).sum() == pytest.approx(4 * np.pi, rel=0.05)


def test_a_painted_group_draws_cells_to_it():
    obj = ball()
    upper = [v.index for v in obj.data.vertices if v.co.z > 0]
    obj.vertex_groups.new(name="dark").add(upper, 1.0, "REPLACE")
    divide(write="POINTS", cells=40, capacity_group="dark")
    assert np.mean([v.co.z > 0 for v in bpy.context.object.data.vertices]) > 0.9
    scenes.select([obj])
    with pytest.raises(RuntimeError, match="no vertex group 'light'"):
        bpy.ops.mesh.omt_partition(capacity_group="light")


def test_edit_mode_divides_the_selected_faces():
    obj = ball()
    divide(write="ATTRIBUTE")
    first = integers(obj, CELL)
    scenes.edit(obj, faces=slice(0, 200))
    divide(write="ATTRIBUTE", cells=3)
    divide(write="MATERIALS", cells=3)
    scenes.leave_edit()
    cells = integers(obj, CELL)
    assert set(cells[:200]) == {0, 1, 2} and (cells[200:] == first[200:]).all()
    assert {p.material_index for p in obj.data.polygons} == {0, 1, 2}


def test_bad_input_changes_nothing():
    one, other = ball("One"), scenes.cube("Two")
    bpy.ops.object.select_all(action="SELECT")
    bpy.context.view_layer.objects.active = one
    bpy.ops.object.join()
    assert other is not None
    before = len(one.data.attributes)
    with pytest.raises(RuntimeError, match="fewer than the 2 separate parts"):
        bpy.ops.mesh.omt_partition(cells=1)
    one.data.attributes.new(CELL, "FLOAT", "POINT")
    with pytest.raises(RuntimeError, match="another attribute 'OMT Cell'"):
        bpy.ops.mesh.omt_partition(write="ATTRIBUTE")
    assert len(one.data.attributes) == before + 1


def test_undo_takes_it_back():
    obj = ball()
    bpy.ops.ed.undo_push(message="before")
    divide()
    bpy.ops.ed.undo_push(message="after")
    assert ".sculpt_face_set" in obj.data.attributes
    bpy.ops.ed.undo()
    assert ".sculpt_face_set" not in bpy.data.objects["Ball"].data.attributes


@pytest.mark.parametrize("write", ["MESH", "POINTS"])
def test_objects_made_of_what_is_edited_leave_it_active_and_selected(write):
    obj = scenes.bump(4, 4)
    scenes.edit(obj, faces=[0, 1, 2, 5])
    before = set(bpy.data.objects)
    assert bpy.ops.mesh.omt_partition(cells=2, relax=0, write=write) == {"FINISHED"}
    (made,) = set(bpy.data.objects) - before
    assert bpy.context.mode == "EDIT_MESH" and bpy.context.view_layer.objects.active == obj
    assert obj.select_get()
    scenes.leave_edit()
    scenes.select([obj])
    assert bpy.ops.mesh.omt_partition(cells=2, relax=0, write=write) == {"FINISHED"}
    (second,) = set(bpy.data.objects) - before - {made}
    assert bpy.context.view_layer.objects.active == second and bpy.context.selected_objects == [second]
