"""No operator ends in a traceback, whatever is wrong with one of two meshes: one line refuses it, by its name."""

from __future__ import annotations

import bpy

import numpy as np
import operator_runs
import pytest
import scenes

DRAFT = {"quality": "DRAFT"}
# Arguments without which an operator would have nothing to do, or a lot.
ARGUMENTS = {
    "uv.omt_unwrap": {**DRAFT, "max_shear": 0.0},
    "uv.omt_refine": DRAFT,
    "uv.omt_magnify": {**DRAFT, "weight_group": "region", "source": "UV", "factor": 2.0},
    "uv.omt_sphere": DRAFT,
    "object.omt_remesh": {"target_vertices": 40},
    "mesh.omt_partition": {"cells": 3, "relax": 0},
    "object.omt_volume": {"tets": 100},
    "object.omt_flow": {"move": (0, 0, 0.1)},
    "uv.omt_flow": {"start": (0.5, 0.5), "move": (0.1, 0.0), "radius": 0.5},
    "uv.omt_layout_image": {"size": 32, "kind": "AREA"},
    "uv.omt_checker": {"size": 256},
    "object.omt_strain": {"of": "UV"},
}
# What needs a window or a file, or opens pages.
LEFT_OUT = {"uv.omt_preset", "wm.omt_copy_report", "wm.omt_help", "uv.omt_queue", "uv.omt_live_end",
            "uv.omt_queue_stop", "object.omt_landmarks"}  # fmt: skip


def nowhere(obj):
    obj.data.vertices[5].co.x = float("nan")


def of_uvs_nowhere(obj):
    uv = scenes.uv_of(obj)
    uv[4] = np.nan
    scenes.set_uv(obj, uv)


def flat(obj):
    for vertex in obj.data.vertices:
        vertex.co = (vertex.co.x, 0, 0)


def without_faces(obj):
    mesh = bpy.data.meshes.new("Loose")
    mesh.from_pydata([v.co[:] for v in obj.data.vertices], [], [])
    obj.data = mesh


# Two surfaces are looked at as one: which of them it is cannot be said.
UNNAMED = {("flat", "object.omt_match"), ("flat", "object.omt_distance"), ("without_faces", "object.omt_distance")}
# What has no faces is left out there, and the other one refused for what it is.
OF_THE_OTHER = {("without_faces", f"uv.omt_{verb}") for verb in ("symmetrize", "rectify")}


@pytest.fixture(scope="module")
def uvs(package):
    return operator_runs.some_uvs()


@pytest.mark.parametrize("wrong", [nowhere, of_uvs_nowhere, flat, without_faces], ids=lambda wrong: wrong.__name__)
def test_what_is_wrong_is_told_in_one_line_and_by_name(package, uvs, wrong):
    every = [c.bl_idname for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    tried = 0
    for name in every:
        # Others do not look at UVs.
        if name in LEFT_OUT or (wrong is of_uvs_nowhere and name[:3] != "uv." and name != "object.omt_strain"):
            continue
        found = operator_runs.bodies(uvs)
        # Neither is a part of the other's name, or of what is said.
        found["A"].obj.name, found["B"].obj.name = "Qfirst", "Qsecond"
        wrong(found["B"].obj)
        scenes.select([found["A"].obj, found["B"].obj])
        module, verb = name.split(".")
        operator = getattr(getattr(bpy.ops, module), verb)
        try:
            operator("EXEC_DEFAULT", **ARGUMENTS.get(name, {}))
        except RuntimeError as error:
            text = str(error)
            assert "Traceback" not in text, (name, text)
            if "poll()" not in text:
                tried += 1
                assert "Qsecond" in text or (wrong.__name__, name) in UNNAMED | OF_THE_OTHER, (name, text)
        if bpy.context.mode != "OBJECT":
            scenes.leave_edit()
    assert tried > 3
