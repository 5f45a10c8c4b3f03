"""Two bodies with UVs, a region and all that operators ask for, and a call of each operator that writes to meshes."""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy

import numpy as np
import renumbered
import scenes
from renumbered import Order
from sphere_shapes import blob

DRAFT = {"quality": "DRAFT"}
# Operator, arguments, and what it changes: names of what `renumbered.told` has.
RUNS: dict[str, tuple[str, dict, str]] = {
    "unwrap": ("uv.omt_unwrap", {**DRAFT, "max_shear": 0.0, "keep_free": "region"}, "UVMap"),
    "refine": ("uv.omt_refine", DRAFT, "UVMap"),
    "magnify": ("uv.omt_magnify", {**DRAFT, "weight_group": "region", "factor": 1.5, "source": "UV"}, "UVMap"),
    "sphere": ("uv.omt_sphere", {**DRAFT, "weight_group": "region"}, "UVMap"),
    "density": ("uv.omt_density_set", {"density": 40.0}, "UVMap"),
    "push": ("uv.omt_flow", {"start": (0.5, 0.5), "move": (0.0, 0.1), "radius": 0.5}, "UVMap"),
    "seams": ("uv.omt_seams", {"max_shear": 0.0, "keep_free": "region"}, "seams"),
    "weights": ("object.omt_weights", {"kind": "GAUSSIAN", "weight_group": "new"}, "group new"),
    "mean": ("object.omt_weights", {"kind": "MEAN", "weight_group": "region"}, "group region"),
    "cells": ("mesh.omt_partition",
              {"cells": 4, "relax": 0, "write": "ATTRIBUTE", "capacity_group": "region"}, "OMT Cell"),
    "attributes": ("uv.omt_attributes", {}, "OMT UV Area"),
    "overlay": ("uv.omt_overlay", {}, "OMT UV Distortion"),
}  # fmt: skip
GROUPS = ("weight_group", "keep_free", "capacity_group")


@dataclass(frozen=True)
class Scene:
    """How two bodies are made: in which order (`renumbered.Order`), the second one first, and what things are
    called."""

    kind: str = ""
    backwards: bool = False
    group: str = "region"
    layer: str = "UVMap"
    objects: tuple[str, str] = ("A", "B")


@dataclass(frozen=True)
class Body:
    """An object, the faces of its mesh in the first order, and its order."""

    obj: bpy.types.Object
    faces: np.ndarray
    order: Order

    def told(self) -> dict:
        return renumbered.told(self.obj, self.faces, self.order)


def bodies(uvs: dict, scene: Scene = Scene()) -> dict[str, Body]:
    """A new file with two bodies, "A" and "B" whatever their objects are called, with UVs (240,2) of their corners;
    both selected, the one that was made last active."""
    scenes.open_empty()
    found = {}
    for k in (1, 0) if scene.backwards else (0, 1):
        V, F = blob(1, seed=k + 1)
        V = V * [1.0, 1.3, 0.8] * (1 + 0.2 * V[:, :1])
        order = Order.of(scene.kind, len(V), len(F))
        obj = renumbered.add(V, F, order, scene.objects[k])
        obj.location.x = 4.0 * k
        group = obj.vertex_groups.new(name=scene.group)
        group.add(np.flatnonzero(V[order.vertices, 2] > 0.3).tolist(), 0.8, "REPLACE")
        renumbered.set_uv(obj, F, order, uvs["AB"[k]], scene.layer)
        found["AB"[k]] = Body(obj, F, order)
    scenes.select([body.obj for body in found.values()])
    return found


def some_uvs() -> dict:
    """UVs of both bodies that are not those that unwrapping gives."""
    found = bodies(dict.fromkeys("AB", np.zeros((240, 2))))
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0) == {"FINISHED"}
    uvs = {name: scenes.uv_of(body.obj).astype(float) for name, body in found.items()}
    return {name: 0.8 * uv + 0.1 * uv**2 for name, uv in uvs.items()}


def call(name: str, group: str = "region") -> None:
    """Run an operator of `RUNS`, with a region of another name."""
    operator, arguments, _ = RUNS[name]
    given = {key: group if key in GROUPS and value == "region" else value for key, value in arguments.items()}
    module, verb = operator.split(".")
    assert getattr(getattr(bpy.ops, module), verb)("EXEC_DEFAULT", True, **given) == {"FINISHED"}


def lines_told(capfd, name, **arguments):
    """Run an operator to its end: the lines that it printed."""
    capfd.readouterr()
    module, verb = name.split(".")
    assert getattr(getattr(bpy.ops, module), verb)(**arguments) == {"FINISHED"}
    return capfd.readouterr().out.splitlines()


def numbers(text):
    """The numbers in a text."""
    return [float(x) for x in re.findall(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?", text)]


def other_values(prop):
    """Values of a property that are not its default."""
    if prop.type == "BOOLEAN":
        return [not prop.default]
    if prop.type == "ENUM":
        return [item.identifier for item in prop.enum_items if item.identifier != prop.default]
    if prop.type == "STRING":
        return ["some"]
    top = min(prop.hard_max, prop.default + 3)
    value = prop.default + (top - prop.default) / 2 if top > prop.default else (prop.default + prop.hard_min) / 2
    return [int(value) if prop.type == "INT" else value]
