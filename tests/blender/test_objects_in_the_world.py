"""Bodies are read where they stand, whatever mode they are in, and written back to the same place; pins and UVs with
attributes of all kinds around; UVs of PLY files that Blender does not read."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np
import pytest
import scenes
from mathutils import Euler, Matrix

MATRICES = {
    "moved": Matrix.Translation((1, 2, 3)),
    "turned": Euler((0.3, 1.0, -0.4)).to_matrix().to_4x4(),
    "mirrored": Matrix.Diagonal((-1, 1, 1, 1)),
    "all": Matrix.Translation((-1, 5, 0)) @ Euler((1, 0.2, 2)).to_matrix().to_4x4() @ Matrix.Diagonal((2, -0.5, -3, 1)),
    "twice mirrored": Matrix.Diagonal((-2, -1, 1, 1)),
    "inside out": Matrix.Diagonal((-1, -1, -1, 1)),
}


def cube(matrix):
    obj = scenes.cube()
    obj.matrix_world = matrix
    bpy.context.view_layer.update()
    return obj


def world_of(obj):
    return np.array([obj.matrix_world @ v.co for v in obj.data.vertices])


def volume(points, triangles):
    return np.einsum("md,md->", points[triangles[:, 0]], np.cross(points[triangles[:, 1]], points[triangles[:, 2]])) / 6


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("name", MATRICES)
def test_bodies_stand_in_the_world_with_their_outside_out(package, name, mode):
    obj = cube(MATRICES[name])
    expected = world_of(obj)
    group = obj.vertex_groups.new(name="stay")
    group.add([0, 1], 0.6, "REPLACE")
    group.add([2], 0.5, "REPLACE"), group.add([3], 0.4, "REPLACE")
    if mode == "EDIT":
        scenes.edit(obj)
    bodies = package("blender.volumes.bodies")
    body = bodies.read_body(obj, "stay")
    np.testing.assert_allclose(body.positions, expected, atol=1e-5)
    assert volume(body.positions, body.triangles) == pytest.approx(abs(obj.matrix_world.determinant()), rel=1e-4)
    assert np.flatnonzero(body.stays).tolist() == [0, 1, 2] and bodies.read_body(obj).stays is None
    assert np.bincount(body.polygons).tolist() == [2] * 6 and len(bpy.data.meshes) == 1
    np.testing.assert_allclose(bodies.local(obj, expected), bodies.read_positions(obj), atol=1e-5)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("some", [False, True])
def test_positions_are_written_back_to_their_place(package, mode, some):
    obj = cube(MATRICES["all"])
    goal = world_of(obj) + np.arange(24).reshape(8, 3) / 10
    bodies = package("blender.volumes.bodies")
    if mode == "EDIT":
        scenes.edit(obj)
    before = bodies.read_positions(obj)
    moved = np.arange(8) % 3 == 0
    bodies.write_positions(obj, goal, moved if some else None)
    after = bodies.read_positions(obj)
    changed = moved if some else np.ones(8, bool)
    assert (after[~changed].view(np.int32) == before[~changed].view(np.int32)).all()
    bodies.set_positions(obj, before)
    np.testing.assert_array_equal(bodies.read_positions(obj), before)
    bodies.set_positions(obj, after)
    scenes.leave_edit()
    np.testing.assert_allclose(world_of(obj)[changed], goal[changed], atol=1e-5)


def test_with_shape_keys_the_basis_moves_along(package):
    obj = cube(MATRICES["moved"])
    obj.shape_key_add(name="Basis"), obj.shape_key_add(name="Other")
    goal = world_of(obj) * 2
    package("blender.volumes.bodies").write_positions(obj, goal)
    basis = np.array([point.co for point in obj.data.shape_keys.reference_key.data])
    np.testing.assert_allclose(basis + [1, 2, 3], goal, atol=1e-5)


@pytest.mark.parametrize("keyed", [False, True])
@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_frames_are_shape_keys_in_turn(package, mode, keyed):
    obj = cube(MATRICES["turned"])
    frames = [world_of(obj) * (1 + k) for k in range(3)]
    if mode == "EDIT":
        scenes.edit(obj)
    names = package("blender.volumes.bodies").write_frames(obj, frames, 10, keyed)
    assert obj.mode == mode
    scenes.leave_edit()
    keys = obj.data.shape_keys.key_blocks
    assert names == [key.name for key in keys][1:] == ["Flow 1", "Flow 2", "Flow 3"]
    assert obj.active_shape_key_index == 3
    for name, goal in zip(names, frames, strict=True):
        found = np.array([obj.matrix_world @ point.co for point in keys[name].data])
        np.testing.assert_allclose(found, goal, atol=1e-4)
    if not keyed:
        assert [key.value for key in keys][1:] == [0, 0, 1]
    else:
        # Each is the whole shape one frame after that it begins at, half before and after.
        shown = {10: [0, 0, 0], 11: [1, 0, 0], 11.5: [0.5, 0.5, 0], 12: [0, 1, 0], 13: [0, 0, 1], 20: [0, 0, 1]}
        for frame, values in shown.items():
            bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
            assert [key.value for key in keys][1:] == pytest.approx(values, abs=1e-5)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_only_an_attribute_of_corners_and_yes_or_no_holds_pins(package, mode):
    obj = scenes.bump(3, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    read = package("blender.mesh").read_pinned
    assert not read(obj.data, "UVMap").any()
    scenes.pin(obj, [0, 5])
    on = [loop.vertex_index in (0, 5) for loop in obj.data.loops]
    assert read(obj.data, "UVMap").tolist() == on and not read(obj.data, "Other").any()
    for k, (kind, domain) in enumerate([("FLOAT", "CORNER"), ("BOOLEAN", "POINT"), ("BOOLEAN", "FACE")]):
        other = obj.data.attributes.new(f".pn.Strange{k}", kind, domain)
        for item in other.data:
            item.value = 1
        assert not read(obj.data, f"Strange{k}").any() and len(read(obj.data, f"Strange{k}")) == len(obj.data.loops)


def test_what_is_edited_is_read_as_it_is_now(package):
    obj = scenes.bump(3, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    scenes.edit(obj)
    edit = bmesh.from_edit_mesh(obj.data)
    edit.verts.ensure_lookup_table()
    edit.verts[4].co = (7, 8, 9)
    edit.edges.ensure_lookup_table()
    edit.edges[2].seam = True
    ends = sorted(v.index for v in edit.edges[2].verts)
    edit.faces.ensure_lookup_table()
    edit.faces[1].select_set(False)
    edit.faces[2].hide_set(True)
    layer = edit.loops.layers.uv["UVMap"]
    edit.faces[0].loops[1][layer].uv = (5, 6)
    count = len(bpy.data.meshes)
    reading = package("blender.mesh").read(obj)
    assert len(bpy.data.meshes) == count
    assert reading.surface.positions[4].tolist() == [7, 8, 9]
    assert [sorted(e) for e in reading.surface.seams.tolist()] == [ends]
    assert not reading.faces[1] and not reading.faces[2] and reading.faces.sum() == len(reading.faces) - 2
    np.testing.assert_array_equal(reading.uv[1], [5, 6])


PLY = """ply
format ascii 1.0
element vertex 5
property float x
property float y
property float z
{vertex}element face 2
property list uchar int vertex_indices
{face}end_header
{rows}"""


@pytest.mark.parametrize("kind", ["texture_u", "texcoord", "none"])
def test_uvs_of_ply_files_under_other_names_are_found(package, tmp_path, kind):
    """Also where corners of faces have them: of a quad and a triangle whose vertices Blender may number anew."""
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0.5, 0)]
    faces = [(0, 1, 2, 3), (1, 4, 2)]
    own = {v: (0.1 * v, 1 - 0.15 * v) for v in range(5)}
    vertex = "property float texture_u\nproperty float texture_v\n" if kind == "texture_u" else ""
    face = "property list uchar float texcoord\n" if kind == "texcoord" else ""
    rows = [" ".join(map(str, (*p, *(own[v] if vertex else ())))) for v, p in enumerate(points)]
    corner = {(k, j): (0.05 * j + 0.3 * k, 0.07 * j) for k, f in enumerate(faces) for j in range(len(f))}
    for k, f in enumerate(faces):
        uv = [x for j in range(len(f)) for x in corner[k, j]]
        rows.append(" ".join(map(str, (len(f), *f, *((len(uv), *uv) if face else ())))))
    path = tmp_path / "a.ply"
    path.write_text(PLY.format(vertex=vertex, face=face, rows="\n".join(rows) + "\n"))
    package("files.meshes").load(path)
    (obj,) = bpy.data.objects
    layers = obj.data.uv_layers
    if kind == "none":
        assert not layers
        return
    found = {}
    for polygon in obj.data.polygons:
        corners = [(obj.data.vertices[obj.data.loops[i].vertex_index].co, i) for i in polygon.loop_indices]
        found[len(corners)] = {tuple(round(x, 4) for x in co): tuple(layers[0].data[i].uv) for co, i in corners}
    for k, f in enumerate(faces):
        for j, v in enumerate(f):
            expected = own[v] if kind == "texture_u" else corner[k, j]
            assert found[len(f)][tuple(map(float, points[v]))] == pytest.approx(expected, abs=1e-6)
