"""What is lost on the way into a file is told, and nothing else is; reasons of exporters are one line."""

from __future__ import annotations

import json

import bpy

import mesh_bytes
import numpy as np
import pytest
import scenes
from fbx_bytes import file_of, make, scene, text


@pytest.fixture
def saving(package):
    return package("files.saving")


def patch():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    obj = scenes.add(points, [[0, 1, 2, 3]], "Patch")
    scenes.set_uv(obj, points[:, :2])
    return obj


@pytest.mark.parametrize("suffix", [".fbx", ".obj", ".ply"])
@pytest.mark.parametrize("source", ["before.fbx", "before.obj", None])
def test_only_of_an_fbx_that_becomes_one_is_told_what_blender_does_not_read(saving, tmp_path, suffix, source):
    obj, path = patch(), tmp_path / f"out{suffix}"
    if source:
        # A text, of which nobody knows what it holds.
        (tmp_path / source).write_bytes(b"; FBX 7.4.0 project file\n")
    told = saving._save_anew(path, [obj], True, tmp_path / source if source else None)
    assert path.stat().st_size > 100
    lost = "What Blender does not read of an FBX file is lost"
    assert told.count(lost) == (suffix == ".fbx" and source == "before.fbx")
    assert all("left out" in line for line in told if line != lost)


def test_kinds_that_are_lost_are_counted(saving, tmp_path):
    before, after = tmp_path / "a.fbx", tmp_path / "b.fbx"
    records = scene(False)
    curves = [make(False, "AnimationCurve", [text(b"c"), text(b"")]) for _ in range(3)]
    before.write_bytes(file_of(False, [*records[:1], records[1], make(False, "Objects", [], curves)]))
    after.write_bytes(file_of(False, [make(False, "Objects", [], [make(False, "Model", [text(b"m"), text(b"Mesh")])])]))
    (told,) = saving._lost_kinds(before, after)
    lost = told.partition("lost: ")[2].split(", ")
    assert sorted(lost) == ["Geometry Mesh (2)", "Geometry Shape (1)", "Model Mesh (1)"]
    assert saving._lost_kinds(before, before) == [] == saving._lost_kinds(after, before)


def test_reasons_are_the_last_line_that_says_something(saving):
    error = RuntimeError("Traceback (most recent call last):\n  File x\nError: No room\nLocation: /a/b:1\nINFO done\n")
    assert saving._reason(error) == "No room"
    assert saving._reason(RuntimeError("\n")) == "cannot be written"


@pytest.mark.parametrize("text, told", [
    ("Traceback\n  File x\nbinascii.Error: Incorrect padding\nLocation: /a/b:1\n", "Blender's reader fails on it (b"),
    ("Error: Bad GLB: no\n", "Bad GLB: no"), ("GLB: Error: 3", "GLB: Error: 3"), ("\n", "cannot be read"),
])  # fmt: skip
def test_errors_of_blenders_own_programs_are_told_as_theirs(package, text, told):
    found = package("files.meshes")._why(text)
    assert found.startswith(told) and "\n" not in found and ("damaged" in found) == ("reader" in told)


def test_a_reader_that_fails_is_one_line_about_the_file(package, tmp_path):
    path = tmp_path / "a.gltf"
    data, _ = mesh_bytes.gltf_parts(embedded=True)
    at = data.index(b"base64,") + 20
    path.write_bytes(data[:at] + data[at + 1 :])
    with pytest.raises(package("files.verified").FileError, match=r"a\.gltf: Blender's reader fails on it"):
        package("files.meshes").load(path)


def test_what_a_file_names_and_is_not_beside_it_is_told(saving, tmp_path):
    source, path = tmp_path / "in" / "a.obj", tmp_path / "out" / "a.obj"
    for folder in (source.parent, path.parent):
        folder.mkdir()
    data = b"mtllib a.mtl\n  mtllib b c.mtl \nmtllib\nmtllib a.mtl\n# mtllib d.mtl\nv 0 0 0\n"
    assert saving._left_behind(data, ".obj", source, source) == []
    told = saving._left_behind(data, ".obj", source, path)
    assert [line.split(" names ")[1].split(",")[0] for line in told] == ["a.mtl", "b c.mtl"]
    (path.parent / "a.mtl").write_bytes(b"")
    assert len(saving._left_behind(data, ".obj", source, path)) == 1
    assert saving._left_behind(data, ".ply", source, path) == []
    doc = {"images": [{"uri": "b%20c.png"}, {"uri": "data:image/png;base64,"}, {"bufferView": 0}, {"uri": "d.png"}]}
    told = saving._left_behind(json.dumps(doc).encode(), ".gltf", source.with_suffix(".gltf"), path)
    assert [line.split(" names ")[1].split(",")[0] for line in told] == ["b c.png", "d.png"]


@pytest.mark.parametrize(
    "begin, compressed", [(b"BLENDER-v404", False), (b"(\xb5/\xfd....", True), (b"\x1f\x8b\x08\x00", True)]
)
def test_compressed_files_are_known_by_their_first_bytes(saving, tmp_path, begin, compressed):
    path = tmp_path / "a.blend"
    path.write_bytes(begin)
    assert saving._is_compressed(path) == compressed


def test_a_mesh_is_handed_on_as_blender_holds_it(saving):
    obj = patch()
    scenes.set_uv(obj, 2 * np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]))
    found = saving._imported(obj)
    np.testing.assert_array_equal(found.positions, [list(v.co) for v in obj.data.vertices])
    assert found.corner_vertex.tolist() == [loop.vertex_index for loop in obj.data.loops]
    assert found.face_start.tolist() == [*(p.loop_start for p in obj.data.polygons), len(obj.data.loops)]
    assert found.layer == obj.data.uv_layers.active_index and len(found.layers) == len(obj.data.uv_layers)


@pytest.mark.parametrize("everything", [False, True])
@pytest.mark.parametrize("name", ["plain", "ü", "b\udce9"])
def test_a_blend_of_any_name_becomes_an_fbx_with_its_images(package, tmp_path, name, everything):
    """Blender's exporter ended with an error of Python where the name of the .blend was not UTF-8."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj, image = patch(), bpy.data.images.new("wood", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "wood.png"), "PNG"
    image.save()
    material = bpy.data.materials.new("Wood")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Principled BSDF"].inputs[0])
    obj.data.materials.append(material)
    plain = tmp_path / "in.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(plain))
    image.filepath = "//wood.png"
    bpy.ops.wm.save_as_mainfile(filepath=str(plain))
    plain.with_suffix(".blend1").unlink(missing_ok=True)
    given = plain.rename(tmp_path / f"{name}.blend")
    before = given.read_bytes()
    bpy.ops.wm.open_mainfile(filepath=str(given))
    out = tmp_path / "out.fbx"
    package("files.export").export(out, ".fbx", [bpy.data.objects["Patch"]], everything)
    assert given.read_bytes() == before and set(tmp_path.iterdir()) == {given, out, tmp_path / "wood.png"}
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    (again,) = package("files.meshes").load(out)
    assert len(again.data.polygons) == 1 and again.data.materials[0].name == "Wood"
    (found,) = (image for image in bpy.data.images if image.source == "FILE")
    assert bpy.path.abspath(found.filepath).endswith("wood.png") and tuple(found.size) == (4, 4)
