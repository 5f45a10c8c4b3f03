"""uv.omt_unwrap as users call it: both modes, partial selections, several objects, undo."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


def unwrap(**arguments):
    assert bpy.ops.uv.omt_unwrap(**arguments) == {"FINISHED"}


def density(obj):
    """UV area over area in space, of the whole object."""
    space, uv = scenes.areas(obj)
    return np.abs(uv).sum() / space.sum()


def assert_inside(obj):
    uv = scenes.uv_of(obj)
    assert uv.min() >= 0 and uv.max() <= 1


@pytest.mark.parametrize("boundary", ["FREE", "DISK", "SQUARE"])
def test_object_mode_maps_every_face_into_the_unit_square(boundary):
    obj = scenes.bump()
    unwrap(boundary=boundary)
    space, uv = scenes.areas(obj)
    assert (uv > 0).all()
    assert np.abs(uv / uv.sum() - space / space.sum()).sum() < 0.1
    assert_inside(obj)


def test_disk_and_square_outlines():
    obj = scenes.bump(columns=16, rows=16)
    unwrap(boundary="DISK", margin=0)
    uv = scenes.uv_of(obj)
    assert np.hypot(*(uv - 0.5).T).max() == pytest.approx(0.5, abs=1e-2)
    unwrap(boundary="SQUARE", margin=0)
    assert np.abs(scenes.areas(obj)[1]).sum() == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("make", [scenes.bump, scenes.cube])
def test_edit_mode_with_everything_selected_equals_object_mode(make):
    obj = make()
    unwrap()
    expected = scenes.uv_of(obj)
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    scenes.edit(obj)
    unwrap()
    scenes.leave_edit()
    assert (scenes.uv_of(obj) == expected).all()


def test_a_ball_of_struts(package):
    """Nineteen handles, hard edges that end among soft ones, and two islands full of holes."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1)
    obj = bpy.context.object
    obj.modifiers.new("Struts", "WIREFRAME").thickness = 0.12
    obj.modifiers.new("Smooth", "SUBSURF").levels = 1
    bpy.ops.object.convert(target="MESH")
    unwrap()
    reading = package("blender.mesh").read(obj)
    found = package("pipelines.distortion").measure_readings([reading])
    assert len(package("solver.editing.uv_islands").uv_islands(reading.surface, reading.uv, None).islands) == 2
    assert found.folds == 0 and found.overlap == 0 and found.area_l1 < 0.002
    assert_inside(obj)


def test_edit_mode_leaves_faces_that_are_not_selected_to_the_bit():
    obj = scenes.bump()
    rng = np.random.default_rng(1)
    before = rng.random((len(obj.data.loops), 2)).astype(np.float32)
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", before.ravel())
    untouched = scenes.state(obj, leave_out={"UVMap"})
    faces = [0, 1, 2, 8, 9, 10]
    scenes.edit(obj, faces=faces)
    unwrap()
    scenes.leave_edit()
    after = scenes.uv_of(obj)
    changed = np.zeros(len(after), bool)
    for face in faces:
        changed[list(obj.data.polygons[face].loop_indices)] = True
    assert (after[~changed] == before[~changed]).all()
    assert (after[changed] != before[changed]).any(axis=1).all()
    assert scenes.state(obj, leave_out={"UVMap"}) == untouched


def test_hidden_faces_are_left_alone_in_edit_mode():
    obj = scenes.bump()
    obj.data.uv_layers.new(name="UVMap")
    before = scenes.uv_of(obj)
    scenes.edit(obj, faces=[0])
    bpy.ops.mesh.hide()
    bpy.ops.mesh.select_all(action="SELECT")
    unwrap()
    scenes.leave_edit()
    after, hidden = scenes.uv_of(obj), list(obj.data.polygons[0].loop_indices)
    assert (after[hidden] == before[hidden]).all()
    rest = np.setdiff1d(np.arange(len(after)), hidden)
    assert (after[rest] != before[rest]).any()


def test_only_the_uv_layer_changes():
    obj = scenes.bump()
    mesh = obj.data
    rng = np.random.default_rng(2)
    other = mesh.uv_layers.new(name="Other")
    other.uv.foreach_set("vector", rng.random(2 * len(mesh.loops)).astype(np.float32))
    for name, kind, domain in (
        ("weight", "FLOAT", "POINT"),
        ("tag", "INT", "FACE"),
        ("paint", "FLOAT_COLOR", "CORNER"),
    ):
        attribute = mesh.attributes.new(name, kind, domain)
        key, width = ("color", 4) if kind == "FLOAT_COLOR" else ("value", 1)
        attribute.data.foreach_set(key, rng.integers(0, 9, len(attribute.data) * width))
    group = obj.vertex_groups.new(name="group")
    group.add([0, 3], 0.5, "REPLACE")
    mesh.uv_layers.active = mesh.uv_layers.new(name="Target")
    for enter, leave in ((lambda: None, lambda: None), (lambda: scenes.edit(obj), scenes.leave_edit)):
        before = scenes.state(obj, leave_out={"Target"})
        enter()
        unwrap()
        leave()
        assert scenes.state(obj, leave_out={"Target"}) == before
        assert np.ptp(scenes.uv_of(obj, "Target")) > 0.5


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_shape_keys_normals_creases_and_modifiers_stay(mode):
    obj = scenes.bump()
    mesh = obj.data
    rng = np.random.default_rng(3)
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Smile")
    shape = rng.random(3 * len(mesh.vertices)).astype(np.float32)
    key.data.foreach_set("co", shape)
    key.value = 0.5
    mesh.normals_split_custom_set([tuple(v) for v in rng.normal(size=(len(mesh.loops), 3))])
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 1
    for edge in mesh.edges:
        edge.use_edge_sharp = bool(edge.index % 3 == 0)

    def held():
        shapes = np.zeros((2, len(shape)), np.float32)
        for row, block in zip(shapes, mesh.shape_keys.key_blocks, strict=True):
            block.data.foreach_get("co", row)
        normals = np.array([loop.vector[:] for loop in mesh.corner_normals])
        values = [block.value for block in mesh.shape_keys.key_blocks]
        stack = [(m.name, m.type, m.levels) for m in obj.modifiers]
        return shapes.tobytes(), normals.round(6).tobytes(), values, stack, [e.use_edge_sharp for e in mesh.edges]

    before = held()
    if mode == "EDIT":
        scenes.edit(obj)
    unwrap()
    if mode == "EDIT":
        scenes.leave_edit()
    assert held() == before and np.ptp(scenes.uv_of(obj)) > 0.5


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("layer", ["New", "UVMap"])
def test_undo_restores_everything(mode, layer):
    obj = scenes.bump()
    obj.data.uv_layers.new(name="UVMap")
    name, before = obj.name, scenes.state(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.uv.omt_unwrap("EXEC_DEFAULT", True, uv_layer=layer) == {"FINISHED"}
    assert scenes.state(bpy.data.objects[name]) != before
    bpy.ops.ed.undo()
    assert scenes.state(bpy.data.objects[name]) == before


def test_new_layer_by_name_and_then_the_same_one():
    obj = scenes.bump()
    obj.data.uv_layers.new(name="First")
    first = scenes.uv_of(obj)
    unwrap(uv_layer="Second")
    assert [layer.name for layer in obj.data.uv_layers] == ["First", "Second"]
    assert obj.data.uv_layers.active.name == "Second"
    assert (scenes.uv_of(obj, "First") == first).all()
    scenes.edit(obj)
    unwrap(uv_layer="Third")
    unwrap(uv_layer="Second", boundary="SQUARE")
    scenes.leave_edit()
    assert [layer.name for layer in obj.data.uv_layers] == ["First", "Second", "Third"]
    assert obj.data.uv_layers.active.name == "Second"
    assert (scenes.uv_of(obj, "First") == first).all()
    assert (scenes.uv_of(obj, "Second") != scenes.uv_of(obj, "Third")).any()


def test_new_layer_starts_as_a_copy_for_faces_that_are_not_unwrapped():
    obj = scenes.bump()
    unwrap()
    first = scenes.uv_of(obj)
    scenes.edit(obj, faces=[0, 1])
    unwrap(uv_layer="Second", boundary="SQUARE")
    scenes.leave_edit()
    loops = [i for face in (0, 1) for i in obj.data.polygons[face].loop_indices]
    rest = np.setdiff1d(np.arange(len(first)), loops)
    second = scenes.uv_of(obj, "Second")
    assert (second[rest] == first[rest]).all()
    assert (second[loops] != first[loops]).any()
    assert (scenes.uv_of(obj, "UVMap") == first).all()


def test_without_packing_islands_are_centred_at_one_scale():
    small, large = scenes.bump(name="Small"), scenes.bump(name="Large")
    large.scale = (3, 3, 3)
    unwrap(pack=False)
    for obj in (small, large):
        uv = scenes.uv_of(obj)
        assert 0.5 * (uv.min(axis=0) + uv.max(axis=0)) == pytest.approx([0.5, 0.5], abs=1e-6)
        assert_inside(obj)
    assert density(small) == pytest.approx(density(large), rel=1e-4)


def test_unapplied_scale_equals_applied_scale():
    obj = scenes.bump()
    obj.scale, obj.rotation_euler, obj.location = (1, 3, 0.5), (0.3, 0.2, 1), (5, 5, 5)
    unwrap()
    scaled = scenes.uv_of(obj)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    unwrap()
    assert scaled == pytest.approx(scenes.uv_of(obj), abs=1e-4)


def test_parent_scale_and_mirroring_count_too():
    obj = scenes.bump()
    unwrap()
    plain = scenes.uv_of(obj)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    obj.parent, parent.scale = parent, (-2, 2, 2)
    unwrap()
    assert scenes.uv_of(obj) == pytest.approx(plain, abs=1e-5)
    parent.scale = (1, 4, 1)
    unwrap()
    assert np.abs(scenes.uv_of(obj) - plain).max() > 1e-2


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_several_objects_share_one_density_and_one_square(mode):
    a, b, c = scenes.bump(name="A"), scenes.bump(name="B", height=1.5), scenes.cube()
    b.scale = (2, 2, 2)
    if mode == "EDIT":
        scenes.edit(a, b, c)
    unwrap(margin=8)
    if mode == "EDIT":
        scenes.leave_edit()
    assert density(b) == pytest.approx(density(a), rel=1e-3)
    assert density(c) == pytest.approx(density(a), rel=1e-3)
    corners = np.concatenate([scenes.triangles_of(obj)[1] for obj in (a, b, c)])
    owner = np.repeat([0, 1, 2], [len(scenes.areas(obj)[0]) for obj in (a, b, c)])
    assert nearest_of_different_owner(corners, owner) >= 8 / 1024 - 1e-6
    assert corners.min() >= 4 / 1024 - 1e-6 and corners.max() <= 1 - 4 / 1024 + 1e-6


def nearest_of_different_owner(corners, owner, samples=60):
    """Least distance between points on the sides of triangles (m,3,2) of different islands."""
    from scipy.spatial import cKDTree

    t = np.linspace(0, 1, samples)[:, None, None, None]
    points = corners * (1 - t) + np.roll(corners, -1, axis=1) * t
    clouds = [points[:, owner == k].reshape(-1, 2) for k in np.unique(owner)]
    return min(cKDTree(a).query(b)[0].min() for i, a in enumerate(clouds) for b in clouds[:i])


def test_several_islands_of_one_object_keep_their_distance():
    obj = scenes.bump()
    for edge in obj.data.edges:
        edge.use_seam = True
    unwrap(margin=4, texture_size=512)
    _, corners = scenes.triangles_of(obj)
    owner = np.zeros(len(corners), np.int32)
    obj.data.loop_triangles.foreach_get("polygon_index", owner)
    assert nearest_of_different_owner(corners, owner, samples=20) >= 4 / 512 - 1e-6
    space, uv = scenes.polygon_areas(obj)
    assert uv / space == pytest.approx((uv / space).mean(), rel=1e-3)


def test_objects_that_share_a_mesh_are_solved_once():
    obj = scenes.bump()
    twin = bpy.data.objects.new("Twin", obj.data)
    bpy.context.collection.objects.link(twin)
    unwrap()
    alone = scenes.uv_of(obj)
    scenes.select([obj, twin])
    unwrap()
    assert (scenes.uv_of(obj) == alone).all()
    scenes.edit(obj, twin)
    unwrap()
    scenes.leave_edit()
    assert (scenes.uv_of(twin) == alone).all()


def test_quads_and_polygons_keep_one_uv_per_corner():
    t = 2 * np.pi * np.arange(12) / 12
    ring = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    wall = np.stack([1.5 * np.cos(t), 1.5 * np.sin(t), 0 * t + 1], axis=1)
    faces = [range(12), *([i, 12 + i, 12 + (i + 1) % 12, (i + 1) % 12] for i in range(12))]
    obj = scenes.add(np.concatenate([ring, wall]), faces)
    unwrap(max_shear=0.0)
    space, uv = scenes.areas(obj)
    assert (uv > 0).all()
    assert np.abs(uv / uv.sum() - space / space.sum()).sum() < 0.3
    values = {}
    for loop, value in zip(obj.data.loops, scenes.uv_of(obj).tolist(), strict=True):
        values.setdefault(loop.vertex_index, set()).add(tuple(value))
    assert all(len(v) == 1 for v in values.values())


def test_concave_polygon():
    outline = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (4, 3), (4, 4), (0, 4)]
    obj = scenes.add([(x, y, 0.2 * x * y) for x, y in outline], [range(8)])
    unwrap()
    assert (scenes.areas(obj)[1] > 0).all()


def test_loose_vertices_and_edges_are_left_alone():
    grid = scenes.bump()
    points = [tuple(v.co) for v in grid.data.vertices]
    faces = [tuple(p.vertices) for p in grid.data.polygons]
    bpy.data.objects.remove(grid)
    n = len(points)
    obj = scenes.add([*points, (9, 9, 9), (8, 8, 8), (7, 7, 7)], faces, edges=[(n, n + 1)])
    before = scenes.state(obj, leave_out={"UVMap"})
    unwrap()
    after = scenes.state(obj, leave_out={"UVMap"})
    before["layers"] = ["UVMap"]
    assert after == before


def test_an_object_without_faces_beside_others_is_passed_over():
    obj, wire = scenes.bump(), scenes.add([(0, 0, 0), (1, 0, 0)], [], "Wire", edges=[(0, 1)])
    unwrap()
    assert len(obj.data.uv_layers) == 1
    assert len(wire.data.uv_layers) == 0


def test_other_modifiers_do_not_matter():
    obj = scenes.bump()
    unwrap()
    expected = scenes.uv_of(obj)
    for kind in ("MIRROR", "ARRAY", "SOLIDIFY"):
        obj.modifiers.new(kind, kind)
    unwrap()
    assert (scenes.uv_of(obj) == expected).all()


def test_menus_show_the_operators_once():
    for name in ("IMAGE_MT_uvs_unwrap", "VIEW3D_MT_object"):
        functions = getattr(bpy.types, name).draw._draw_funcs
        assert sum(f.__name__ == "draw_menu" for f in functions) == 1
    uv_map = getattr(bpy.types.VIEW3D_MT_uv_map.draw, "_draw_funcs", [])
    # Since 4.5 this menu contains the one of the UV editor.
    assert sum(f.__name__ == "draw_menu" for f in uv_map) == (bpy.app.version < (4, 5, 0))


def test_poll_names_the_modes():
    scenes.bump()
    bpy.ops.object.mode_set(mode="SCULPT")
    assert not bpy.ops.uv.omt_unwrap.poll()
    assert "Object Mode" in scenes.error_of(bpy.ops.uv.omt_unwrap)


def ball(name="Ball"):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=12)
    bpy.context.object.name = name
    return bpy.context.object


def seams_of(obj):
    return {tuple(sorted(e.vertices)) for e in obj.data.edges if e.use_seam}


def test_what_was_cut_is_marked_only_on_request():
    obj = ball()
    unwrap()
    first = scenes.uv_of(obj)
    assert not seams_of(obj)
    unwrap(mark_seams=True)
    marked = seams_of(obj)
    assert marked and (scenes.uv_of(obj) == first).all()
    # Seams that are there now are followed, and not added to.
    unwrap(mark_seams=True, max_shear=1.05)
    assert seams_of(obj) == marked
    unwrap(mark_seams=True, max_shear=1.05, cut_further=True)
    assert seams_of(obj) > marked


def test_a_conformal_disk_with_its_centre_and_start_where_they_are_marked():
    obj = scenes.bump(columns=12, rows=12)
    for name, vertex in (("middle", 84), ("right", 90)):
        obj.vertex_groups.new(name=name).add([vertex], 1.0, "REPLACE")
    unwrap(kind="CONFORMAL", boundary="DISK", centre_group="middle", start_group="right", margin=0)
    places = {}
    for loop, uv in zip(obj.data.loops, scenes.uv_of(obj), strict=True):
        places[loop.vertex_index] = uv
    assert places[84] == pytest.approx([0.5, 0.5], abs=0.01) and places[90] == pytest.approx([1, 0.5], abs=0.01)
    before = scenes.state(obj)
    text = scenes.error_of(bpy.ops.uv.omt_unwrap, kind="POLAR", boundary="FREE")
    assert "convex domain" in text and scenes.state(obj) == before


@pytest.mark.parametrize("width", [0.05, 0.01])
def test_bevels_that_collapse_leave_the_faces_around_them_their_areas(width):
    # A blade: its bevel is as wide as half of it, so that strips along its whole length have no width.
    bpy.ops.mesh.primitive_cube_add(size=1, scale=(0.12, 0.02, 2))
    obj = bpy.context.object
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    obj.modifiers.new("bevel", "BEVEL").width = width
    obj.modifiers["bevel"].segments = 2
    bpy.ops.object.modifier_apply(modifier="bevel")
    space, uv = scenes.areas(obj)
    assert (space < 1e-6 * space.max()).any()
    unwrap()
    space, uv = scenes.areas(obj)
    assert np.abs(np.abs(uv) / np.abs(uv).sum() - space / space.sum()).sum() < 0.02
