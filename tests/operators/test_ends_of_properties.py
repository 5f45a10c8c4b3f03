"""Every number of an operator, at both ends of its range: what comes out is sound and differs, or is refused in a line.

Ends of what takes long with them are nearer, and what has no end is taken far.
"""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
import twin_scenes

DRAFT = {"quality": "DRAFT"}
MESHED = {"target_vertices": 30}
PUSHED = {"quality": "DRAFT", "weight_group": "region", "source": "UV", "factor": 1.5}
TETS = {"tets": 150}
CHARTS = {"quality": "DRAFT", "seams": "CHARTS"}
RECTANGLE = {"quality": "DRAFT", "max_shear": 0.0, "fill_holes": True, "boundary": "RECTANGLE"}

# Operator: objects, arguments, and of every number what is given besides; ends of its own, where it has some.
NUMBERS: dict = {
    "uv.omt_unwrap": ("Closed", DRAFT, {
        "balance": {}, "max_shear": {}, "margin": CHARTS, "tile": {}, "texture_size": CHARTS,
        "aspect": ("Band", RECTANGLE),
    }),
    "uv.omt_refine": ("Closed", DRAFT, {
        "balance": {}, "margin": {"pack": True}, "tile": {"pack": True}, "texture_size": {"pack": True},
    }),
    "uv.omt_magnify": ("Smooth", PUSHED | {"source": "MESH"}, {
        "margin": {}, "tile": {}, "texture_size": {}, "factor": {}, "cascade": ("Band", PUSHED),
        "max_shear": ("Closed", PUSHED | {"source": "MESH"}),
        "balance": {},
    }),
    "uv.omt_sphere": ("Closed", DRAFT | {"inside": False}, {
        "balance": {}, "weight_factor": {"weight_group": "region"},
    }),
    "uv.omt_seams": ("Closed", {"max_shear": 0.0}, {"max_shear": {}, "extremities": {}}),
    "uv.omt_density_set": ("Closed", {}, {"texture_size": {}, "density": {}}),
    "uv.omt_flow": ("Closed", {"move": (0.05, 0.0)}, {"radius": {}}),
    "uv.omt_checker": ("Closed", {}, {"size": {}}),
    "uv.omt_layout_image": ("Closed", {}, {"size": {}}),
    "object.omt_remesh": ("Closed", MESHED, {
        "target_vertices": {}, "target_faces": {"count_of": "FACES"}, "edge_length": {"count_of": "EDGE"},
        "weight_factor": {"density": "WEIGHTS", "weight_group": "region"}, "amount": {"density": "CURVATURE"},
        "grading": {"density": "WEIGHTS", "weight_group": "region"}, "levels": {}, "ratio": {"levels": 2},
        "sharp_angle": {"use_preserve_sharp": True},
    }),
    "object.omt_weights": ("Closed", {"kind": "MEAN", "show": False}, {"low": {}, "high": {}}),
    "object.omt_flow": ("Closed", {"rotate": (0.0, 0.0, 0.75)}, {
        "radius": {}, "samples": {}, "frames": {},
    }),
    "object.omt_volume": ("Closed", TETS, {
        "shells": {"result": "SHELLS"}, "points": {"result": "POINTS"}, "tets": {},
        "seed": {"result": "POINTS", "points": 30}, "place": {"result": "SLICE"},
    }),
    "object.omt_match": ("Wall Closed", {}, {
        "balance": {}, "features": {}, "factor": {"mode": "MORPH"},
    }),
    "mesh.omt_partition": ("Closed", {"cells": 5, "relax": 0}, {"cells": {}, "relax": {}, "seed": {}}),
}  # fmt: skip
# What stands for a number without an end.
FAR = 10000
# Ends in place of those of the range.
ENDS = {
    ("object.omt_remesh", "target_vertices"): (4, 150),
    ("object.omt_remesh", "target_faces"): (4, 300),
    ("object.omt_remesh", "edge_length"): (0.3, 1e6),
    ("object.omt_remesh", "levels"): (1, 3),
    ("object.omt_volume", "tets"): (10, 400),
    ("object.omt_volume", "points"): (1, 500),
    ("object.omt_volume", "shells"): (1, 4),
    ("object.omt_flow", "samples"): (1, 24),
    ("object.omt_flow", "frames"): (1, 5),
    ("mesh.omt_partition", "cells"): (1, 60),
    ("mesh.omt_partition", "relax"): (0, 5),
    ("uv.omt_checker", "size"): (256, 512),
    ("uv.omt_layout_image", "size"): (16, 256),
    ("uv.omt_magnify", "factor"): (0.25, 8.0),
    # Without a bound, and with one; one that is far is none.
    ("uv.omt_unwrap", "max_shear"): (0.0, 1.0625),
    ("uv.omt_seams", "max_shear"): (0.0, 1.0625),
    ("uv.omt_magnify", "max_shear"): (0.0, 1.0625),
    ("object.omt_remesh", "grading"): (0.0, 0.0625),
}
CASES = [(name, number) for name, (_, _, numbers) in NUMBERS.items() for number in numbers]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, package):
    made = tmp_path_factory.mktemp("ends")
    twin_scenes.prepare(made)
    return made


@pytest.fixture
def at(folder):
    """What an operator leaves with arguments, or why it left nothing."""

    def made(name, objects, arguments):
        twin_scenes.begin(folder, objects)
        before = twin_scenes.left()
        why = twin_scenes.refusal(name, arguments)
        if why is not None:
            assert twin_scenes.left() == before, "refused, and something is changed"
            return why
        for obj in (o for o in bpy.data.objects if o.type == "MESH"):
            points = np.array([v.co[:] for v in obj.data.vertices])
            assert np.isfinite(points).all(), obj.name
            for layer in obj.data.uv_layers:
                uv = np.zeros(2 * len(obj.data.loops), np.float32)
                layer.uv.foreach_get("vector", uv)
                assert np.isfinite(uv).all() and np.abs(uv).max(initial=0) < 1e6, (obj.name, layer.name)
        return twin_scenes.left()

    return made


def ends(name, number):
    """Both ends of a number."""
    module, verb = name.split(".")
    prop = getattr(getattr(bpy.ops, module), verb).get_rna_type().properties[number]
    kind = int if prop.type == "INT" else float
    low, high = ENDS.get((name, number), (max(prop.hard_min, -FAR), min(prop.hard_max, max(prop.soft_max, FAR))))
    return kind(low), kind(high)


@pytest.mark.parametrize(("name", "number"), CASES)
def test_both_ends_are_sound_and_differ_or_are_refused(at, name, number):
    objects, arguments, numbers = NUMBERS[name]
    besides = numbers[number]
    if isinstance(besides, tuple):
        objects, arguments = besides
        besides = {}
    made = [at(name, objects, arguments | besides | {number: end}) for end in ends(name, number)]
    for found in made:
        if isinstance(found, str):
            assert len(found.strip().splitlines()) == 1 and found.startswith("Error: ") and len(found) > 25, found
            assert "Traceback" not in found and "defect" not in found
    assert made[0] != made[1], "both ends are alike"
    assert not all(isinstance(found, str) for found in made)


def test_every_number_is_taken_to_its_ends(package):
    """But those of a window, of moves and marks, which have no ends, and of what looks and lists alone."""
    without = {"uv.omt_queue", "uv.omt_regions", "uv.omt_density_get", "uv.omt_worst", "object.omt_similar",
               "object.omt_landmarks_suggest"}  # fmt: skip
    elsewhere = {("uv.omt_magnify", "image_size")}
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    for name in {scenes.name_of(c) for c in classes} - without:
        module, verb = name.split(".")
        properties = getattr(getattr(bpy.ops, module), verb).get_rna_type().properties
        there = {p.identifier for p in properties if p.type in ("INT", "FLOAT") and not p.is_array}
        missing = {p for p in there if (name, p) not in elsewhere} - set(NUMBERS.get(name, ("", {}, {}))[2])
        assert not missing, (name, missing)
