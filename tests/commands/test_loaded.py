"""What a file holds and Blender does not take: told in one line with counts, refused by `--strict`."""

from __future__ import annotations

import json
import struct

import bpy

import mesh_bytes
import numpy as np
import pytest
import scenes

N = 9
PLACE = np.array([4567890.12, 5123456.78, 321.0])


def patch():
    """A bumpy patch: positions (n,3) and triangles."""
    y, x = np.mgrid[0 : N + 1, 0 : N + 1]
    corner = (np.arange(N)[:, None] * (N + 1) + np.arange(N)).ravel()
    quads = np.stack([corner, corner + 1, corner + N + 2, corner + N + 1], 1)
    points = 0.37 * np.stack([x, y, np.sin(x / 3)], -1).reshape(-1, 3).astype(float)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def obj_text(points, faces, more=""):
    lines = ["v {:.12g} {:.12g} {:.12g}\n".format(*p) for p in points.tolist()]
    return "".join([*lines, *("f {} {} {}\n".format(*(f + 1)) for f in faces), more])


def ply_header(vertices, faces, kind):
    lines = ["ply", f"format {kind} 1.0", f"element vertex {vertices}", *(f"property float {a}" for a in "xyz")]
    return "\n".join([*lines, f"element face {faces}", "property list uchar int vertex_indices", "end_header\n"])


def ply_text(points, faces):
    lines = ["{:.12g} {:.12g} {:.12g}\n".format(*p) for p in points.tolist()]
    return ply_header(len(points), len(faces), "ascii") + "".join([*lines, *("3 {} {} {}\n".format(*f) for f in faces)])


def ply_binary(points, faces, declared=None):
    data = points.astype("<f4").tobytes() + b"".join(struct.pack("<B3i", 3, *f) for f in faces.tolist())
    return ply_header(len(points), declared or len(faces), "binary_little_endian").encode() + data


def off_text(points, faces):
    lines = ["{:.12g} {:.12g} {:.12g}\n".format(*p) for p in points.tolist()]
    return f"OFF\n{len(points)} {len(faces)} 0\n" + "".join([*lines, *("3 {} {} {}\n".format(*f) for f in faces)])


POINTS, FACES = patch()
OUTSIDE = np.concatenate([FACES, [[1, 2, 99_999]]])
INCOMPLETE = {
    "in.obj": (obj_text(POINTS, FACES, "f 1 2 9999\nf 1 2\n"), "2 of 164 faces were not read"),
    "in.ply": (ply_binary(POINTS, OUTSIDE), "1 of 163 faces was not read"),
    "huge.obj": (obj_text(POINTS, FACES, "v 1e39 0 0\nv 0 nan 0\n"), "2 of its vertices have coordinates beyond"),
    "nan.ply": (ply_text(np.concatenate([POINTS, [[np.nan, 0, 0]]]), FACES), "1 of its vertices"),
}


def write(path, data):
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


@pytest.mark.parametrize("name", INCOMPLETE)
def test_what_is_not_taken_is_told_with_counts_and_refused_by_strict(run, tmp_path, name):
    data, message = INCOMPLETE[name]
    write(tmp_path / name, data)
    words = ("unwrap", tmp_path / name, "-o", tmp_path / "out.blend", "--quality", "draft")
    status, _, err = run(*words, "--report", tmp_path / "r.json")
    assert status == 0 and len(err.splitlines()) == 1 and message in err
    assert message in json.loads((tmp_path / "r.json").read_text())["warnings"][0]
    (tmp_path / "out.blend").unlink()
    status, _, err = run(*words, "--strict")
    assert status == 1 and len(err.splitlines()) == 1 and message in err
    assert not (tmp_path / "out.blend").exists()


@pytest.mark.parametrize("name, data, message", [
    ("in.ply", ply_binary(POINTS[:3], FACES[:1], 10**9), "declares 1000000000"),
    ("in.ply", ply_binary(POINTS, FACES)[:900], "'vertex'"),
    ("in.ply", ply_header(-5, 3, "ascii").encode(), "declares -5"),
    ("in.stl", bytes(80) + struct.pack("<I", 10**9) + bytes(50), "declares 1000000000 faces and holds 1"),
    ("in.glb", b"glTF" + struct.pack("<II", 2, 10**9) + bytes(20), "declares 1000000000 bytes"),
    ("in.off", b"OFF\n-3 0 1 2\n", "declares -3 vertices"),
    ("in.off", b"OFF\n1000000000 5 0\n", "declares 1000000000 vertices"),
    ("in.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n0\n", "face 0 has fewer than three vertices"),
    ("in.off", b"OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "vertex 1 has fewer"),
    ("in.off", b"OFF\n\n", "no counts"),
])  # fmt: skip
def test_what_headers_declare_has_to_be_there(run, tmp_path, name, data, message):
    write(tmp_path / name, data)
    status, out, err = run("measure", tmp_path / name)
    assert (status, out) == (1, "") and len(err.splitlines()) == 1 and message in err


@pytest.mark.parametrize("place", ["Qobject", "Qmesh", "Qlayer", "Qgroup", "Qattribute", "Qmaterial", "Qscene"])
def test_names_that_are_no_text_are_refused(run, tmp_path, place):
    """A damaged byte in a name of a .blend: Blender reads it, Python cannot."""
    obj = scenes.add(POINTS.tolist(), FACES.tolist(), "Qobject")
    obj.data.name, bpy.context.scene.name = "Qmesh", "Qscene"
    obj.data.uv_layers.new(name="Qlayer")
    obj.vertex_groups.new(name="Qgroup")
    obj.data.attributes.new("Qattribute", "FLOAT", "POINT")
    obj.data.materials.append(bpy.data.materials.new("Qmaterial"))
    source = tmp_path / "in.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(source), compress=False)
    raw = source.read_bytes()
    assert place.encode() in raw
    source.write_bytes(raw.replace(place.encode(), b"Q\xd8" + place[2:].encode()))
    status, out, err = run("unwrap", source, "-o", tmp_path / "out.obj", "--quality", "draft")
    # Some names Blender mends itself.
    refused = bool(status) or place in ("Qobject", "Qlayer", "Qmaterial")
    assert (status, out) == (int(refused), "") and len(err.splitlines()) == status and ("no text" in err) == refused
    assert (tmp_path / "out.obj").exists() != refused


def test_attributes_of_a_ply_whose_names_are_no_text_are_refused(run, tmp_path):
    data = mesh_bytes.ply_bytes().replace(b"property float s\n", b"property float \xa7\n")
    write(tmp_path / "in.ply", data)
    status, out, err = run("unwrap", tmp_path / "in.ply", "-o", tmp_path / "out.ply", "--quality", "draft")
    assert (status, out) == (1, "") and len(err.splitlines()) == 1 and "no text" in err


def test_whole_files_are_read_without_a_word(run, tmp_path):
    faces = [POINTS[f].astype("<f4").tobytes() for f in FACES]
    stl = bytes(80) + struct.pack("<I", len(FACES)) + b"".join(bytes(12) + f + bytes(2) for f in faces)
    files = {"a.obj": obj_text(POINTS, FACES), "a.ply": ply_text(POINTS, FACES), "b.ply": ply_binary(POINTS, FACES),
             "a.off": off_text(POINTS, FACES), "a.stl": stl}  # fmt: skip
    for name, data in files.items():
        write(tmp_path / name, data)
        words = ("unwrap", tmp_path / name, "-o", tmp_path / "out.blend", "--quality", "draft", "--strict")
        assert run(*words) == (0, "", ""), name


@pytest.mark.parametrize("name, text", [("a.obj", obj_text), ("a.ply", ply_text), ("a.off", off_text)])
def test_coordinates_of_a_survey_keep_their_digits(package, run, tmp_path, name, text):
    write(tmp_path / name, text(POINTS + PLACE, FACES))
    write(tmp_path / "near.obj", obj_text(POINTS, FACES))
    status, _, err = run("unwrap", tmp_path / name, "-o", tmp_path / "out.blend", "--strict")
    assert status == 0 and "relative to (45678" in err and "up to 0.2" in err
    (obj,) = bpy.data.objects
    there = package("files.loaded").positions_of(obj.data).astype(float) + np.array(obj.location)
    assert np.abs(there - POINTS - PLACE).max() < 1e-6
    # The origin is in the middle, where single precision is finest.
    here = package("files.loaded").positions_of(obj.data)
    assert np.abs(here.min(axis=0) + here.max(axis=0)).max() < 1.0 < np.ptp(here, axis=0).max()
    uv = scenes.uv_of(obj)
    assert run("unwrap", tmp_path / "near.obj", "-o", tmp_path / "near.blend")[0] == 0
    assert np.abs(uv - scenes.uv_of(bpy.data.objects[0])).max() < 1e-4
    if name != "a.off":
        out = tmp_path / f"out{name[1:]}"
        assert run("unwrap", tmp_path / name, "-o", out, "--strict")[0] == 0
        assert "4567890.12 5123456.78 321" in out.read_text()
    # A format of single precision says what is lost.
    status, _, err = run("unwrap", tmp_path / name, "-o", tmp_path / "out.glb")
    assert status == 0 and "rounds coordinates by up to 0.2" in err
    assert run("unwrap", tmp_path / name, "-o", tmp_path / "out.glb", "--strict")[0] == 1


def two_scenes():
    scenes.bump(name="A")
    other = bpy.data.scenes.new("Other")
    obj = scenes.bump(name="B")
    for collection in obj.users_collection:
        collection.objects.unlink(obj)
    other.collection.objects.link(obj)


@pytest.mark.parametrize("active", ["First", "Middle", "Now"])
def test_objects_of_the_active_scene_come_first_and_then_those_of_the_others_by_name(package, tmp_path, active):
    """What is in several scenes comes once, where it is first."""
    first = bpy.context.scene
    first.name = "First"
    made = {"First": first} | {name: bpy.data.scenes.new(name) for name in ("Now", "Middle")}
    for name, scene in made.items():
        obj = scenes.bump(3, 2, name=f"In {name}")
        for collection in obj.users_collection:
            collection.objects.unlink(obj)
        scene.collection.objects.link(obj)
    shared = scenes.bump(3, 2, name="Shared")
    made["Middle"].collection.objects.link(shared)
    bpy.context.window.scene = made[active]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    found = [obj.name for obj in package("files.meshes").load(tmp_path / "in.blend")]
    order = [active, *(name for name in ("First", "Middle", "Now") if name != active)]
    own = {"First": ["In First", "Shared"], "Middle": ["In Middle", "Shared"], "Now": ["In Now"]}
    expected = list(dict.fromkeys(name for scene in order for name in own[scene]))
    assert found == expected


@pytest.mark.parametrize("words, done", [
    ((), "AB"), (("--scene", "Other"), "B"), (("--object", "A"), "A"), (("--object", "B", "--object", "A"), "AB"),
])  # fmt: skip
def test_all_scenes_are_done_or_those_and_objects_that_are_named(run, tmp_path, words, done):
    two_scenes()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.blend", *words)[0] == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert {obj.name for obj in bpy.data.objects if obj.data.uv_layers} == set(done)


@pytest.mark.parametrize("words, message", [
    (("--scene", "None"), "no scene 'None'. It has"), (("--object", "C"), "no mesh 'C'. It has A, B"),
    (("--scene", "Other", "--object", "A"), "no mesh 'A'. It has B"),
])  # fmt: skip
def test_names_that_are_not_there_are_told(run, tmp_path, words, message):
    two_scenes()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    for command in (("measure",), ("unwrap", "-o", tmp_path / "out.blend")):
        status, _, err = run(command[0], tmp_path / "in.blend", *command[1:], *words)
        assert status == 1 and len(err.splitlines()) == 1 and message in err
