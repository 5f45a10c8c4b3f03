"""Of several objects the one that is wrong is named wherever it stands, and nothing is written; what is counted of
several is the sum of what is counted of each."""

from __future__ import annotations

import re

import bpy

import numpy as np
import operator_runs
import pytest
import scenes
from operator_runs import RUNS

ARRANGING = {"stack": ("uv.omt_stack", {}, "UVMap"), "symmetrize": ("uv.omt_symmetrize", {}, "UVMap"),
             "rectify": ("uv.omt_rectify", {}, "UVMap")}  # fmt: skip
# Those that measure, and bodies that flow or are filled.
MEASURING = {"measure": ("uv.omt_measure", {}, ""), "histogram": ("uv.omt_histogram", {}, ""),
             "get": ("uv.omt_density_get", {}, ""),
             "layout": ("uv.omt_layout_image", {"kind": "SHEAR", "size": 32}, ""),
             "worst": ("uv.omt_worst", {}, ""), "regions": ("uv.omt_regions", {}, ""),
             "strain": ("object.omt_strain", {"of": "UV"}, ""), "flow": ("object.omt_flow", {"move": (0, 0, 0.1)}, ""),
             "volume": ("object.omt_volume", {"tets": 100}, "")}  # fmt: skip
EVERY = RUNS | ARRANGING | MEASURING
# Of UVs alone.
NOT_OF_ONE = {"push"}


@pytest.fixture(scope="module")
def uvs(package):
    return operator_runs.some_uvs()


def run(name):
    operator, arguments, _ = EVERY[name]
    module, verb = operator.split(".")
    return lambda: getattr(getattr(bpy.ops, module), verb)("EXEC_DEFAULT", True, **arguments)


def halves(name, x=0.0, alone=0):
    """Grids of quads and their mirror images, with UVs, and some that have none."""
    y, u = np.mgrid[0:3, 0:3] / 2.0
    flat = np.stack([u + 0.2, y + 0.3 * u * y, 0.4 * u * (1 - y)], axis=-1).reshape(-1, 3)
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    points, faces = [flat, flat * [-1, 1, 1]], [quads, quads[:, [0, 3, 2, 1]] + 9]
    for k in range(alone):
        points.append(flat * (0.2 + 0.1 * k) + [-1.0, 2 + k, 0])
        faces.append(quads + 9 * (k + 2))
    # The box of the object has its middle where that of the halves is.
    points.append(np.array([[1.5, 0, 0], [-1.5, 0, 0]]))
    obj = scenes.add(np.concatenate(points), np.concatenate(faces), name)
    obj.location.x = x
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, 0.15 * uv + 0.4 + 0.03 * np.sin(9 * uv[:, ::-1]))
    return obj


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("name", [name for name in EVERY if name not in NOT_OF_ONE])
def test_the_one_that_is_wrong_is_named_and_nothing_is_written(uvs, name, place):
    if name in ARRANGING:
        objects = [halves("A"), halves("B", 4.0), halves("C", 8.0)]
        bad = objects[place]
        bad.data.uv_layers.remove(bad.data.uv_layers.active)
    else:
        objects = [body.obj for body in operator_runs.bodies(uvs).values()]
        bad = objects[0].copy()
        bad.data = objects[0].data.copy()
        bad.name = "C"
        bpy.context.collection.objects.link(bad)
        bad.data.vertices[5].co.x = float("nan")
        objects.insert(place, bad)
    for k, obj in enumerate(objects):
        # Those that are chosen come by their names, the active one first.
        obj.name = f"{'xyz'[k]} {obj.name}"
    scenes.select(objects[::-1])
    before = [scenes.state(obj) for obj in objects]
    said = scenes.error_of(run(name))
    assert bad.name in said and not any(obj.name in said for obj in objects if obj != bad), said
    # Numbers of vertices are those of the object that is named.
    assert name in ARRANGING or "(1 vertex: 5)" in said, said
    assert [scenes.state(obj) for obj in objects] == before


@pytest.mark.parametrize("name", ARRANGING)
def test_counts_of_several_are_sums(package, name):
    """What is arranged, and what is told to stay."""
    last_run = package("session.last_run")

    def counts(chosen):
        scenes.open_empty()
        objects = {"A": halves("A", 0.0, 1), "B": halves("B", 5.0, 3), "C": halves("C", 10.0)}
        scenes.select([objects[letter] for letter in chosen])
        last_run.state.notices.clear()
        assert run(name)() == {"FINISHED"}
        texts = [notice.text for notice in last_run.state.notices if "stay" in notice.text]
        return sum(int((re.findall(r"\d+", text) or [1])[0]) for text in texts)

    single = [counts(letter) for letter in "ABC"]
    assert counts("ABC") == counts("CBA") == sum(single)
    assert name != "symmetrize" or single == [1, 3, 0]
