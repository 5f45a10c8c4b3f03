"""uv.omt_seams as users call it: seams appear, nothing else changes, and unwrapping accepts them."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


def seams_of(obj):
    values = np.zeros(len(obj.data.edges), bool)
    obj.data.edges.foreach_get("use_seam", values)
    return values


def positions(obj):
    values = np.zeros(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", values)
    return values


def sphere(name="Sphere"):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, calc_uvs=False)
    bpy.context.object.name = name
    return bpy.context.object


def mark(**arguments):
    assert bpy.ops.uv.omt_seams(**arguments) == {"FINISHED"}


def test_seams_open_a_sphere_and_nothing_else_changes():
    obj = sphere()
    before = positions(obj)
    mark()
    assert seams_of(obj).any() and (positions(obj) == before).all() and len(obj.data.uv_layers) == 0
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT") == {"FINISHED"}
    marked = seams_of(obj)
    mark()
    assert (seams_of(obj) == marked).all()


def test_edit_mode_marks_the_same_seams():
    first = sphere()
    mark()
    second = sphere("Second")
    scenes.edit(second)
    mark()
    scenes.leave_edit()
    assert (seams_of(first) == seams_of(second)).all()


def test_seams_that_exist_stay():
    obj = scenes.cube()
    before = seams_of(obj)
    mark()
    assert (seams_of(obj) == before).all()


def test_several_objects_at_once():
    one, other = sphere("One"), sphere("Other")
    scenes.select([one, other])
    mark()
    assert seams_of(one).any() and (seams_of(one) == seams_of(other)).all()


def test_a_vertex_group_is_kept_free():
    obj = sphere()
    group = obj.vertex_groups.new(name="Face")
    front = np.flatnonzero(positions(obj).reshape(-1, 3)[:, 0] > 0)
    group.add(front.tolist(), 1.0, "REPLACE")
    mark(keep_free="Face")
    ends = np.array([edge.vertices[:] for edge in obj.data.edges])[seams_of(obj)]
    assert not np.isin(ends, front).all(axis=1).any()


def test_a_group_that_is_not_there_is_said():
    sphere()
    with pytest.raises(RuntimeError, match="no vertex group 'Face'"):
        mark(keep_free="Face")


def test_holes_may_be_filled():
    angle = 2 * np.pi * np.arange(12) / 12
    rings = [np.stack([r * np.cos(angle), r * np.sin(angle), 0 * angle], axis=1) for r in (2, 1)]
    ring = [(k, (k + 1) % 12, 12 + (k + 1) % 12, 12 + k) for k in range(12)]
    obj = scenes.add(np.concatenate(rings), ring)
    mark(fill_holes=True)
    assert not seams_of(obj).any()
    mark()
    assert seams_of(obj).any()


def ring(height=3):
    """A tube of quads without ends, 12 around."""
    angle = 2 * np.pi * np.arange(12) / 12
    rows = [np.stack([np.cos(angle), np.sin(angle), 0 * angle + k], axis=1) for k in range(height + 1)]
    k = np.arange(12)
    quads = [np.stack([k, (k + 1) % 12, (k + 1) % 12 + 12, k + 12], axis=1) + 12 * row for row in range(height)]
    return scenes.add(np.concatenate(rows), np.concatenate(quads))


def cut_edges(obj):
    return {tuple(sorted(e.vertices)) for e in obj.data.edges if e.use_seam}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("column", [2, 9])
def test_edges_marked_sharp_take_the_cut(mode, column):
    obj = ring()
    line = {(12 * row + column, 12 * row + 12 + column) for row in range(3)}
    for edge in obj.data.edges:
        edge.use_edge_sharp = tuple(sorted(edge.vertices)) in line
    if mode == "EDIT":
        scenes.edit(obj)
    mark(extremities=0)
    if mode == "EDIT":
        scenes.leave_edit()
    assert cut_edges(obj) == line


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_pinned_vertices_are_not_cut_through(mode):
    obj = ring()
    mark(extremities=0)
    used = {v for edge in cut_edges(obj) for v in edge if 12 <= v < 36}
    assert used
    for edge in obj.data.edges:
        edge.use_seam = False
    obj.data.uv_layers.new(name="UVMap")
    scenes.pin(obj, used)
    if mode == "EDIT":
        scenes.edit(obj)
    mark(extremities=0)
    if mode == "EDIT":
        scenes.leave_edit()
    assert cut_edges(obj) and not {v for edge in cut_edges(obj) for v in edge} & used


def test_seams_are_those_of_unwrap_before_its_map():
    obj = sphere()
    mark(max_shear=1.2)
    long = seams_of(obj).sum()
    obj = sphere()
    mark(max_shear=0.0, extremities=0)
    assert 0 < seams_of(obj).sum() < long
