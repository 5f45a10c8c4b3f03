"""uv.omt_measure and the command agree with figures computed by hand, and with an independent judge."""

from __future__ import annotations

import importlib.util
import json
import os
import re
from pathlib import Path

import bpy

import numpy as np
import pytest
import scenes

SHARED = Path(__file__).resolve().parents[3] / "shared"
JUDGE = Path(os.environ.get("OMT_UV_JUDGE", SHARED / "tools" / "judge_uv.py"))


def measured(package, objects):
    """Distortion of objects in Object Mode."""
    read = package("blender.mesh").read
    return package("pipelines.distortion").measure_readings([read(obj) for obj in objects])


def test_by_hand(package):
    """Two unit squares, one with three times the texture of the other, stretched two to one."""
    obj = scenes.add([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)], [(0, 1, 2, 3), (1, 4, 5, 2)])
    w, h = 6**0.5 / 10, 6**0.5 / 20
    uv = [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1), (0.2, 0.2), (0.2 + w, 0.2), (0.2 + w, 0.2 + h), (0.2, 0.2 + h)]
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array(uv, np.float32).ravel())
    figures = measured(package, [obj])
    assert figures.area_l1 == pytest.approx(0.5, abs=1e-6)
    assert figures.area_sd == pytest.approx(0.5, abs=1e-6)
    assert figures.angle_mean == pytest.approx(1.5, abs=1e-6)
    assert figures.folds == 0
    assert figures.charts == 2


@pytest.mark.parametrize("wrong", ["", "Area error", "Shear", "Folded faces", "Overlap"])
def test_what_is_measured_is_marked_where_it_is_out_of_its_bounds(package, wrong):
    """A row of quads, evenly and as it lies; one of them is larger, all are longer, one is folded, or on another."""
    points = [(x, y, 0) for y in range(2) for x in range(21)]
    scenes.add(points, [(k, k + 1, k + 22, k + 21) for k in range(20)])
    obj = bpy.context.object
    uv = 0.04 * scenes.seen_from_above(obj) / np.ptp(scenes.seen_from_above(obj), axis=0).max() * 20
    uv = {"Area error": np.where(uv[:, :1] > 0.5, 0.5 + 3 * (uv - 0.5), uv), "Shear": uv * [1, 8]}.get(wrong, uv)
    if wrong == "Overlap":
        uv[-4:] = uv[:4]
    elif wrong == "Folded faces":
        # Its far side is on the near one's other side.
        uv[-3:-1] = uv[-4:][[0, 3]] - (uv[-3:-1] - uv[-4:][[0, 3]])
    scenes.set_uv(obj, uv)
    assert bpy.ops.uv.omt_measure() == {"FINISHED"}
    summary = package("session.last_run").state.summary
    assert {"Area error", "Shear", "Folded faces", "Overlap"} <= {name for name, _ in summary.rows}
    assert wrong in summary.beyond if wrong else not summary.beyond, (dict(summary.rows), summary.beyond)


def test_operator_reports_the_figures(package, capfd):
    obj = scenes.bump()
    bpy.ops.uv.omt_unwrap()
    figures = measured(package, [obj])
    capfd.readouterr()
    assert bpy.ops.uv.omt_measure() == {"FINISHED"}
    text = capfd.readouterr().out
    assert float(re.search(r"Area error ([\d.]+) %", text).group(1)) == pytest.approx(100 * figures.area_l1, abs=5e-3)
    assert "0 folded of 48 faces" in text


def test_edit_mode_measures_the_selected_faces(capfd):
    obj = scenes.bump()
    bpy.ops.uv.omt_unwrap()
    scenes.edit(obj, faces=[0, 1, 2])
    capfd.readouterr()
    bpy.ops.uv.omt_measure()
    assert "of 3 faces" in capfd.readouterr().out


def test_scale_of_the_object_counts(package):
    obj = scenes.bump()
    bpy.ops.uv.omt_unwrap()
    exact = measured(package, [obj]).area_l1
    obj.scale = (1, 1, 4)
    bpy.context.view_layer.update()
    assert measured(package, [obj]).area_l1 > exact + 0.05


@pytest.mark.parametrize("triangulated", [False, True])
@pytest.mark.parametrize("make", [scenes.bump, scenes.cube])
def test_agrees_with_the_judge(package, make, triangulated, tmp_path):
    if not JUDGE.is_file():
        pytest.skip(f"no judge at {JUDGE}: set OMT_UV_JUDGE to judge_uv.py")
    spec = importlib.util.spec_from_file_location("judge_uv", JUDGE)
    judge = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(judge)
    obj = make()
    if triangulated:
        obj.modifiers.new("Triangulate", "TRIANGULATE")
        bpy.ops.object.convert(target="MESH")
    rng = np.random.default_rng(3)
    bpy.ops.uv.omt_unwrap()
    layer = obj.data.uv_layers.active
    uv = scenes.uv_of(obj) * [1.3, 0.8] + 0.01 * rng.random((len(obj.data.loops), 2))
    layer.uv.foreach_set("vector", uv.astype(np.float32).ravel())
    ours = json.loads(json.dumps(vars(measured(package, [obj]))))
    path = tmp_path / "case.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    theirs = judge.judge(*judge.read_blend(str(path)))
    # The judge has polygons for the area error alone.
    theirs["area_l1"] = judge.polygon_error(*judge.read_polygons(str(path)))
    of_triangles = ("area_sd", "area_p99", "angle_mean", "seed_area", "seed_angle") if triangulated else ()
    for name in ("area_l1", "folds", "overlap", *of_triangles):
        assert ours[name] == pytest.approx(theirs[name], abs=1e-4), name
