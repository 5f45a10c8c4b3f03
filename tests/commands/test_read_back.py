"""What every command tells and draws of what it wrote is what is measured of the file, whatever its format, and how
it lies in space."""

from __future__ import annotations

import json

import bpy

import command_runs
import numpy as np
import pytest
import scenes
import whole_file

BODIES = ["--object", "A", "--object", "B"]
# Command, words besides, and the objects of the file that it made, in the order that it has them.
DRAWN = {
    "unwrap": ([], BODIES),
    "refine": ([], BODIES),
    "magnify": ([], BODIES),
    "sphere": ([], BODIES),
    "queue": ([], BODIES),
    "remesh": (["--levels", "2", "--ratio", "0.9", "--no-seams", "--no-materials"], ["--object", "A_LOD1"]),
    "partition": (["--write", "mesh"], ["--object", "A_cells", "--object", "B_cells"]),
}
FORMATS = (".obj", ".ply", ".glb", ".gltf", ".fbx")


@pytest.fixture(scope="module")
def rich(package, tmp_path_factory):
    folder = whole_file.save(tmp_path_factory.mktemp("rich"))
    # What every format holds of it: the bodies alone, with one UV map.
    for obj in [obj for obj in bpy.data.objects if obj.name not in ("A", "B")]:
        bpy.data.objects.remove(obj)
    for obj in bpy.data.objects:
        obj.data.uv_layers.remove(obj.data.uv_layers["other"])
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "plain.blend"))
    return folder


def measured(run, path, objects=(), *more):
    status, out, err = run("measure", path, *objects, "--json", "--preview", path.parent / "again.png", *more)
    assert status == 0, err
    return json.loads(out)


@pytest.mark.parametrize("name", DRAWN)
def test_a_preview_and_the_figures_are_those_of_the_file_that_was_written(run, rich, name):
    more, made = DRAWN[name]
    words = command_runs.words(name, rich)
    if name == "remesh":
        # It takes long to compare what was made, and no figure of that is of UVs.
        words = command_runs.without(words, "--report")
    status, _, err = run(*words, *(BODIES[:2] if name == "remesh" else BODIES), *more)
    assert status == 0, err
    drawn = (rich / "preview.png").read_bytes()
    figures = measured(run, rich / "out.blend", made)
    assert drawn == (rich / "again.png").read_bytes()
    told = json.loads((rich / "report.json").read_text()) if "--report" in words else {}
    if "gate" in told:
        assert told["gate"]["folds"] == figures["folds"]
        # Globes may lie on one another.
        assert name == "sphere" or told["gate"]["overlap"] == pytest.approx(figures["overlap"], abs=1e-6)
    # Of what is magnified the shear is that of a surface with other areas.
    if name in ("unwrap", "refine"):
        check_charts(told["charts"], figures)
        for chart in told["charts"]:
            alone = measured(run, rich / "out.blend", ["--object", chart["object"]])
            assert chart["angle_mean"] == pytest.approx(alone["angle_mean"], rel=1e-4)


def check_charts(charts, figures):
    """What is told of the charts comes to what is measured of all."""
    assert {chart["object"] for chart in charts} == {"A", "B"}
    assert sum(chart["folds"] for chart in charts) == figures["folds"]
    shear = [chart["angle_mean"] for chart in charts]
    assert min(shear) - 1e-4 <= figures["angle_mean"] <= max(shear) + 1e-4


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_is_measured_and_drawn_as_a_blend_is(run, rich, suffix):
    figures = measured(run, rich / "plain.blend")
    drawn = scenes.pixels_of(rich / "again.png")
    out = rich / f"in{suffix}"
    # Nothing moves by that: densities are those that are there.
    status, _, err = run("stack", rich / "plain.blend", "-o", out)
    assert status == 0, err
    found = measured(run, out)
    for key in ("folds", "area_l1", "area_sd", "angle_mean", "angle_p99", "overlap", "uv_min", "uv_max"):
        assert found[key] == pytest.approx(figures[key], rel=2e-3, abs=2e-3), key
    if suffix in (".obj", ".ply"):
        return  # Their axes are taken as they are, with Y up.
    apart = np.abs(scenes.pixels_of(rich / "again.png") - drawn).max(axis=2)
    assert (apart > 0.1).mean() < 0.02


def test_a_choice_of_all_is_none(run, rich):
    """Objects are in collections of collections, and some of these are left out of the view."""
    figures = measured(run, rich / "in.blend")
    every = ["--object", "A", "--object", "B", "--object", "Halves"]
    for chosen in (["--scene", "Scene"], every, ["--scene", "Scene", *every]):
        assert measured(run, rich / "in.blend", chosen) == figures, chosen


@pytest.mark.parametrize("suffix", [".obj", ".glb"])
def test_a_wall_is_written_beside_what_flows_in_it(package, run, rich, suffix):
    """To every format, as to a .blend, and hidden things as those that are seen."""
    bpy.ops.wm.open_mainfile(filepath=str(rich / "plain.blend"))
    body, wall = bpy.data.objects["A"], bpy.data.objects["B"]
    wall.data, wall.matrix_world = body.data.copy(), body.matrix_world
    wall.data.transform(np.diag([1.5, 1.5, 1.5, 1.0]).tolist())
    wall.hide_viewport = True
    bpy.ops.wm.save_as_mainfile(filepath=str(rich / "walled.blend"))
    (rich / "handles.json").write_text(json.dumps([{"vertices": [0], "move": [0, 0, 0.05]}]))
    words = ["flow", rich / "walled.blend", "-o", rich / f"flown{suffix}", "--handles", rich / "handles.json"]
    status, _, err = run(*words, "--inside", "B")
    assert status == 0, err
    found = package("files.meshes").load(rich / f"flown{suffix}")
    assert sum(len(obj.data.polygons) for obj in found) == 2 * 80


# Command on a plain OBJ and words, which tell figures of it; those that are lengths or areas, by their power.
TOLD = {
    "measure": "--json",
    "unwrap": "-o @out --quality draft --max-shear 0 --report @r",
    "refine": "-o @out --quality draft --report @r",
    "magnify": "-o @out --quality draft --weights curvature --factor 1.5 --source uv --report @r",
    "partition": "-o @out --cells 4 --relax 0 --report @r",
}
POWERS = {"area": 2, "scale": -1}
# Paths, times, counts of steps and what is left of an error.
UNLIKE = ("input", "output", "seconds", "newton", "all_newton", "residual", "error")
# As exact as floats of single precision, of which solvers make many steps.
CLOSE = {"rel": 1e-3, "abs": 1e-4}


def figures_of(run, folder, name, path):
    words = [folder / f"{word[1:]}.blend" if word[0] == "@" else word for word in TOLD[name].split()]
    status, out, err = run(name, path, *words)
    assert status == 0, err
    return json.loads(out if name == "measure" else (folder / "r.blend").read_text())


def same(one, other, scale, path=""):
    """What two reports tell is alike."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            if not key.startswith(UNLIKE):
                same(one[key], other[key], scale, f"{path}/{key}")
    elif isinstance(one, list):
        assert len(one) == len(other), path
        for k, pair in enumerate(zip(one, other, strict=True)):
            same(*pair, scale, f"{path}/{k}")
    elif isinstance(one, float):
        power = POWERS.get(path.rsplit("/", 1)[-1], 0)
        assert other == pytest.approx(one * scale**power, **CLOSE), path
    else:
        assert one == other, path


@pytest.mark.parametrize("name", TOLD)
def test_figures_are_the_same_of_a_body_that_is_larger_or_turned(run, rich, name):
    """So much larger and turned that no digit of a coordinate changes."""
    status, _, err = run("stack", rich / "plain.blend", "-o", rich / "plain.obj")
    assert status == 0, err
    lines = (rich / "plain.obj").read_text().splitlines()
    first = figures_of(run, rich, name, rich / "plain.obj")
    for scale, turned in ((1024.0, False), (1.0, True)):
        moved = []
        for line in lines:
            if line.startswith("v "):
                x, y, z = (scale * float(word) for word in line.split()[1:4])
                # About the axis that is up.
                line = f"v {z:.9g} {y:.9g} {-x:.9g}" if turned else f"v {x:.9g} {y:.9g} {z:.9g}"
            moved.append(line)
        (rich / "moved").mkdir(exist_ok=True)
        (rich / "moved" / "plain.obj").write_text("\n".join(moved) + "\n")
        same(first, figures_of(run, rich, name, rich / "moved" / "plain.obj"), scale)
