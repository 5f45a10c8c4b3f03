"""measure on the command line: the figures that unwrap reports, on one line or as JSON, and a histogram."""

from __future__ import annotations

import json

import bpy

import pytest
import scenes


def test_measure_prints_what_the_unwrap_reports(run, tmp_path):
    scenes.bump(5, 6)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    report = tmp_path / "r.json"
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--report", report)[0] == 0
    status, out, _ = run("measure", tmp_path / "out.blend", "--json")
    assert status == 0
    figures, chart = json.loads(out), json.loads(report.read_text())["charts"][0]
    assert figures["area_l1"] == pytest.approx(chart["area_l1"], abs=1e-4)
    assert figures["angle_mean"] == pytest.approx(chart["angle_mean"], abs=1e-4)
    assert figures["folds"] == 0
    status, out, _ = run("measure", tmp_path / "out.blend")
    assert status == 0
    assert len(out.splitlines()) == 1


def test_a_histogram_is_a_picture_and_nothing_else(run, tmp_path):
    scenes.set_uv(obj := scenes.bump(), scenes.seen_from_above(obj))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    assert run("measure", tmp_path / "in.blend", "--histogram", tmp_path / "h.png")[0] == 0
    assert (tmp_path / "h.png").read_bytes().startswith(b"\x89PNG")
    status, out, err = run("measure", tmp_path / "in.blend", "--histogram", tmp_path / "h.txt")
    assert status == 1 and out == "" and "Name a .png file" in err
