"""partition on the command line: what the operator makes, reports, and files that do not keep it."""

from __future__ import annotations

import json
from dataclasses import replace

import bpy

import numpy as np
import pytest
import scenes


def ball(path):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    bpy.context.object.name = "Ball"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return bpy.context.object


def test_the_command_writes_what_the_operator_writes(run, tmp_path):
    obj = ball(tmp_path / "in.blend")
    assert bpy.ops.mesh.omt_partition(cells=12, write="ATTRIBUTE") == {"FINISHED"}
    expected = [item.value for item in obj.data.attributes["OMT Cell"].data]
    words = ["partition", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--cells", 12, "--write", "attribute"]
    status, out, err = run(*words, "--report", tmp_path / "r.json")
    assert (status, err) == (0, "") and out.startswith("Ball: 12 cells, largest error of an area ")
    assert [item.value for item in bpy.data.objects["Ball"].data.attributes["OMT Cell"].data] == expected
    report = json.loads((tmp_path / "r.json").read_text())
    (mesh,) = report["meshes"]
    assert mesh["object"] == "Ball" and mesh["error"] < 1e-3 and mesh["least_distance"] > 0.75


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_a_cut_mesh_goes_into_any_file(package, run, tmp_path, suffix):
    ball(tmp_path / "in.blend")
    words = ["--cells", 5, "--write", "mesh", "--relax", 1]
    status, _, err = run("partition", tmp_path / "in.blend", "-o", tmp_path / f"out{suffix}", *words)
    assert status == 0, err
    (obj,) = package("files.meshes").load(tmp_path / f"out{suffix}")
    assert sum(p.area for p in obj.data.polygons) == pytest.approx(12.3, rel=0.02)


def test_points_go_into_files_of_points(run, tmp_path):
    ball(tmp_path / "in.blend")
    words = ["partition", tmp_path / "in.blend", "--cells", 9, "--write", "points", "-o"]
    assert run(*words, tmp_path / "out.obj")[0] == 0
    assert sum(line.startswith("v ") for line in (tmp_path / "out.obj").read_text().splitlines()) == 9
    assert "points are kept by .blend .obj alone" in run(*words, tmp_path / "out.ply")[2]


def test_files_that_do_not_keep_cells_are_refused(run, tmp_path):
    ball(tmp_path / "in.blend")
    for write, words in (("face_sets", "face sets are kept by .blend"), ("seams", "seams are kept by .blend")):
        arguments = ["-o", tmp_path / "out.obj", "--cells", 4, "--write", write]
        status, out, err = run("partition", tmp_path / "in.blend", *arguments)
        assert status == 1 and out == "" and words in err and len(err.splitlines()) == 1
    assert run("partition", tmp_path / "in.blend", "-o", tmp_path / "o.blend", "--cells", 4, "--relax", -1)[0] == 2
    assert {path.name for path in tmp_path.iterdir()} == {"in.blend"}


def test_capacities_follow_a_group(run, tmp_path):
    obj = scenes.bump()
    right = [v.index for v in obj.data.vertices if v.co.x > 0.5]
    obj.vertex_groups.new(name="dark").add(right, 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    words = ["--cells", 20, "--write", "points", "--capacity", "dark"]
    assert run("partition", tmp_path / "in.blend", "-o", tmp_path / "out.blend", *words)[0] == 0
    points = [v.co.x for v in bpy.data.objects["Bump_points"].data.vertices]
    assert np.mean(np.array(points) > 0.45) > 0.9
    status, _, err = run("partition", tmp_path / "in.blend", "-o", tmp_path / "x.blend", *words[:-1], "light")
    assert status == 1 and "no vertex group 'light'" in err


@pytest.mark.parametrize("chosen", [(), (0,), (1,), (2,), (0, 2)], ids=str)
def test_warnings_name_the_object_that_they_are_about(package, run, tmp_path, monkeypatch, chosen):
    module = package("pipelines.shapes.partition")
    for k in range(3):
        scenes.bump(3, 2, name="ABC"[k], offset=2.0 * k)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    true, asked = module.partition_surface, []

    def partition_surface(*given):
        found = yield from true(*given)
        asked.append(len(asked))
        told = (f"number {asked[-1]} is torn",) if asked[-1] in chosen else ()
        return replace(found, warnings=told)

    monkeypatch.setattr(module, "partition_surface", partition_surface)
    words = ["partition", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--cells", 2, "--relax", 0]
    status, out, err = run(*words, "--write", "attribute", "--report", tmp_path / "r.json")
    assert status == 0, err
    told = [f"{'ABC'[k]}: number {k} is torn" for k in chosen]
    assert [line.partition("warning: ")[2] for line in err.splitlines()] == told
    assert json.loads((tmp_path / "r.json").read_text())["warnings"] == told
    assert [line.partition(":")[0] for line in out.splitlines()] == list("ABC")
