"""Rows that the panel shows of several objects come of those of each, in the way that the row is meant; and what is
reported names every object, in either order."""

from __future__ import annotations

import re

import bpy

import operator_runs
import pytest
import scenes

DRAFT = {"quality": "DRAFT"}
WORST, LEAST, ALL = max, min, sum
# Operator, arguments, and how rows of several come of those of each; what has no way is between the least and the most.
ROWS = {
    "sphere": ("uv.omt_sphere", DRAFT, {"Area error": WORST, "Shear": WORST, "Folds on the sphere": ALL}),
    "volume": (
        "object.omt_volume",
        {"tets": 200, "result": "ATTRIBUTE"},
        {"Tetrahedra": ALL, "Inverted": ALL, "Volume error": WORST},
    ),
    "cells": (
        "mesh.omt_partition",
        {"cells": 4, "relax": 0, "write": "ATTRIBUTE"},
        {"Cells": ALL, "Area error": WORST, "Of whole faces": WORST, "Least distance": LEAST},
    ),
    "points": (
        "mesh.omt_partition",
        {"cells": 3, "relax": 0, "write": "POINTS"},
        {"Cells": ALL, "Area error": WORST, "Least distance": LEAST},
    ),
    "remesh": ("object.omt_remesh", {"target_vertices": 40}, {"Vertices": ALL, "Triangles": ALL, "Angles, 99 %": None}),
    "measure": (
        "uv.omt_measure",
        {},
        # Areas are shares of those of all, and objects may lie on one another.
        {"Shear": None, "Folded faces": ALL, "Islands": ALL},
    ),
}
# A percentile lies between two values of those that it is of, and of all between two others.
BETWEEN = {"Angles, 99 %": 0.5}
# What is said of one object alone.
NAMED = {"volume", "points", "remesh"}


@pytest.fixture(scope="module")
def uvs(package):
    return operator_runs.some_uvs()


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def number(text):
    return float(NUMBER.findall(text)[0])


def unit(text):
    return NUMBER.sub("#", text, count=1)


@pytest.fixture
def rows(package, uvs, capfd):
    """Rows of some of three bodies, and the words that are reported."""

    def of(name, chosen):
        found = {letter: body.obj for letter, body in operator_runs.bodies(uvs).items()}
        scenes.set_uv(found["B"], 0.5 * scenes.uv_of(found["B"]) * [1, 0.7] + [1.5, 0])
        scenes.select([found[letter] for letter in chosen])
        operator, arguments, _ = ROWS[name]
        module, verb = operator.split(".")
        capfd.readouterr()
        assert getattr(getattr(bpy.ops, module), verb)("EXEC_DEFAULT", True, **arguments) == {"FINISHED"}
        said = [line for line in capfd.readouterr().out.splitlines() if line.startswith("Info: ")]
        summary = package("session.last_run").state.summary
        assert sorted(summary.objects) == sorted(obj.name for obj in bpy.context.selected_objects)
        return dict(summary.rows), " ".join(said)

    return of


@pytest.mark.parametrize("name", ROWS)
def test_rows_of_several_come_of_those_of_each(rows, name):
    if name == "volume":
        pytest.importorskip("tetgen")
    ways = ROWS[name][2]
    each = [rows(name, letter)[0] for letter in "AB"]
    # Otherwise those of both would say nothing of which of them counts.
    assert all(each[0][row] != each[1][row] for row, way in ways.items() if way in (WORST, LEAST))
    for order in ("AB", "BA"):
        both, said = rows(name, order)
        assert ways.keys() <= both.keys()
        for row, way in ways.items():
            values, found = [number(one[row]) for one in each], number(both[row])
            assert {unit(one[row]) for one in each} == {unit(both[row])}
            if way is None:
                room = BETWEEN.get(row, 0)
                assert min(values) - room <= found <= max(values) + room, (row, values, found)
            else:
                assert found == pytest.approx(way(values)), (row, values, found)
        if name in NAMED:
            assert re.search(r"\bA\b|\bA_", said) and re.search(r"\bB\b|\bB_", said), said
