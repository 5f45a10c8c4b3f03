"""test-texture and diagram: what they draw and write, and what they refuse."""

from __future__ import annotations

import json

import bpy

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize(("kind", "colours"), [("checker", 100), ("circles", 100), ("world", 15)])
def test_patterns_need_no_mesh(run, tmp_path, kind, colours):
    status, _, err = run("test-texture", "-", "-o", tmp_path / "p.png", "--kind", kind, "--size", 256)
    assert status == 0, err
    shown = scenes.pixels_of(tmp_path / "p.png")
    assert shown.shape[1] == 256 and len(np.unique((shown * 32).round().reshape(-1, 3), axis=0)) > colours


@pytest.mark.parametrize("kind", ["area", "shear", "normals"])
def test_layouts_cover_what_the_uvs_cover(run, tmp_path, kind):
    scenes.set_uv(scenes.bump(), scenes.seen_from_above(bpy.data.objects["Bump"], 0.5))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    files = (tmp_path / "in.blend", "-o", tmp_path / "p.png", "--kind", kind, "--size", 64)
    assert run("test-texture", *files)[0] == 0
    drawn = (scenes.pixels_of(tmp_path / "p.png") < 0.99).any(axis=2)
    area = np.abs(scenes.areas(bpy.data.objects["Bump"])[1]).sum()
    assert drawn.mean() == pytest.approx(area, abs=0.03)
    assert run("test-texture", tmp_path / "in.blend", "-o", tmp_path / "p.jpg")[0] == 1


@pytest.mark.parametrize("domain", ["disk", "square"])
def test_diagrams_have_a_cell_for_every_vertex(run, tmp_path, domain):
    # Of several meshes the one with most triangles, wherever it stands among them.
    for name, size in (("A Small One", (2, 2)), ("Bump", (8, 6)), ("Zero", (2, 2))):
        scenes.bump(*size, name=name)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    files = ("diagram", tmp_path / "in.blend", "--domain", domain, "--json")
    status, out, err = run(*files, "-o", tmp_path / "d.obj")
    figures = json.loads(out)
    assert status == 0 and figures["cells"] == 63 and figures["residual"] < 1e-6, err
    assert sum(line.startswith("f ") for line in (tmp_path / "d.obj").read_text().splitlines()) == 63
    assert run(*files, "-o", tmp_path / "d.png", "--size", 64)[0] == 0
    assert (scenes.pixels_of(tmp_path / "d.png") < 0.99).any(axis=2).mean() > 0.6
    assert run(*files, "-o", tmp_path / "d.xyz")[0] == 1


def test_a_diagram_of_one_of_several_objects_says_which(run, tmp_path):
    for name, size in (("Small", (2, 2)), ("Large", (5, 4)), ("Other", (3, 2))):
        scenes.bump(*size, name=name)
    path, out = tmp_path / "in.blend", tmp_path / "d.obj"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    status, _, err = run("diagram", path, "-o", out)
    assert status == 0 and "that of Large" in err and "2 other objects are left out" in err
    assert "another object is left out" in run("diagram", path, "-o", out, "--object", "Large", "--object", "Small")[2]
    assert run("diagram", path, "-o", out, "--object", "Small")[2] == ""
    out.unlink()
    status, _, err = run("diagram", path, "-o", out, "--strict")
    assert status == 1 and "that of Large" in err and not out.exists()


def test_open_meshes_have_no_diagram_of_the_sphere(run, tmp_path):
    scenes.bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    status, _, err = run("diagram", tmp_path / "in.blend", "-o", tmp_path / "d.obj", "--domain", "sphere")
    assert status == 1 and "not closed" in err and not (tmp_path / "d.obj").exists()


def test_cells_as_text_count_their_vertices_from_one(package):
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0.123456789], [0, 1, 0]])
    text = package("commands.pictures.diagram").obj_text(vertices, [np.array([0, 1, 2]), np.array([0, 2, 3])])
    lines = text.splitlines()
    assert lines[4:] == ["f 1 2 3", "f 1 3 4"] and lines[2] == "v 1 1 0.123456789" and text.endswith("4\n")


def test_what_is_told_of_the_map_of_a_diagram_is_told_of_the_diagram(package, run, tmp_path, monkeypatch):
    scenes.bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    named = package("solver.canonical.named_maps")
    assert run("diagram", tmp_path / "in.blend", "-o", tmp_path / "d.obj")[2] == ""
    monkeypatch.setattr(named, "halfedge_lengths", lambda *_: np.array([3e-9]))
    status, _, err = run("diagram", tmp_path / "in.blend", "-o", tmp_path / "d.obj")
    assert status == 0 and "warning: Bump: The conformal map puts neighbours 3e-09 apart" in err
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "in.blend"))
    assert bpy.ops.object.omt_diagram() == {"FINISHED"}
    assert any("3e-09 apart" in notice.text for notice in package("session.last_run").state.notices)
