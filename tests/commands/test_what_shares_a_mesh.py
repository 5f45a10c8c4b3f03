"""A mesh that several objects of a file have is worked on, told of and counted once, by the name of the first one."""

from __future__ import annotations

import json

import bpy

import numpy as np
import pytest
import scenes
from command_runs import GROUP
from sphere_shapes import blob

DRAFT = "--quality draft"
# What commands are called with, and whether they write a report.
RUNS = {
    "unwrap": (f"{DRAFT} --max-shear 0", True),
    "refine": (DRAFT, True),
    "sphere": (DRAFT, True),
    "magnify": (f"{DRAFT} --weights {GROUP} --factor 1.5 --source uv", True),
    "partition": ("--cells 3 --relax 0", True),
    "seams": ("--max-shear 0", False),
    "weights": ("--kind gaussian", False),
    "queue": (f"{DRAFT} --max-shear 0", False),
    "stack": ("", False),
    "measure": ("--json", None),
    "measure regions": ("--csv --regions groups", None),
}


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    """Files of two bodies, and of the same and two objects more that have their meshes and come behind, or before."""
    made = tmp_path_factory.mktemp("shared")
    scenes.open_empty()
    for k, name in enumerate("MN"):
        V, F = blob(1, seed=k + 1)
        obj = scenes.add(V * [1.0, 1.3, 0.8 + 0.2 * k], F, name)
        obj.location.x = 4.0 * k
        obj.vertex_groups.new(name=GROUP).add(np.flatnonzero(V[:, 2] > 0.3).tolist(), 1.0, "REPLACE")
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0) == {"FINISHED"}
    for obj in bpy.data.objects:
        uv = scenes.uv_of(obj)
        scenes.set_uv(obj, 0.8 * uv + 0.1 * uv**2)
    bpy.ops.wm.save_as_mainfile(filepath=str(made / "plain.blend"))
    for k, name in enumerate("MN"):
        obj = bpy.data.objects[name].copy()
        obj.name, obj.location.z = f"Z {k}", 5.0
        bpy.context.collection.objects.link(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(made / "shared.blend"))
    return made


def outcome(run, folder, command, name):
    """Status, what is printed and told, the report, and the meshes as they are then."""
    more, reports = RUNS[command]
    words = [command.split()[0], folder / f"{name}.blend", *more.split()]
    words += ["-o", folder / "out.blend"] if reports is not None else []
    words += ["--report", folder / "report.json"] if reports else []
    status, out, err = run(*words)
    report = json.loads((folder / "report.json").read_text()) if reports else {}
    left = []
    if reports is not None:
        bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
        left = [scenes.state(bpy.data.objects[letter]) for letter in "MN"]
        assert len(bpy.data.meshes) == 2
    return status, out.replace(name, ""), err.replace(name, ""), _timeless(report), left


def _timeless(report):
    if isinstance(report, dict):
        return {key: _timeless(value) for key, value in report.items() if "second" not in key and key != "input"}
    return [_timeless(value) for value in report] if isinstance(report, list) else report


@pytest.mark.parametrize("command", RUNS)
def test_a_mesh_of_several_objects_is_told_of_once_by_its_first(run, folder, command):
    alone, shared = (outcome(run, folder, command, name) for name in ("plain", "shared"))
    assert alone[0] == 0, alone[2]
    assert shared == alone
