"""Vertices that no face has play no part wherever they are, and if they are nowhere, as in damaged files: what comes of
a mesh is what comes of it without them, to the digit, or a refusal that names them."""

from __future__ import annotations

from dataclasses import astuple

import meshes
import numpy as np
import pytest

import omt_uv.solver as omt
from omt_uv.solver.comparison.comparison_figures import compare
from omt_uv.solver.errors import MeshError
from omt_uv.solver.partition import cut_along_cells, divide
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.signature import signature

V, F = meshes.bumpy(6, 6)
BALL, TRIANGLES = meshes.icosphere(2)
BALL = BALL * [1.0, 1.2, 0.8]
UV = V[F][:, :, :2]
PAINTED = np.clip(1.5 - 3 * np.hypot(*(V[:, :2] - V[:, :2].mean(axis=0)).T), 0, 1)
LOOSE = {"far": [90.0, -7.0, 80.0], "nowhere": [np.nan] * 3, "without end": [np.inf, 0.0, 0.0]}


def unwrapped(**options):
    return lambda more: omt.unwrap(more(V), F, **options).uv


# Arrays that come of a mesh whose vertices have more behind them.
FOUND = {
    "a free map": unwrapped(),
    "a disk": unwrapped(boundary="disk"),
    "a conformal map": unwrapped(kind="conformal"),
    "a polar map": unwrapped(kind="polar", boundary="disk"),
    "seams for a bound": lambda more: omt.unwrap(more(BALL), TRIANGLES, max_shear=1.3).uv,
    "refined UVs": lambda more: omt.refine(more(V), F, UV).uv,
    "a magnified region": lambda more: (
        omt.magnify(more(V), F, UV, np.append(PAINTED, np.ones(len(more(V)) - len(V))), 1.5).uv
    ),
    "a sphere": lambda more: omt.sphere_map(more(BALL), TRIANGLES).positions,
    "a new mesh": lambda more: omt.remesh(more(V), F, 30).vertices,
    "a new closed mesh": lambda more: omt.remesh(more(BALL), TRIANGLES, 60).vertices,
    "figures": lambda more: np.array([omt.distortion(more(V), F, UV).area_l1]),
    "a comparison": lambda more: np.array(
        [x for x in astuple(drain(compare((more(V), F), (more(V * [1, 1, 1.1]), F), 100))) if x is not None], float
    ),
    "cells": lambda more: cut_along_cells(more(V), F, drain(divide(more(V), F, 4))).positions,
    "a signature": lambda more: drain(signature(more(BALL), TRIANGLES, 50)).points,
}
# What needs every vertex to be one of the surface, or somewhere.
REFUSED = {("a sphere", place) for place in LOOSE} | {("a comparison", place) for place in ("nowhere", "without end")}


@pytest.mark.parametrize("name", FOUND)
def test_they_change_nothing_or_are_named(name):
    without = FOUND[name](lambda points: points)
    for place, at in LOOSE.items():
        if (name, place) not in REFUSED:
            found = FOUND[name](lambda points, at=at: np.concatenate([points, [at, at]]))
            np.testing.assert_allclose(found, without, rtol=1e-9, atol=1e-12)
            continue
        with pytest.raises(MeshError) as refused:
            FOUND[name](lambda points, at=at: np.concatenate([points, [at, at]]))
        n = len(BALL) if name == "a sphere" else len(V)
        assert refused.value.kind == "vertex" and set(refused.value.elements.tolist()) == {n, n + 1}
