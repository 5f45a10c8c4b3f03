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
