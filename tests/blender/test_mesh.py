"""Meshes read and UVs written: the same in both modes, lengths as the object stands, no corner but those named."""

from __future__ import annotations

import warnings
from dataclasses import fields

import bpy

import meshes
import numpy as np
import pytest
import scenes
from mathutils import Euler, Matrix


@pytest.fixture
def blender_mesh(package):
    return package("blender.mesh")


def test_both_modes_read_the_same(blender_mesh):
    obj = scenes.cube()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    first = blender_mesh.read(obj)
    scenes.edit(obj)
    second = blender_mesh.read(obj)
    for field in fields(first.surface):
        assert np.array_equal(getattr(first.surface, field.name), getattr(second.surface, field.name)), field.name
    assert np.array_equal(first.uv, second.uv) and second.faces.all()


def test_edit_mode_chooses_the_selected_faces(blender_mesh):
    obj = scenes.bump(4, 4)
    scenes.edit(obj, faces=[1, 5])
    assert np.flatnonzero(blender_mesh.read(obj).faces).tolist() == [1, 5]


def test_the_stretch_keeps_all_lengths_and_no_rotation(blender_mesh):
    obj = scenes.bump()
    turn = Euler((0.3, 1.1, -0.7)).to_matrix().to_4x4()
    obj.matrix_world = turn @ Matrix.Diagonal((2.0, 0.5, 3.0, 1.0)) @ turn.inverted()
    bpy.context.view_layer.update()
    matrix, stretch = np.array(obj.matrix_world)[:3, :3], blender_mesh.stretch(obj)
    assert np.allclose(stretch, stretch.T)
    assert np.allclose(stretch.T @ stretch, matrix.T @ matrix, atol=1e-5)
    obj.matrix_world = turn
    bpy.context.view_layer.update()
    assert (blender_mesh.stretch(obj) == np.eye(3)).all()


def test_a_loose_vertex_that_is_nowhere_is_no_reason_to_warn(blender_mesh):
    obj = scenes.cube()
    obj.data.vertices.add(1)
    places = np.append(np.array([v.co[:] for v in obj.data.vertices[:-1]]), [np.inf, 0, 1])
    obj.data.vertices.foreach_set("co", places)
    obj.rotation_euler = (0.3, 0.4, 0.5)
    bpy.context.view_layer.update()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        positions = blender_mesh.read(obj).surface.positions
    assert np.isfinite(positions[:-1]).all() and not np.isfinite(positions[-1]).all()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_other_corners_keep_their_bits(blender_mesh, mode):
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.3, (0.1, 0.7)))
    before = scenes.uv_of(obj)
    corners = np.array([3, 17, 40])
    if mode == "EDIT":
        scenes.edit(obj)
    blender_mesh.write_uv(obj, "UVMap", corners, np.array([[0.25, 0.5], [2.0, -1.0], [0.0, 8.0]]))
    if mode == "EDIT":
        scenes.leave_edit()
    after = scenes.uv_of(obj)
    assert np.flatnonzero((before != after).any(axis=1)).tolist() == corners.tolist()
    assert after[corners].tolist() == [[0.25, 0.5], [2.0, -1.0], [0.0, 8.0]]


def test_split_vertices_become_one_and_the_faces_stay(blender_mesh):
    obj = scenes.add([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-0.0, 1, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2), (3, 4, 5)])
    surface = blender_mesh.weld_split_vertices(blender_mesh.read(obj)).surface
    assert len(np.unique(surface.corner_vertex)) == 4
    assert (surface.positions[surface.corner_vertex] == blender_mesh.read(obj).surface.positions).all()


@pytest.mark.parametrize("flat", [0, 1, 2])
def test_both_sides_of_what_was_split_up_are_whole_and_apart(blender_mesh, flat):
    """Two triangles without area on the same vertices are no sides of a leaf, and none joins those of one."""
    V, F = meshes.grid(3, 3)
    a, b = F[4, :2]
    both = np.vstack([F, F[:, ::-1], *[[[a, b, a]], [[b, a, a]]][:flat]])
    obj = scenes.add(V[both].reshape(-1, 3).tolist(), np.arange(both.size).reshape(-1, 3).tolist())
    corners = blender_mesh.weld_split_vertices(blender_mesh.read(obj)).surface.corner_vertex.reshape(-1, 3)
    up, down = np.unique(corners[: len(F)]), np.unique(corners[len(F) : 2 * len(F)])
    assert len(up) == len(down) == len(V) and not np.isin(up, down).any()


def test_a_new_layer_is_a_copy_and_becomes_the_active_one(blender_mesh):
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    assert blender_mesh.target_layer(obj, "") == "UVMap"
    assert blender_mesh.target_layer(obj, "New") == "New" == obj.data.uv_layers.active.name
    assert (scenes.uv_of(obj, "New") == scenes.uv_of(obj, "UVMap")).all()
    with pytest.raises(blender_mesh.TargetError, match="too long"):
        blender_mesh.check_target(obj, "ä" * 32)


@pytest.mark.parametrize("scales, flat", [
    ((1, 1, 1), False), ((1, 1, 0), True), ((0, 0, 0), True), ((-2, 1, 1), False), ((1, 1, 1e-6), False),
    ((1, 1, 1e-13), True), ((1e-8, 1e-8, 1e-8), False), ((1e6, 1e6, 0), True), ((-1e-9, 1, 1), False)])  # fmt: skip
def test_what_is_flattened_is_told_at_any_size(package, scales, flat):
    turn = np.array(Euler((0.3, 0.4, 0.5)).to_matrix())
    for matrix in (np.diag(scales), turn.T @ np.diag(scales) @ turn):
        assert package("blender.mesh").is_flattened(matrix.astype(float)) == flat
