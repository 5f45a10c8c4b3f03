"""unwrap on the command line: what its report says."""

from __future__ import annotations

import json

import bpy

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
