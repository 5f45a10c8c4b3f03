"""Every figure that a command tells is of the shape: the same in whatever order vertices, faces and corners are, for a
mirror image, and whatever order objects are in; and every report has all of its keys, for each object by name."""

from __future__ import annotations

import json

import bpy

import command_runs
import operator_runs
import pytest
from operator_runs import Scene

# Commands, words, and how exact figures of a mirror image are: searches end elsewhere.
TOLD: dict[str, tuple[str, float]] = {
    "measure": ("--json", 1e-5),
    "measure regions": ("--json --regions groups", 1e-5),
    "measure beltrami": ("--json --beltrami", 1e-5),
    "unwrap": ("-o @out --quality draft --max-shear 0 --report @report", 2e-2),
    "refine": ("-o @out --quality draft --report @report", 1e-3),
    "magnify": ("-o @out --quality draft --weights region --factor 1.5 --source uv --report @report", 1e-3),
    "sphere": ("-o @out --quality draft --report @report", 2e-2),
    "partition": ("-o @out --cells 4 --relax 0 --report @report", 2e-2),
    "flow": ("-o @out --handles @handles --report @report", 1e-2),
    "compare": ("@other --json", 5e-2),
    "distance": ("@other --json", 2e-2),
    "diagram": ("-o @diagram --json", 1e-2),
}
# Counts of steps, what is left of an error when they end, and what hangs on the random places that cells begin from.
UNLIKE = {"newton_steps", "all_newton_steps", "newton", "iterations", "steps", "residual", "status", "drift", "missed",
          "error_of_faces", "least_distance", "input", "output", "a", "b", "file", "volume_change", "error",
          "seconds"}  # fmt: skip
# What takes points at random, face by face, or of a file with objects that are equally large the first one; and that a
# mirror image is not as far from what it is compared with.
SAMPLED = ("compare", "distance")
LEFT_OUT = {"diagram": {"objects"}, "compare": {"mirrored"}}
ORDERS = {kind: Scene(kind) for kind in ("vertices", "faces", "corners", "mirrored")} | {"objects": Scene("", True)}


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    made = tmp_path_factory.mktemp("orders")
    uvs = operator_runs.some_uvs()
    for name, scene in {"plain": Scene(), **ORDERS}.items():
        found = operator_runs.bodies(uvs, scene)
        for body in found.values():
            tip = body.obj.vertex_groups.new(name="tip")
            top = max(body.obj.data.vertices, key=lambda v: v.co.z)
            tip.add([top.index], 1.0, "REPLACE")
        bpy.ops.wm.save_as_mainfile(filepath=str(made / f"{name}.blend"))
    (made / "handles.json").write_text(json.dumps([{"group": "tip", "move": [0, 0, 0.1]}]))
    command_runs.body("Other", seed=3)
    for obj in [obj for obj in bpy.data.objects if obj.name != "Other"]:
        bpy.data.objects.remove(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(made / "other.blend"))
    return made


def figures(run, folder, name, scene):
    """What a command tells of a scene, as plain lists and dictionaries."""
    files = {"@out": "out.blend", "@report": "report.json", "@handles": "handles.json", "@other": "other.blend",
             "@diagram": "out.obj"}  # fmt: skip
    words = [folder / files[word] if word in files else word for word in TOLD[name][0].split()]
    status, out, err = run(name.split()[0], folder / f"{scene}.blend", *words)
    assert status == 0, err
    text = (folder / "report.json").read_text() if "@report" in TOLD[name][0] else out
    return json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))


def apart(one, other, bound, path=""):
    """Paths of what is not the same in two reports."""
    if isinstance(one, dict):
        assert one.keys() == other.keys(), path
        return [p for key in one.keys() - UNLIKE for p in apart(one[key], other[key], bound, f"{path}/{key}")]
    if isinstance(one, list):
        if len(one) != len(other):
            return [(path, len(one), len(other))]
        if one and isinstance(one[0], dict) and "object" in one[0]:
            one, other = (sorted(rows, key=lambda row: row["object"]) for rows in (one, other))
        elif one and isinstance(one[0], str):
            one, other = sorted(one), sorted(other)
        return [p for k, pair in enumerate(zip(one, other, strict=True)) for p in apart(*pair, bound, f"{path}/{k}")]
    if isinstance(one, float) and other is not None:
        return [] if other == pytest.approx(one, rel=bound, abs=bound) else [(path, one, other)]
    return [] if one == other else [(path, one, other)]


@pytest.mark.parametrize("name", TOLD)
def test_figures_are_of_the_shape(package, run, folder, monkeypatch, name):
    # A hundred thousand points take most of the time of so small a mesh.
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 4000)
    first = figures(run, folder, name, "plain")
    for order in ORDERS.keys() - LEFT_OUT.get(name, set()):
        mirrored = {"uv_min", "uv_max"} if order == "mirrored" else set()
        bound = TOLD[name][1] if mirrored or name in SAMPLED else 1e-5
        found = apart(first, figures(run, folder, name, order), bound)
        assert not [row for row in found if row[0].split("/")[-2] not in mirrored], order
