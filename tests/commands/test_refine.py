"""refine on the command line: better areas in every format, pins and layers, refusals."""

from __future__ import annotations

import json

import bpy

import pytest
import scenes
from uv_scenes import plain, ring


@pytest.mark.parametrize("suffix", [".blend", ".obj", ".ply", ".glb"])
def test_command(package, run, tmp_path, suffix):
    ring()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    if suffix != ".blend":
        status, _, err = run("refine", tmp_path / "in.blend", "-o", tmp_path / f"in{suffix}", "--balance", "1")
        assert status == 0, err
    report = tmp_path / "r.json"
    status, out, err = run("refine", tmp_path / f"in{suffix}", "-o", tmp_path / f"out{suffix}", "--report", report)
    assert (status, out) == (0, ""), err
    told = json.loads(report.read_text())
    (island,) = told["charts"]
    assert island["area_l1"] < 0.01 < island["before"]["area_l1"]
    assert (island["folds"], island["faces"] in (120, 240)) == (0, True)
    status, out, _ = run("measure", tmp_path / f"out{suffix}", "--json")
    figures = json.loads(out)
    assert figures["area_l1"] == pytest.approx(island["area_l1"], abs=1e-4)
    assert figures["folds"] == 0


def test_command_keeps_what_is_pinned_and_names_layers(package, run, tmp_path):
    obj = plain()
    pinned, before = scenes.pin(obj, {0, 8, 54, 62}), scenes.uv_of(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    for command in ("refine", "unwrap"):
        assert run(command, tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--uv-layer", "UVMap")[0] == 0
        (obj,) = package("files.meshes").load(tmp_path / "out.blend")
        assert scenes.uv_of(obj)[pinned].tobytes() == before[pinned].tobytes()
    status, _, err = run("refine", tmp_path / "in.blend", "-o", tmp_path / "no.blend", "--uv-layer", "None")
    assert status == 1
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "no.blend").exists()


def test_command_without_uvs(run, tmp_path):
    scenes.bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    status, _, err = run("refine", tmp_path / "in.blend", "-o", tmp_path / "out.blend")
    assert status == 1
    assert "no UVs" in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "out.blend").exists()
