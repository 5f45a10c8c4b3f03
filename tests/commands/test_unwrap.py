"""unwrap on the command line: what its report says."""

from __future__ import annotations

import json

import bpy

import numpy as np
import pytest
import scenes


def test_report(run, tmp_path):
    scenes.bump(5, 6)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    report = tmp_path / "r.json"
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--report", report)[0] == 0
    charts = json.loads(report.read_text())["charts"]
    assert len(charts) == 1
    assert charts[0]["vertices"] == 42
    expected = {"newton_conformal", "newton_transport", "residual_conformal", "residual_transport", "seconds"}
    assert expected | {"area_l1", "area_sd", "angle_mean", "folds", "faces", "warnings"} <= set(charts[0])
    assert all(seconds >= 0 for seconds in charts[0]["seconds"].values())


def test_objects_of_files_in_which_y_is_up_stand_upright_in_the_map(run, tmp_path):
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(0, 2, 9), np.linspace(0, 1, 7)))
    lines = [f"v {a} {b} {0.3 * np.sin(a + 1.3 * b * b)}" for a, b in zip(x, y, strict=True)]
    lines += [f"f {k + 1} {k + 2} {k + 11} {k + 10}" for k in range(53) if k % 9 < 8]
    (tmp_path / "in.obj").write_text("\n".join(lines) + "\n")
    assert run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "out.obj")[0] == 0
    text = (tmp_path / "out.obj").read_text().splitlines()
    uv = np.array([line.split()[1:3] for line in text if line.startswith("vt ")], float)
    corners = [c.split("/") for line in text if line.startswith("f ") for c in line.split()[1:]]
    vertex, at = (np.array([int(c[k]) - 1 for c in corners]) for k in (0, 1))
    up = np.polyfit(y[vertex], uv[at][:, 1], 1)[0]
    assert up > 5 * abs(np.polyfit(y[vertex], uv[at][:, 0], 1)[0])


def test_subdivision(run, tmp_path):
    modifier = scenes.bump(5, 6).modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    errors = {}
    for choice in ("auto", "off", "1", "2"):
        out = tmp_path / f"{choice}.blend"
        assert run("unwrap", tmp_path / "in.blend", "-o", out, "--subdivision", choice)[0] == 0
        status, text, _ = run("measure", out, "--json")
        figures = json.loads(text)
        assert status == 0 and figures["on_subdivided_surface"]
        errors[choice] = figures["area_l1"]
    assert errors["auto"] == errors["1"] < errors["off"] and errors["2"] < errors["off"]
    assert "on the subdivided surface" in run("measure", tmp_path / "auto.blend")[1].lower()
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "o.blend", "--subdivision", "-1")[0] != 0


@pytest.mark.parametrize("choice", ["auto", "1", "off"])
def test_modifiers_below_are_told_where_the_surface_that_they_are_of_is_asked_for(run, tmp_path, choice):
    obj = scenes.bump(5, 6)
    obj.modifiers.new("Round", "BEVEL")
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    words = ["--quality", "draft", "--subdivision", choice]
    status, _, err = run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "o.blend", *words)
    assert status == 0, err
    assert err.count("Areas are those before the modifiers") == (choice != "off"), err


def test_maps_by_name_rectangles_and_markers(run, tmp_path):
    obj = scenes.bump(12, 4)
    for name, vertices in (("start", [12]), ("corners", [0, 12, 64, 52])):
        obj.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    shear, report = {}, tmp_path / "r.json"
    for kind in ("authalic", "conformal", "polar"):
        options = ("--map", kind, "--boundary", "rectangle", "--corners", "corners", "--start", "start")
        assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "o.blend", *options, "--report", report)[0] == 0
        written = json.loads(report.read_text())
        shear[kind] = written["charts"][0]["angle_mean"]
        assert written["map"] == kind and written["gate"]["folds"] == 0
    assert shear["conformal"] < shear["polar"]
    status, _, told = run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "p.blend", "--map", "polar")
    assert status == 1 and "disk, a square or a rectangle" in told and not (tmp_path / "p.blend").exists()
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "p.blend", "--centre", "none")[0] == 1
