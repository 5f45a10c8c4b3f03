"""`remesh` on the command line: every format, what it refuses, and that the input stays."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from remesh_scenes import arrays, ball, fill, read_points, write_ball


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", ".fbx"])
def test_every_format_holds_the_levels_in_the_coordinates_of_the_input(package, run, tmp_path, suffix):
    write_ball(tmp_path / "in.obj")
    before = (tmp_path / "in.obj").read_bytes()
    status, out, err = run(
        "remesh", tmp_path / "in.obj", "-o", tmp_path / f"o{suffix}", "--vertices", 160, "--levels", 2, "--ratio", 0.5
    )
    assert (status, out) == (0, "")
    assert len(err.splitlines()) == (suffix == ".stl")
    assert (tmp_path / "in.obj").read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {"in.obj", f"o_LOD0{suffix}", f"o_LOD1{suffix}"}
    for level, count in enumerate((160, 80)):
        (obj,) = package("files.meshes").load(tmp_path / f"o_LOD{level}{suffix}")
        co, _ = arrays(obj)
        assert len(co) == count
        assert np.abs(np.linalg.norm(co - [1, 2, 3], axis=1) - 1).max() < 0.15


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_what_a_format_had_to_split_at_uv_seams_is_whole_again(package, run, tmp_path, suffix):
    write_ball(tmp_path / "in.obj")
    assert run("unwrap", tmp_path / "in.obj", "-o", tmp_path / f"split{suffix}")[0] == 0
    status, _, err = run("remesh", tmp_path / f"split{suffix}", "-o", tmp_path / "out.obj", "--vertices", 160)
    assert status == 0 and "Merge by Distance" not in err
    (obj,) = package("files.meshes").load(tmp_path / "out.obj")
    assert len(obj.data.vertices) - len(obj.data.edges) + len(obj.data.polygons) == 2


def test_an_attribute_gives_the_density_where_no_group_has_its_name(run, tmp_path):
    obj = ball(rings=24, sectors=40)
    z = np.array([v.co.z for v in obj.data.vertices])
    fill(obj.data, "fine", "FLOAT", "POINT", np.where(z > 0, 4, 1).astype(np.float32))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    arguments = ["--vertices", 800, "--density", "fine", "--no-attributes"]
    assert run("remesh", tmp_path / "in.blend", "-o", tmp_path / "out.obj", *arguments)[0] == 0
    z = read_points(tmp_path / "out.obj")[:, 2]
    assert (z > 0.3).sum() / (z < -0.3).sum() == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize("arguments, status", [
    (["--vertices", 100, "--levels", 0], 2),
    (["--vertices", 100, "--grading", -1], 2),
    (["--vertices", "many"], 2),
    (["--edge", "inf"], 2),
    (["--vertices", 100, "--density", "curvature", "--factor", -1], 1),
])  # fmt: skip
def test_statuses_tell_options_from_meshes(run, tmp_path, arguments, status):
    write_ball(tmp_path / "in.obj")
    found, out, err = run("remesh", tmp_path / "in.obj", "-o", tmp_path / "out.obj", *arguments)
    assert (found, out) == (status, "")
    assert "error: " in err.splitlines()[-1]
    assert [p.name for p in tmp_path.iterdir()] == ["in.obj"]


@pytest.mark.parametrize("name, more", [("in.obj", []), ("in_LOD1.obj", ["--levels", 2])])
def test_the_input_is_never_replaced(run, tmp_path, name, more):
    write_ball(tmp_path / name)
    before = (tmp_path / name).read_bytes()
    status, _, err = run("remesh", tmp_path / name, "-o", tmp_path / "in.obj", "--vertices", 100, *more)
    assert status == 2
    assert "replace the input" in err
    assert (tmp_path / name).read_bytes() == before


def test_a_blend_keeps_the_old_object_as_it_was(run, tmp_path):
    obj = ball()
    obj.scale = (1, 2, 1)
    bpy.context.view_layer.update()
    before = scenes.state(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    command = ["remesh", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--faces", 200, "--levels", 2]
    assert run(*command)[0] == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert {obj.name for obj in bpy.data.objects} == {"Ball", "Ball_LOD0", "Ball_LOD1"}
    assert scenes.state(bpy.data.objects["Ball"]) == before


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
    (["--vertices", 0], "not a number from 1"),
    (["--vertices", 3], "at least"),
    (["--edge", "nan"], "not a finite number"),
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
    scenes.export_gltf(tmp_path / "in.glb", export_format="GLB", use_selection=True)
    assert obj.name == "Cube"
    status, _, _ = run("remesh", tmp_path / "in.glb", "-o", tmp_path / "out.blend", "--vertices", 300, "--sharp")
    assert status == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    mesh = bpy.data.objects["Cube_remesh"].data
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == 2


def test_a_preview_of_a_series_shows_the_coarsest_of_every_object(run, package, tmp_path, monkeypatch):
    for k, name in enumerate("AB"):
        scenes.bump(3, 2, name=name, offset=2.0 * k)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    shown = []
    monkeypatch.setattr(package("commands.remesh"), "write_preview", lambda _, pairs: shown.extend(pairs))
    words = ["remesh", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--preview", tmp_path / "p.png"]
    assert run(*words, "--vertices", 24, "--levels", 2, "--no-attributes")[0] == 0
    found = {obj.name: (len(obj.data.vertices), len(reading.surface.positions)) for obj, reading in shown}
    assert [name[0] for name in found] == ["A", "B"] and all(one == other for one, other in found.values())
    fewest = {
        letter: min(len(obj.data.vertices) for obj in bpy.data.objects if obj.name.startswith(f"{letter}_"))
        for letter in "AB"
    }
    assert [count for count, _ in found.values()] == list(fewest.values())
