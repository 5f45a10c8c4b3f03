"""What commands write comes whole or not at all, and never over something else."""

from __future__ import annotations

import json
import os
import stat

import bpy

import numpy as np
import pytest
import scenes
from small_disks import small_disk

FORMATS = [".blend", ".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx"]
OFF = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n"


# The map does not matter here: cutting the grid by a bound of its shear would take ten seconds.
PLAIN = ("--quality", "draft", "--max-shear", "0")


def big_input(path):
    """A grid that takes more than 60 kB in every format."""
    y, x = np.mgrid[0:40, 0:40]
    points = np.stack([x, y, np.sin(x) + np.cos(y)], axis=-1).reshape(-1, 3)
    corner = (y[:-1, :-1] * 40 + x[:-1, :-1]).ravel()
    scenes.add(points.tolist(), np.stack([corner, corner + 1, corner + 41, corner + 40], axis=1).tolist())
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


@pytest.mark.parametrize("target", FORMATS)
def test_a_full_disk_leaves_the_old_file_whole(run, tmp_path, target):
    """D1: exporters that do not look left a truncated file, with status 0."""
    big_input(tmp_path / "in.blend")
    out = tmp_path / f"out{target}"
    out.write_bytes(b"the only copy")
    with small_disk(40_000):
        status, _, err = run("unwrap", tmp_path / "in.blend", "-o", out, *PLAIN)
    assert status == 1, err
    assert len(err.splitlines()) == 1
    assert str(out) in err
    assert "Location" not in err
    assert out.read_bytes() == b"the only copy"
    assert {path.name for path in tmp_path.iterdir()} == {"in.blend", out.name}


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb", ".gltf"])
def test_a_full_disk_leaves_a_file_that_is_changed_in_place_whole(run, tmp_path, suffix):
    big_input(tmp_path / "in.blend")
    path = tmp_path / f"in{suffix}"
    assert run("unwrap", tmp_path / "in.blend", "-o", path, *PLAIN)[0] == 0
    before = path.read_bytes()
    with small_disk(40_000):
        status, _, err = run("unwrap", path, "-o", path, *PLAIN, "--boundary", "square")
    assert status == 1
    assert len(err.splitlines()) == 1
    assert path.read_bytes() == before


@pytest.mark.parametrize("target", FORMATS)
def test_the_mode_of_a_file_is_kept(run, tmp_path, target):
    (tmp_path / "in.off").write_text(OFF)
    out = tmp_path / f"out{target}"
    out.write_bytes(b"old")
    out.chmod(0o640)
    assert run("unwrap", tmp_path / "in.off", "-o", out, "--quality", "draft")[0] == 0
    assert stat.S_IMODE(out.stat().st_mode) == 0o640
    assert out.read_bytes() != b"old"
    out.unlink()
    assert run("unwrap", tmp_path / "in.off", "-o", out, "--quality", "draft")[0] == 0
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(out.stat().st_mode) == 0o666 & ~umask


@pytest.mark.parametrize("name", ["in.obj", "out.obj", "./in.obj", "link.json", "hard.json"])
@pytest.mark.parametrize("command", ["unwrap", "refine", "sphere", "magnify"])
def test_a_report_never_replaces_a_mesh(run, tmp_path, monkeypatch, command, name):
    """D5: IN or OUT was overwritten with JSON, with status 0."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.obj").write_text(OBJ)
    (tmp_path / "out.obj").write_text("old")
    (tmp_path / "link.json").symlink_to(tmp_path / "in.obj")
    os.link(tmp_path / "in.obj", tmp_path / "hard.json")
    more = ["--weights", "curvature"] if command == "magnify" else []
    status, out, err = run(command, "in.obj", "-o", "out.obj", "--report", name, *more)
    assert status == 2
    assert out == ""
    assert "--report" in err
    assert (tmp_path / "in.obj").read_text() == OBJ
    assert (tmp_path / "out.obj").read_text() == "old"


def test_pictures_reports_and_levels_are_told_apart_before_anything_is_read(run, tmp_path):
    missing = tmp_path / "missing.obj"
    same = tmp_path / "same.png"
    shared = ["-o", tmp_path / "out.obj", "--report", tmp_path / "r" / ".." / "same.png"]
    (tmp_path / "r").mkdir()
    (tmp_path / "a.png").write_bytes(b"")
    status, _, err = run("measure", missing.with_suffix(".png"), "--histogram", missing.with_suffix(".png"))
    assert (status, "--histogram" in err) == (2, True)
    status, _, err = run("sphere", missing, *shared, "--image", tmp_path / "a.png", "--image-out", same)
    assert (status, "--image-out" in err) == (2, True)
    status, _, err = run("remesh", tmp_path / "in_LOD1.obj", "-o", tmp_path / "in.obj", "--vertices", 9, "--levels", 2)
    assert (status, "replace the input" in err) == (2, True)


@pytest.mark.parametrize("option", ["--report", "--histogram"])
def test_folders_that_are_not_there_are_told_before_the_long_work(run, tmp_path, option):
    (tmp_path / "in.obj").write_text(OBJ)
    arguments = ["measure", tmp_path / "in.obj"] if option == "--histogram" else ["unwrap", tmp_path / "in.obj"]
    arguments += [] if option == "--histogram" else ["-o", tmp_path / "out.obj"]
    status, out, err = run(*arguments, option, tmp_path / "no" / "x.png")
    assert (status, out) == (1, "")
    assert "no such folder" in err
    assert [path.name for path in tmp_path.iterdir()] == ["in.obj"]


@pytest.mark.parametrize("target", FORMATS)
def test_paths_that_blender_would_cut_are_refused(run, tmp_path, target):
    """W4: status 0 and no file, or one somewhere else."""
    (tmp_path / "in.off").write_text(OFF)
    folder = tmp_path
    while len(os.fsencode(folder)) < 1010:
        folder = folder / ("d" * 200)
    folder.mkdir(parents=True)
    status, _, err = run("unwrap", tmp_path / "in.off", "-o", folder / f"out{target}")
    assert status == 1
    assert "bytes" in err
    assert len(err.splitlines()) == 1
    assert len(list(tmp_path.rglob("*.*"))) == 1
    (folder / "in.off").write_text(OFF)
    status, _, err = run("unwrap", folder / "in.off", "-o", tmp_path / f"out{target}")
    assert (status, "bytes" in err) == (1, True)


def test_reports_and_pictures_come_whole(run, tmp_path):
    (tmp_path / "in.obj").write_text(OBJ)
    (tmp_path / "r.json").write_text("old")
    (tmp_path / "r.json").chmod(0o600)
    assert run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "o.obj", "--report", tmp_path / "r.json")[0] == 0
    assert json.loads((tmp_path / "r.json").read_text())["charts"]
    assert stat.S_IMODE((tmp_path / "r.json").stat().st_mode) == 0o600
    (tmp_path / "h.png").write_bytes(b"old")
    with small_disk(500):
        status, _, err = run("measure", tmp_path / "o.obj", "--histogram", tmp_path / "h.png")
    assert status == 1
    assert len(err.splitlines()) == 1
    assert (tmp_path / "h.png").read_bytes() == b"old"
    assert run("measure", tmp_path / "o.obj", "--histogram", tmp_path / "h.png")[0] == 0
    assert (tmp_path / "h.png").read_bytes().startswith(b"\x89PNG")
