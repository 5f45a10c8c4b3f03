"""Calls of every operator with each property at each value that is not its default, one at a time, and with whatever
else it takes for that property to count."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import bpy

import operator_runs

# What an operator is called with where nothing else is asked for: little work, and something to work on.
DRAFT = {"quality": "DRAFT"}
BASE: dict[str, dict] = {
    "uv.omt_unwrap": {**DRAFT, "max_shear": 0.0},
    "uv.omt_refine": DRAFT,
    "uv.omt_magnify": {**DRAFT, "max_shear": 0.0, "factor": 1.3},
    "uv.omt_sphere": DRAFT,
    "uv.omt_seams": {},
    "uv.omt_live": {},
    "uv.omt_measure": {},
    "uv.omt_density_get": {},
    "uv.omt_density_set": {},
    "uv.omt_flow": {"start": (0.3, 0.3), "move": (0.05, 0.02), "radius": 0.3},
    "uv.omt_stack": {},
    "uv.omt_symmetrize": {},
    "uv.omt_rectify": {},
    "uv.omt_regions": {},
    "uv.omt_worst": {"share": 20.0},
    "uv.omt_attributes": {},
    "uv.omt_overlay": {},
    "uv.omt_histogram": {},
    "uv.omt_layout_image": {"size": 48},
    "uv.omt_checker": {"size": 256},
    "uv.omt_checker_remove": {},
    "uv.omt_remedy": {},
    "uv.omt_region_add": {},
    "uv.omt_region_remove": {},
    "uv.omt_queue": {},
    "uv.omt_notices": {},
    "uv.omt_preset": {},
    "object.omt_weights": {"kind": "GAUSSIAN"},
    "object.omt_remesh": {"target_vertices": 24, "target_faces": 40, "edge_length": 0.4, "strategy": "CFP-APP"},
    "object.omt_compare": {},
    "object.omt_diagram": {"domain": "SQUARE"},
    "object.omt_distance": {},
    "object.omt_strain": {},
    "object.omt_match": {"use_polish": False},
    "object.omt_landmarks": {},
    "object.omt_landmarks_suggest": {"most": 3},
    "object.omt_landmarks_clear": {},
    "object.omt_flow": {"move": (0.1, 0.0, 0.2), "samples": 2},
    "object.omt_volume": {"tets": 60, "points": 20, "result": "ATTRIBUTE"},
    "object.omt_similar": {},
    "mesh.omt_partition": {"cells": 4, "relax": 1},
}
# Help opens a page, reports go to the clipboard, and what ends something is called where there is something to end.
ELSEWHERE = {"wm.omt_copy_report", "wm.omt_help", "uv.omt_live_end", "uv.omt_queue_stop"}
# Values by names of properties: names of what there is, and numbers that small meshes show.
VALUES: dict[str, list] = {
    **{key: ["part", "second", "gone"] for key in ("weight_group", "keep_free", "capacity_group", "keep_group")},
    "centre_group": ["LM_2"], "start_group": ["LM_1"], "corner_group": ["corners"],
    "pole_group": ["pole", "gone"], "meridian_group": ["meridian"], "east_group": ["east"],
    "attribute": ["height", "zone", "flag", "gone"], "density_attribute": ["height", "gone"],
    "uv_layer": ["First", "first", "new"], "further": ["part=2", "second=0.5", "gone=3"],
    "image": ["Picture", "gone"], "detail": ["Detail"], "image_size": [30], "detail_box": [(0.1, 0.1, 0.4, 0.3)],
    "shape_key": ["Smile"], "wall_object": ["Wall"], "body": ["B", "A"], "landmark_prefix": ["LM_1"],
    "prefix": ["LM_1"], "index": [],
    "transfer": [{"GROUPS", "SHAPE_KEYS"}, {"COLOURS", "FACE_SETS", "ATTRIBUTES"}],
    "move": [(0.0, 0.15, -0.1)], "rotate": [(0.3, -0.2, 0.4)], "start": [(0.45, 0.25)], "max_shear": [1.02],
    "sharp_angle": [0.1], "grading": [0.3], "samples": [4], "frames": [2], "radius": [0.5], "factor": [1.7, 0.6],
    "target_vertices": [32], "target_faces": [52], "edge_length": [0.3], "tets": [90], "points": [13], "cells": [5],
    "relax": [3], "top": [2], "share": [45.0], "most": [2], "bound": [9.0], "features": [0.4], "weight_factor": [0.5],
    "operator": ["uv.omt_refine"], "filepath": ["/gone.py"], "limit": [0.0], "extremities": [2],
    "texture_size": [777], "size": [64, 300], "margin": [9],
}  # fmt: skip
# What tetrahedra are made with hangs on what is installed; that settings of what takes longest reach the pipeline by
# their names is seen without a run.
NOT_TRIED = {
    ("object.omt_volume", "library"), ("uv.omt_flow", "move"),
    ("uv.omt_notices", "whole"),
    *(("object.omt_remesh", name) for name in ("density", "amount", "grading", "weight_factor", "sharp_angle",
                                               "use_preserve_boundary", "strategy")),
    *(("object.omt_match", name) for name in ("mirrored", "balance", "features")),
    *(("uv.omt_sphere", name) for name in ("quality", "method", "balance")),
}  # fmt: skip
LONG = {"object.omt_remesh", "object.omt_match", "object.omt_volume", "object.omt_similar"}
# What else is given for a property to count.
BESIDE: dict[tuple[str, str], dict] = {
    ("uv.omt_unwrap", "aspect"): {"boundary": "RECTANGLE"},
    ("uv.omt_unwrap", "corner_group"): {"boundary": "RECTANGLE"},
    ("uv.omt_unwrap", "centre_group"): {"boundary": "DISK"},
    ("uv.omt_unwrap", "mark_seams"): {"max_shear": 1.02},
    ("uv.omt_unwrap", "cut_further"): {"max_shear": 1.02},
    ("uv.omt_unwrap", "keep_free"): {"max_shear": 1.02},
    ("uv.omt_refine", "margin"): {"pack": True},
    ("uv.omt_refine", "tile"): {"pack": True},
    ("uv.omt_refine", "texture_size"): {"pack": True},
    ("uv.omt_magnify", "attribute"): {"region": "ATTRIBUTE"},
    ("uv.omt_magnify", "balance"): {"source": "MESH"},
    ("uv.omt_magnify", "max_shear"): {"source": "MESH"},
    ("uv.omt_magnify", "margin"): {"source": "MESH"},
    ("uv.omt_magnify", "tile"): {"source": "MESH"},
    ("uv.omt_magnify", "texture_size"): {"source": "MESH"},
    ("uv.omt_magnify", "use_subdivision"): {"source": "MESH"},
    ("uv.omt_magnify", "use_image"): {"image": "Picture"},
    ("uv.omt_magnify", "detail"): {"image": "Picture"},
    ("uv.omt_magnify", "detail_box"): {"image": "Picture", "detail": "Detail"},
    ("uv.omt_magnify", "image_size"): {"image": "Picture"},
    ("uv.omt_sphere", "weight_factor"): {"weight_group": "part"},
    ("uv.omt_sphere", "pole_group"): {"orientation": "GROUPS"},
    ("uv.omt_sphere", "meridian_group"): {"orientation": "GROUPS", "pole_group": "pole"},
    ("uv.omt_sphere", "east_group"): {"orientation": "GROUPS", "pole_group": "pole"},
    ("uv.omt_sphere", "image_layout"): {"image": "Picture"},
    ("uv.omt_seams", "extremities"): {"max_shear": 0.0},
    ("uv.omt_seams", "keep_free"): {"max_shear": 0.0},
    ("uv.omt_regions", "attribute"): {"kind": "ATTRIBUTE"},
    ("object.omt_remesh", "target_faces"): {"count_of": "FACES"},
    ("object.omt_remesh", "edge_length"): {"count_of": "EDGE"},
    ("object.omt_remesh", "weight_group"): {"density": "WEIGHTS"},
    ("object.omt_remesh", "density_attribute"): {"density": "ATTRIBUTE"},
    ("object.omt_remesh", "ratio"): {"levels": 2},
    ("object.omt_match", "shape_key"): {"mode": "WRAP"},
    ("object.omt_match", "factor"): {"mode": "MORPH"},
    ("object.omt_flow", "wall_object"): {"walls": "MESH"},
    ("object.omt_flow", "frames"): {"result": "KEY"},
    ("object.omt_volume", "body"): {"domain": "BODY"},
    ("object.omt_volume", "shells"): {"result": "SHELLS"},
    ("object.omt_volume", "points"): {"result": "POINTS"},
    ("object.omt_volume", "seed"): {"result": "POINTS"},
    ("object.omt_volume", "axis"): {"result": "SLICE"},
    ("object.omt_volume", "place"): {"result": "SLICE"},
    ("object.omt_similar", "centre_group"): {"start_group": "LM_1"},
    ("object.omt_similar", "start_group"): {"centre_group": "LM_2"},
}  # fmt: skip


class Choice(NamedTuple):
    """An operator, what it is called with, and what is said of that."""

    operator: str
    given: dict
    words: str = ""


def choices(operator: str) -> Iterator[Choice]:
    """The call of an operator from which others differ, and those, each by a property."""
    yield Choice(operator, BASE[operator])
    for prop in bpy.context.window_manager.operator_properties_last(operator).bl_rna.properties:
        name = prop.identifier
        if prop.is_readonly or name == "rna_type" or (operator, name) in NOT_TRIED:
            continue
        # By itself a property may count for nothing, which it is asked for as well where that takes no time.
        ways = [
            BESIDE.get((operator, name), {}),
            *([{}] if (operator, name) in BESIDE and operator not in LONG else []),
        ]
        for value in _values(operator, prop):
            for beside in ways:
                more = "".join(f" {key}={_plain(each)}" for key, each in beside.items())
                yield Choice(operator, {**BASE[operator], **beside, name: value}, f"{name}={_plain(value)}{more}")


def _values(operator: str, prop) -> list:
    given = BASE[operator].get(prop.identifier)
    if prop.identifier in VALUES:
        return [value for value in VALUES[prop.identifier] if value != given]
    return [value for value in operator_runs.other_values(prop) if value != given]


def _plain(value) -> str:
    """A value as a name has it."""
    if isinstance(value, (tuple, set)):
        return ",".join(map(_plain, sorted(value) if isinstance(value, set) else value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
