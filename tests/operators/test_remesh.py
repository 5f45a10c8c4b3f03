"""New meshes beside the old one: what they carry, how they are called, and that the old one keeps every bit."""

from __future__ import annotations

import math

import bpy

import numpy as np
import pytest
from blender import scenes


def ball(name="Ball", rings=12, sectors=20, centre=(0.0, 0.0, 0.0)):
    """A closed sphere of quads and, at the poles, triangles."""
    polar = np.pi * np.arange(1, rings) / rings
    turn = 2 * np.pi * np.arange(sectors) / sectors
    t, p = (x.ravel() for x in np.meshgrid(turn, polar))
    points = np.stack([np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)], axis=1)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]]) + centre
    row, column = (x.ravel() for x in np.meshgrid(np.arange(rings - 2), np.arange(sectors), indexing="ij"))
    after = (column + 1) % sectors
    quads = np.stack([row * sectors + column, (row + 1) * sectors + column, (row + 1) * sectors + after,
                      row * sectors + after], axis=1)  # fmt: skip
    k, last, n = np.arange(sectors), (rings - 2) * sectors, len(points)
    north = np.stack([k, (k + 1) % sectors, np.full(sectors, n - 2)], axis=1)
    south = np.stack([last + (k + 1) % sectors, last + k, np.full(sectors, n - 1)], axis=1)
    return scenes.add(points, [*quads.tolist(), *north.tolist(), *south.tolist()], name)


def arrays(obj):
    mesh = obj.data
    co = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", co)
    faces = np.zeros(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", faces)
    return co.reshape(-1, 3).astype(float), faces.reshape(-1, 3)


def values(mesh, name, key="value", width=1):
    attribute = mesh.attributes[name]
    out = np.zeros(len(attribute.data) * width, np.float32)
    attribute.data.foreach_get(key, out)
    return out if width == 1 else out.reshape(-1, width)


def fill(mesh, name, kind, domain, data, key="value"):
    attribute = mesh.attributes.new(name, kind, domain)
    attribute.data.foreach_set(key, np.ascontiguousarray(data).ravel())


def made(before):
    return [obj for obj in bpy.data.objects if obj not in before]


def remesh(**arguments):
    before = set(bpy.data.objects)
    assert bpy.ops.object.omt_remesh(**arguments) == {"FINISHED"}
    return made(before)


def dressed(name="Dressed"):
    """A bumpy patch that carries something of every kind."""
    obj = scenes.bump(14, 12, name=name)
    mesh, n = obj.data, len(obj.data.vertices)
    co, corner = np.zeros(3 * n, np.float32), np.array([loop.vertex_index for loop in obj.data.loops])
    mesh.vertices.foreach_get("co", co)
    co = co.reshape(-1, 3)
    scenes.set_uv(obj, co[corner][:, :2])
    scenes.set_uv(obj, 1 - co[corner][:, :2], "Second")
    mesh.uv_layers.active = mesh.uv_layers["Second"]
    mesh.uv_layers["UVMap"].active_render = True
    fill(mesh, "height", "FLOAT", "POINT", co[:, 2])
    fill(mesh, "where", "FLOAT_VECTOR", "POINT", co, "vector")
    fill(mesh, "index", "INT", "POINT", np.arange(n, dtype=np.int32))
    fill(mesh, "left", "BOOLEAN", "POINT", co[:, 0] < 0.5)
    fill(mesh, "part", "INT", "FACE", np.arange(len(mesh.polygons), dtype=np.int32))
    fill(mesh, "edge thing", "FLOAT", "EDGE", np.ones(len(mesh.edges), np.float32))
    tint = np.concatenate([co[:, :2], np.zeros((n, 1)), np.ones((n, 1))], axis=1).astype(np.float32)
    fill(mesh, "tint", "FLOAT_COLOR", "POINT", tint, "color")
    fill(mesh, "paint", "BYTE_COLOR", "CORNER", tint[corner], "color")
    mesh.attributes.active_color_name = "paint"
    mesh.attributes.default_color_name = "tint"
    for name in ("red", "blue"):
        mesh.materials.append(bpy.data.materials.new(name))
    index = (co[corner].reshape(-1, 4, 3)[:, :, 0].mean(axis=1) > 0.5).astype(np.int32)
    mesh.polygons.foreach_set("material_index", index)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(index), bool))
    group = obj.vertex_groups.new(name="slope")
    obj.vertex_groups.new(name="empty")
    for k, x in enumerate(co[:, 0].tolist()):
        group.add([k], x, "REPLACE")
    obj.shape_key_add(name="Basis")
    for name, shift in (("Up", (0, 0, 1)), ("Wide", (1, 0, 0))):
        key = obj.shape_key_add(name=name)
        key.data.foreach_set("co", (co + np.array(shift, np.float32) * co[:, :1]).ravel())
        key.value = 0.25
    mesh.shape_keys.key_blocks["Wide"].relative_key = mesh.shape_keys.key_blocks["Up"]
    mesh.update()
    return obj


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
    rows = dict(package("last_run").state.summary.rows)
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


def test_faces_that_look_the_other_way_are_turned_in_the_new_mesh_alone(capfd):
    obj = ball(rings=24, sectors=40)
    corner = np.array([loop.vertex_index for loop in obj.data.loops])
    co = np.array([v.co for v in obj.data.vertices])
    for k in (5, 77, 200, 300):
        obj.data.polygons[k].flip()
    corner = np.array([loop.vertex_index for loop in obj.data.loops])
    fill(obj.data, "at", "FLOAT_VECTOR", "CORNER", co[corner].astype(np.float32), "vector")
    before = scenes.state(obj)
    (new,) = remesh(target_vertices=500)
    assert scenes.state(obj) == before
    assert "4 faces look to another side" in capfd.readouterr().out
    co, faces = arrays(new)
    volume = np.einsum("fj,fj->f", co[faces[:, 0]], np.cross(co[faces[:, 1]], co[faces[:, 2]]))
    assert (volume > 0).all()
    assert np.abs(values(new.data, "at", "vector", 3) - co[faces.ravel()]).max() < 0.02


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


@pytest.fixture
def run(package, capfd):
    """Run the command in this process: exit status, standard output, standard error."""

    def command(*arguments):
        capfd.readouterr()
        status = package("cli").main([str(a) for a in arguments])
        return status, *capfd.readouterr()

    return command


def write_ball(path):
    obj = ball(centre=(1.0, 2.0, 3.0))
    co = [tuple(v.co) for v in obj.data.vertices]
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in co]
    lines += ["f " + " ".join(str(i + 1) for i in p.vertices) for p in obj.data.polygons]
    path.write_text("\n".join(lines) + "\n")


def read_points(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    return np.array([list(map(float, line[1:4])) for line in lines if line[:1] == ["v"]])


def test_command_writes_the_new_mesh_alone_in_the_coordinates_of_the_input(run, tmp_path):
    write_ball(tmp_path / "in.obj")
    status, _, err = run("remesh", tmp_path / "in.obj", "-o", tmp_path / "out.obj", "--vertices", 200)
    assert (status, err) == (0, "")
    points = read_points(tmp_path / "out.obj")
    assert len(points) == 200
    assert np.abs(np.linalg.norm(points - [1, 2, 3], axis=1) - 1).max() < 0.1


def test_command_writes_a_file_for_every_level(run, tmp_path):
    write_ball(tmp_path / "in.obj")
    status, _, err = run(
        "remesh", tmp_path / "in.obj", "-o", tmp_path / "o.obj", "--faces", 400, "--levels", 3, "--ratio", 0.5
    )
    assert (status, err) == (0, "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in.obj", "o_LOD0.obj", "o_LOD1.obj", "o_LOD2.obj"]
    # A closed surface has two vertices more than half of its triangles.
    assert [len(read_points(tmp_path / f"o_LOD{k}.obj")) for k in range(3)] == [202, 102, 52]


def test_command_writes_both_objects_to_a_blend_file(run, tmp_path):
    write_ball(tmp_path / "in.obj")
    status, _, _ = run("remesh", tmp_path / "in.obj", "-o", tmp_path / "out.blend", "--edge", 0.3)
    assert status == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert {obj.name for obj in bpy.data.objects} == {"in", "in_remesh"}


@pytest.mark.parametrize("arguments, words", [
    ([], "--vertices --faces --edge"),
    (["--vertices", 100, "--faces", 200], "not allowed with"),
    (["--vertices", 0], "a number above 0"),
    (["--vertices", 3], "at least"),
    (["--edge", "nan"], "a number above 0"),
    (["--vertices", 100, "--density", "nowhere"], "no vertex group 'nowhere'"),
    (["--vertices", 100, "--levels", 2, "--ratio", 1.5], "between 0 and 1"),
])  # fmt: skip
def test_command_says_what_is_wrong_with_its_arguments(run, tmp_path, arguments, words):
    write_ball(tmp_path / "in.obj")
    status, _, err = run("remesh", tmp_path / "in.obj", "-o", tmp_path / "out.obj", *arguments)
    assert status != 0
    assert words in err
    assert not (tmp_path / "out.obj").exists()


def test_glb_is_joined_where_the_format_had_to_split_it(run, tmp_path):
    """A file of this format has a vertex for every UV; the new mesh must not come apart along the seams."""
    obj = scenes.cube()
    bpy.ops.uv.omt_unwrap()
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "in.glb"), export_format="GLB", use_selection=True)
    assert obj.name == "Cube"
    status, _, _ = run("remesh", tmp_path / "in.glb", "-o", tmp_path / "out.blend", "--vertices", 300, "--sharp")
    assert status == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    mesh = bpy.data.objects["Cube_remesh"].data
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == 2


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
