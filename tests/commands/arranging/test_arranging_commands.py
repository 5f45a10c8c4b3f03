"""Islands are arranged and objects queued in files as in the tab; what fails is named, and the rest is written."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
import uv_scenes


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


@pytest.mark.parametrize("suffix", [".blend", ".obj"])
@pytest.mark.parametrize(
    "words", [["stack"], ["symmetrize", "--halves", "stacked"], ["rectify"]], ids=["stack", "symmetrize", "rectify"]
)
def test_islands_are_arranged_in_files(package, run, tmp_path, words, suffix):
    uv_scenes.patches()
    save(tmp_path / "in.blend")
    if suffix != ".blend":
        bpy.ops.wm.obj_export(filepath=str(tmp_path / f"in{suffix}"), export_materials=False)
    status, out, err = run(words[0], tmp_path / f"in{suffix}", "-o", tmp_path / f"out{suffix}", *words[1:])
    assert (status, out) == (0, ""), err
    (obj,) = package("files.meshes").load(tmp_path / f"out{suffix}")
    first, second = scenes.uv_of(obj).reshape(2, -1, 2)
    if words == ["rectify"]:
        assert len(np.unique(first[:, 0].round(4))) == 6 and len(np.unique(second[:, 1].round(4))) == 5
    else:
        assert np.allclose(np.ptp(first, axis=0), np.ptp(second, axis=0), atol=1e-4)
        assert np.allclose(first.mean(axis=0), second.mean(axis=0), atol=1e-3)


def test_mirror_images_are_left_apart_on_request(package, run, tmp_path):
    obj = uv_scenes.patches()
    for vertex in obj.data.vertices:
        # No longer its own mirror image, so that only the mirrored motion fits.
        vertex.co.z += 0.2 * abs(vertex.co.x) * vertex.co.y
    save(tmp_path / "in.blend")
    status, _, err = run("stack", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--no-mirrored")
    assert status == 0 and "No two islands have the same shape" in err


def test_without_uvs_or_grids_nothing_is_written(run, tmp_path):
    scenes.bump()
    save(tmp_path / "in.blend")
    for command in ("stack", "symmetrize", "rectify"):
        status, _, err = run(command, tmp_path / "in.blend", "-o", tmp_path / "out.blend")
        assert status == 1 and "no UVs" in err and len(err.splitlines()) == 1
    assert not (tmp_path / "out.blend").exists()


def test_a_queue_gives_each_its_own_texture_and_names_what_fails(package, run, tmp_path):
    scenes.bump(name="A"), scenes.bump(name="B", offset=3.0)
    save(tmp_path / "good.blend")
    words = ["--quality", "draft", "--strict"]
    assert run("queue", tmp_path / "good.blend", "-o", tmp_path / "out.blend", *words) == (0, "", "")
    for obj in package("files.meshes").load(tmp_path / "out.blend"):
        assert np.ptp(scenes.uv_of(obj), axis=0).max() > 0.9
    scenes.add([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)], "Flat")
    save(tmp_path / "in.blend")
    status, _, err = run("queue", tmp_path / "in.blend", "-o", tmp_path / "some.blend", "--quality", "draft")
    assert status == 7 and err.splitlines()[-1].startswith("omt_uv: error: Flat: ")
    found = {obj.name: obj for obj in package("files.meshes").load(tmp_path / "some.blend")}
    assert found["A"].data.uv_layers and not found["Flat"].data.uv_layers


@pytest.mark.parametrize("told", ["3 polygons are folded in the UVs", "2 % of the UV area is under several faces"])
def test_what_is_folded_or_covered_is_written_unless_it_is_not_to_be(package, run, tmp_path, monkeypatch, told):
    monkeypatch.setattr(package("pipelines.gate").Gate, "warnings", lambda *_: (told,))
    scenes.bump()
    save(tmp_path / "in.blend")
    words = ["queue", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--quality", "draft"]
    status, _, err = run(*words, "--strict")
    assert status == 1 and told in err and "Nothing was written" in err and not (tmp_path / "out.blend").exists()
    status, _, err = run(*words)
    assert status == 0 and told in err and (tmp_path / "out.blend").exists()


def test_a_time_limit_gives_one_up(run, tmp_path):
    scenes.bump(30, 30, name="Large")
    save(tmp_path / "in.blend")
    status, _, err = run("queue", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--limit", "1e-9")
    assert status == 1 and "Large: it took more than" in err
    assert not (tmp_path / "out.blend").exists()
