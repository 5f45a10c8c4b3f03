"""measure on the command line: the figures that unwrap reports, on one line or as JSON, and a histogram."""

from __future__ import annotations

import json

import bpy

import numpy as np
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


def test_regions_are_rows_and_attributes_are_written(run, tmp_path):
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    group = obj.vertex_groups.new(name="half")
    group.add([v.index for v in obj.data.vertices if v.co.x < 1.1], 1.0, "REPLACE")
    for name in ("red", "blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    for polygon in obj.data.polygons:
        polygon.material_index = polygon.index % 2
    part = obj.data.attributes.new("part", "INT", "FACE")
    part.data.foreach_set("value", [k % 3 for k in range(len(obj.data.polygons))])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    for kind, names in [("groups", ["half"]), ("materials", ["blue", "red"]), ("part", ["part 0", "part 1", "part 2"])]:
        status, out, _ = run("measure", tmp_path / "in.blend", "--regions", kind, "--csv")
        rows = [line.split(",") for line in out.splitlines()]
        assert status == 0 and [row[0] for row in rows] == ["name", "all", *names]
    status, out, _ = run("measure", tmp_path / "in.blend", "--regions", "materials", "--json")
    shares = [row["surface_share"] for row in json.loads(out)["regions"]]
    assert shares[0] == 1 and sum(shares[1:]) == pytest.approx(1)
    words = ["measure", tmp_path / "in.blend", "--attributes", tmp_path / "out.blend", "--preview", tmp_path / "p.png"]
    assert run(*words)[0] == 0 and (tmp_path / "p.png").is_file()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    attributes = bpy.data.objects[0].data.attributes
    assert [attributes[f"OMT UV {name}"].domain for name in ("Area", "Shear", "Stretch")] == ["FACE"] * 3


@pytest.mark.parametrize(
    "words, status, said",
    [
        (["--regions", "none"], 1, "no attribute 'none'"),
        (["--regions", "groups"], 1, "no vertex group"),
        (["--csv"], 2, "--regions"),
        (["--attributes", "x.obj"], 1, "only .blend"),
        (["--preview", "x.jpg"], 2, ".png"),
    ],
)
def test_regions_that_are_not_there_and_files_of_other_kinds_are_one_line(run, tmp_path, words, status, said):
    scenes.set_uv(obj := scenes.bump(), scenes.seen_from_above(obj))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    found, out, err = run("measure", tmp_path / "in.blend", *words)
    assert (found, out) == (status, "") and said in err.splitlines()[-1]


def test_all_that_is_measured_of_a_modifier_is_what_it_is_of_the_mesh_once_that_is_applied(run, tmp_path):
    """Figures and pictures are of one surface."""
    found = {}
    for name in ("modifier", "applied", "cage"):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        obj = scenes.bump(5, 4, height=1.0)
        uv = scenes.seen_from_above(obj, 0.2)
        scenes.set_uv(obj, uv**1.3)
        if name != "cage":
            obj.modifiers.new("Subdivision", "SUBSURF").levels = 2
        if name == "applied":
            bpy.context.view_layer.objects.active = obj
            bpy.ops.object.modifier_apply(modifier="Subdivision")
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{name}.blend"))
        status, out, err = run("measure", tmp_path / f"{name}.blend", "--histogram", tmp_path / f"{name}.png", "--json")
        assert status == 0, err
        image = bpy.data.images.load(str(tmp_path / f"{name}.png"))
        found[name] = json.loads(out), np.array(image.pixels[:])
    one, other, cage = (found[name][0] for name in ("modifier", "applied", "cage"))
    assert one.pop("on_subdivided_surface") and "on_subdivided_surface" not in other
    for key, value in other.items():
        # Blender may put vertices onto the limit surface.
        assert one[key] == pytest.approx(value, rel=0.05), key
    assert cage["area_l1"] != pytest.approx(other["area_l1"], rel=1e-2)
    drawn, applied, of_cage = (found[name][1] for name in ("modifier", "applied", "cage"))
    assert np.abs(drawn - applied).mean() < 0.1 * np.abs(drawn - of_cage).mean()
