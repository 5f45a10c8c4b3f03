"""Rich files through commands that change UVs: only UVs differ, byte by byte or property by property."""

from __future__ import annotations

import shutil

import bpy

import mesh_bytes
import numpy as np
import pytest
import scenes


def rigged_scene():
    """A skinned, animated body with a morph, colours and two materials, an instance of a cube, and all around them."""
    collection = bpy.context.scene.collection
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    low, high = (rig.data.edit_bones.new(name) for name in ("low", "high"))
    low.head, low.tail, high.head, high.tail = (0, 0, -1), (0, 0, 0), (0, 0, 0), (0, 0, 1)
    high.parent = low
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.mesh.primitive_cylinder_add(vertices=9, radius=0.5, depth=2)
    body = bpy.context.object
    body.name, body.parent = "Body", rig
    for name in ("Skin", "Cap"):
        body.data.materials.append(bpy.data.materials.new(name))
    for face in body.data.polygons:
        face.use_smooth, face.material_index = True, int(abs(face.normal.z) > 0.5)
    for name, sign in (("low", -1), ("high", 1)):
        group = body.vertex_groups.new(name=name)
        for vertex in body.data.vertices:
            group.add([vertex.index], 0.5 + sign * 0.4 * vertex.co.z, "REPLACE")
    body.modifiers.new("Rig", "ARMATURE").object = rig
    body.shape_key_add(name="Basis")
    for point in body.shape_key_add(name="Fat").data:
        point.co.x *= 2
    colours = body.data.color_attributes.new("Colour", "BYTE_COLOR", "CORNER")
    colours.data.foreach_set("color", np.tile([1.0, 0.5, 0.0, 1.0], len(body.data.loops)))
    bone = rig.pose.bones["high"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (10, 1.0)):
        bone.rotation_euler = (angle, 0, 0)
        bone.keyframe_insert("rotation_euler", frame=frame)
    box = scenes.cube("Box")
    twin = box.copy()
    box.location, twin.location, twin.name = (3, 0, 0), (6, 0, 0), "Twin"
    collection.objects.link(twin)
    for name, data in (
        ("Place", None),
        ("Lamp", bpy.data.lights.new("Lamp", "POINT")),
        ("Eye", bpy.data.cameras.new("Eye")),
    ):
        obj = bpy.data.objects.new(name, data)
        obj.location = (1, 2, 3)
        collection.objects.link(obj)


def curves(action):
    """The animation curves of an action: path, index, and points."""
    layers = getattr(action, "layers", ())
    found = [c for layer in layers for strip in layer.strips for bag in strip.channelbags for c in bag.fcurves]
    found = found or list(getattr(action, "fcurves", ()))
    points = {(c.data_path, c.array_index): [tuple(p.co) for p in c.keyframe_points] for c in found}
    return {key: np.round(values, 3).tolist() for key, values in sorted(points.items())}


def properties(curves_too):
    """Everything of the open session that a file of a rigged scene has, but UVs; FBX samples curves anew."""
    found = {}
    for obj in bpy.context.scene.objects:
        of = {
            "type": obj.type,
            "parent": obj.parent and obj.parent.name,
            "place": np.round(obj.matrix_world, 4).tolist(),
        }
        if obj.type == "MESH":
            mesh = obj.data
            # Corner by corner: glTF splits vertices.
            at = [loop.vertex_index for loop in mesh.loops]
            of |= {
                "co": [tuple(mesh.vertices[k].co) for k in at],
                "faces": [p.loop_total for p in mesh.polygons],
                "smooth": [p.use_smooth for p in mesh.polygons],
                "materials": [slot.material and slot.material.name for slot in obj.material_slots],
                "indices": [p.material_index for p in mesh.polygons],
                "groups": [g.name for g in obj.vertex_groups],
                "weights": [[(g.group, round(g.weight, 5)) for g in mesh.vertices[k].groups] for k in at],
                "keys": {
                    key.name: [tuple(key.data[k].co) for k in at]
                    for key in (mesh.shape_keys.key_blocks if mesh.shape_keys else ())
                },
                "colours": [[tuple(c.color) for c in a.data] for a in mesh.color_attributes],
                "modifiers": [m.type for m in obj.modifiers],
            }
        if obj.type == "ARMATURE":
            of["bones"] = {b.name: np.round([*b.head_local, *b.tail_local], 4).tolist() for b in obj.data.bones}
        found[obj.name] = of
    found["movement"] = movement()
    if curves_too:
        found["actions"] = [curves(action) for action in bpy.data.actions]
    return found


def movement():
    """Where the bones are at some frames."""
    places = []
    for frame in (1, 4, 10):
        bpy.context.scene.frame_set(frame)
        rig = bpy.data.objects["Rig"]
        places.append({bone.name: np.round(bone.matrix, 3).tolist() for bone in rig.pose.bones})
    return places


def opened(package, path):
    package("files.meshes").load(path)
    meshes = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    return properties(path.suffix != ".fbx"), {
        obj.name: scenes.uv_of(obj) if obj.data.uv_layers else None for obj in meshes
    }


def exporters():
    return {
        ".fbx": lambda path: bpy.ops.export_scene.fbx(filepath=path, add_leaf_bones=False, colors_type="LINEAR"),
        ".glb": lambda path: scenes.export_gltf(
            path, export_format="GLB", export_cameras=True, export_lights=True, export_extras=True
        ),
        ".gltf": lambda path: scenes.export_gltf(
            path, export_format="GLTF_SEPARATE", export_cameras=True, export_lights=True, export_extras=True
        ),
        ".blend": lambda path: bpy.ops.wm.save_as_mainfile(filepath=path, compress=True),
    }


@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf", ".blend"])
def test_a_rigged_scene_keeps_all_but_its_uvs(package, run, tmp_path, suffix):
    """D3: the rig, weights, morphs, empties, lights, cameras and actions were left out."""
    rigged_scene()
    path = tmp_path / f"in{suffix}"
    exporters()[suffix](str(path))
    before, old = opened(package, path)
    assert {"Rig", "Place", "Lamp", "Eye", "Twin"} <= set(before)
    magic = path.read_bytes()[:4]
    status, _, err = run("unwrap", path, "-o", tmp_path / f"out{suffix}", "--quality", "draft")
    assert status == 0
    assert "lost" not in err
    after, new = opened(package, tmp_path / f"out{suffix}")
    for name in before:
        assert after[name] == before[name], name
    assert set(after) == set(before)
    assert (old["Body"] != new["Body"]).any()
    assert (new["Box"] == new["Twin"]).all()
    if suffix == ".blend":
        # A compressed file stays one.
        assert (tmp_path / "out.blend").read_bytes()[:4] == magic


def test_workspaces_and_editors_of_a_blend_stay(run, tmp_path):
    """They were replaced by those of a new file: an artist's windows were gone after a run over the only copy."""
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True)
    first = bpy.data.workspaces[0].name
    bpy.data.workspaces[first].name = "Mine \u00e4\u00f6"
    bpy.data.workspaces["UV Editing"]["note"] = "kept"
    views = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]
    for view in views:
        if view.type == "VIEW_3D":
            view.clip_end = 12345
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "in.blend", "--quality", "draft")[0] == 0
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "in.blend"), load_ui=True)
    names = {workspace.name for workspace in bpy.data.workspaces}
    assert "Mine \u00e4\u00f6" in names and first not in names
    assert bpy.data.workspaces["UV Editing"]["note"] == "kept"
    views = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]
    assert {round(view.clip_end) for view in views if view.type == "VIEW_3D"} == {12345}


@pytest.mark.parametrize("target", [".glb", ".gltf", ".fbx"])
def test_all_that_a_format_holds_goes_along(package, run, tmp_path, target):
    """D3: rigs and shading got lost from .blend to glTF and FBX."""
    rigged_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    status, _, err = run("unwrap", tmp_path / "in.blend", "-o", tmp_path / f"out{target}", "--quality", "draft")
    assert status == 0
    # The box and its twin are cut along seams by hand.
    assert [line.split("left out: ")[1] for line in err.splitlines() if "left out" in line] == ["seams (2)"]
    found, _ = opened(package, tmp_path / f"out{target}")
    assert {"Rig", "Body", "Box", "Twin", "Place", "Lamp", "Eye"} <= set(found)
    assert set(found["Rig"]["bones"]) == {"low", "high"}
    assert set(found["Body"]["groups"]) == {"low", "high"}
    assert "Fat" in found["Body"]["keys"]
    assert all(found["Body"]["smooth"])
    assert not any(found["Box"]["smooth"]) or target == ".fbx"
    assert found["Body"]["colours"]
    assert found["movement"][0] != found["movement"][2]
    assert set(found["Body"]["materials"]) == {"Skin", "Cap"}


@pytest.mark.parametrize("target", [".obj", ".ply", ".stl"])
def test_what_a_format_does_not_hold_is_named(run, tmp_path, target):
    rigged_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    status, _, err = run("unwrap", tmp_path / "in.blend", "-o", tmp_path / f"out{target}", "--quality", "draft")
    assert status == 0
    (line,) = [line for line in err.splitlines() if "left out: " in line]
    for word in (
        "rigs (1)",
        "empties (1)",
        "lights (1)",
        "cameras (1)",
        "animations (1)",
        "shape keys (1)",
        "weights (1)",
    ):
        assert word in line
    assert ("materials" in line) == (target != ".obj")


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_a_new_uv_map_and_seams_that_a_file_does_not_hold_are_named(run, tmp_path, suffix):
    """A second UV map took the place of the only one of an .obj or .ply, and marks of seams went nowhere, unsaid."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    bpy.ops.object.select_all(action="SELECT")
    path = tmp_path / f"in{suffix}"
    if suffix == ".glb":
        scenes.export_gltf(path)
    else:
        getattr(bpy.ops.wm, f"{suffix[1:]}_export")(filepath=str(path))
    words = ("unwrap", path, "-o", tmp_path / f"out{suffix}", "--quality", "draft")
    assert "left out" not in run(*words)[2]
    status, _, err = run(*words, "--mark-seams", "--uv-layer", "New")
    assert status == 0
    (line,) = [line for line in err.splitlines() if "left out: " in line]
    assert "seams (1)" in line
    assert ("UV maps beside the one written (1)" in line) == (suffix != ".glb")


def write_rich_obj(folder):
    (folder / "in.obj").write_bytes(mesh_bytes.obj_bytes())
    materials = b"# by hand\r\nnewmtl red\r\nKd 1 0 0\r\nNs 33\r\nmap_Kd rel/x.png\r\nPr 0.3\r\nnewmtl unused\r\n"
    (folder / "some thing.mtl").write_bytes(materials)
    (folder / "in.mtl").write_bytes(b"somebody else's")
    return materials


def test_an_obj_in_place_keeps_its_materials_groups_and_colours(package, run, tmp_path):
    """D2, D4: the .mtl was written anew, an unrelated one overwritten, names of objects and groups and colours lost."""
    materials = write_rich_obj(tmp_path)
    before = (tmp_path / "in.obj").read_bytes()
    status, _, err = run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "in.obj", "--quality", "draft")
    assert status == 0, err
    assert "2 faces" in err
    after = (tmp_path / "in.obj").read_bytes()
    assert (tmp_path / "some thing.mtl").read_bytes() == materials
    assert (tmp_path / "in.mtl").read_bytes() == b"somebody else's"
    assert {path.name for path in tmp_path.iterdir()} == {"in.obj", "in.mtl", "some thing.mtl"}
    kept = [line for line in before.split(b"\n") if not line.lstrip().startswith((b"vt", b"f", b"-3"))]
    assert kept == [line for line in after.split(b"\n") if not line.lstrip().startswith((b"vt", b"f", b"-3"))]
    (obj,) = package("files.meshes").load(tmp_path / "in.obj")
    uv = scenes.uv_of(obj)
    assert np.ptp(uv, axis=0).max() > 0.5
    # In another folder, the file says what it misses.
    (tmp_path / "there").mkdir()
    status, _, err = run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "there" / "x.obj", "--quality", "draft")
    assert status == 0
    assert "some thing.mtl, which is not in its folder" in err


def test_the_mtl_of_another_obj_is_left_alone(run, tmp_path):
    """D2: from another format, the .mtl goes where no other one is."""
    scenes.cube().data.materials.append(bpy.data.materials.new("Red"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    (tmp_path / "out.mtl").write_text("other")
    status, _, err = run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.obj", "--quality", "draft")
    assert status == 0
    assert "out_1.mtl" in err
    assert (tmp_path / "out.mtl").read_text() == "other"
    assert "newmtl Red" in (tmp_path / "out_1.mtl").read_text()
    assert "mtllib out_1.mtl\n" in (tmp_path / "out.obj").read_text()
    # The same materials again are no others.
    shutil.copy(tmp_path / "out_1.mtl", tmp_path / "out.mtl")
    assert "out_1" not in run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.obj", "--quality", "draft")[2]


@pytest.mark.parametrize(
    "form, names",
    [("ascii", ("s", "t")), ("binary_little_endian", ()), ("binary_big_endian", ("s", "t")), ("ascii", ("u", "v"))],
)
def test_ply_keeps_its_form_and_gets_uvs_that_are_read_again(package, run, tmp_path, form, names):
    (tmp_path / "in.ply").write_bytes(mesh_bytes.ply_bytes(form, names))
    for source, target in (("in.ply", "out.ply"), ("in.ply", "out.blend"), ("out.ply", "again.ply")):
        status, _, err = run("unwrap", tmp_path / source, "-o", tmp_path / target, "--quality", "draft")
        assert status == 0, err
    assert f"format {form}".encode() in (tmp_path / "out.ply").read_bytes()
    assert b"comment made by hand" in (tmp_path / "out.ply").read_bytes()
    # Under whatever name they are.
    (obj,) = package("files.meshes").load(tmp_path / "out.ply")
    uv = scenes.uv_of(obj)
    (obj,) = package("files.meshes").load(tmp_path / "out.blend")
    assert (uv == scenes.uv_of(obj)).all()


@pytest.mark.parametrize(
    "command, suffix",
    [
        ("refine", ".obj"),
        ("refine", ".ply"),
        ("refine", ".glb"),
        ("sphere", ".obj"),
        ("sphere", ".ply"),
        ("sphere", ".glb"),
    ]
    + [("magnify", ".ply")],
)
def test_every_command_that_changes_uvs_changes_nothing_else(run, tmp_path, command, suffix):
    data = {".obj": mesh_bytes.obj_bytes(), ".ply": mesh_bytes.ply_bytes(corners=False), ".glb": mesh_bytes.glb_bytes()}
    (tmp_path / f"in{suffix}").write_bytes(data[suffix])
    assert run("unwrap", tmp_path / f"in{suffix}", "-o", tmp_path / f"a{suffix}", "--quality", "draft")[0] == 0
    more = {"magnify": ["--weights", "weight", "--source", "uv", "--factor", 1.5]}.get(command, [])
    # A globe needs a closed surface, which PLY has no more once it is cut.
    source = tmp_path / f"{'in' if command == 'sphere' else 'a'}{suffix}"
    status, _, err = run(command, source, "-o", tmp_path / f"b{suffix}", "--quality", "draft", *more)
    assert status == 0, err
    words = {".obj": b"# a cube", ".ply": b"comment made by hand", ".glb": b"ODD_one"}
    assert words[suffix] in (tmp_path / f"b{suffix}").read_bytes()


def test_gltf_of_text_in_another_folder_needs_nothing_from_the_old_one(package, run, tmp_path):
    text, raw = mesh_bytes.gltf_parts(indent=2)
    (tmp_path / "in.gltf").write_bytes(text)
    (tmp_path / "cu be.bin").write_bytes(raw)
    (tmp_path / "there").mkdir()
    for out in (tmp_path / "in.gltf", tmp_path / "there" / "out.gltf"):
        status, _, err = run("unwrap", tmp_path / "in.gltf", "-o", out, "--quality", "draft", "--strict")
        assert (status, err) == (0, "")
        assert (tmp_path / "cu be.bin").read_bytes() == raw
    (tmp_path / "cu be.bin").unlink()
    (obj,) = package("files.meshes").load(tmp_path / "there" / "out.gltf")
    assert np.ptp(scenes.uv_of(obj), axis=0).max() > 0.5
    status, _, err = run("unwrap", tmp_path / "in.gltf", "-o", tmp_path / "in.gltf")
    assert status == 1 and len(err.splitlines()) == 1 and "cu be.bin" in err


def test_compressed_gltf_is_written_anew_and_says_so(package, run, tmp_path):
    read = package("files.in_place.glb_data").read(mesh_bytes.glb_bytes())
    read.doc["extensionsUsed"] = ["EXT_meshopt_compression"]
    (tmp_path / "in.glb").write_bytes(package("files.in_place.glb_data").write(read))
    status, _, err = run("unwrap", tmp_path / "in.glb", "-o", tmp_path / "out.glb", "--quality", "draft")
    assert status == 0
    assert "EXT_meshopt_compression" in err
    assert "written anew" in err
    assert package("files.in_place.glb_data").read((tmp_path / "out.glb").read_bytes()).doc["meshes"]


def test_what_fbx_loses_is_counted(package, tmp_path):
    """By its records alone: of a rigged file, and of one that is cut anywhere."""
    rigged_scene()
    exporters()[".fbx"](str(tmp_path / "in.fbx"))
    data = (tmp_path / "in.fbx").read_bytes()
    found = package("files.fbx_nodes").count(data)
    meshes = {obj.data for obj in bpy.context.scene.objects if obj.type == "MESH"}
    assert found.vertices == sum(len(mesh.vertices) for mesh in meshes)
    assert found.corners == sum(len(mesh.loops) for mesh in meshes)
    assert found.kinds["Deformer Skin"] == 1
    assert found.kinds["Model Mesh"] == 3
    error = package("files.verified").FileError
    for raw in mesh_bytes.mutants(data, 60):
        try:
            package("files.fbx_nodes").count(raw)
        except error as told:
            assert str(told)
    for size in (0, 20, 30, len(data) // 3, len(data) // 2):
        with pytest.raises(error):
            package("files.fbx_nodes").count(data[:size])


def test_images_of_gltf_that_stay_behind_are_named(package, run, tmp_path):
    read = package("files.in_place.glb_data").read(mesh_bytes.glb_bytes())
    read.doc["images"].append({"uri": "far%20away.png"})
    (tmp_path / "in.glb").write_bytes(package("files.in_place.glb_data").write(read))
    (tmp_path / "there").mkdir()
    status, _, err = run("unwrap", tmp_path / "in.glb", "-o", tmp_path / "there" / "out.glb", "--quality", "draft")
    assert status == 0, err
    assert "far away.png, which is not in its folder" in err


@pytest.mark.parametrize("turn", [0.0, 0.004, 0.3, 1.5707963])
@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf", ".blend"])
def test_objects_stand_where_they_stood_also_next_to_the_axes(package, tmp_path, suffix, turn):
    scenes.open_empty()
    obj = scenes.bump(2, 2, name="A")
    obj.rotation_euler, obj.location = (0.0, turn, 0.0), (0.003, -2.0, 1.0 + turn)
    bpy.context.view_layer.update()
    points = np.array([obj.matrix_world @ v.co for v in obj.data.vertices])
    path = tmp_path / f"made{suffix}"
    if suffix == ".blend":
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    else:
        package("files.export").export(path, suffix, [obj], False)
    (again,) = package("files.meshes").load(path)
    bpy.context.view_layer.update()
    found = np.array([again.matrix_world @ v.co for v in again.data.vertices])
    order = [np.lexsort(np.round(x, 4).T) for x in (points, found)]
    np.testing.assert_allclose(found[order[1]], points[order[0]], atol=2e-5)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("turns", [1, 2, 3])
def test_an_fbx_of_what_stands_along_the_axes_gives_it_back_along_these(package, tmp_path, axis, turns):
    """Its reader turns to other axes and back, and rounds; what is whole is rounded to where it was."""
    scenes.open_empty()
    obj = scenes.bump(2, 2, name="A")
    obj.rotation_euler[axis], obj.location = turns * np.pi / 2, (1.0, -2.0, 3.0)
    bpy.context.view_layer.update()
    before = np.array(obj.matrix_world).round()
    package("files.export").export(tmp_path / "made.fbx", ".fbx", [obj], False)
    (again,) = package("files.meshes").load(tmp_path / "made.fbx")
    bpy.context.view_layer.update()
    np.testing.assert_allclose(np.array(again.matrix_world), before, atol=1e-6)
