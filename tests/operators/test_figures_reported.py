"""Figures of what was made are told as they are: shares of regions from mesh and UVs, volumes, matches, and faces."""

from __future__ import annotations

import re
import sys
from types import SimpleNamespace

import bpy

import numpy as np
import operator_runs
import pytest
import scenes
from operator_runs import numbers


@pytest.fixture(scope="module")
def uvs(package):
    return operator_runs.some_uvs()


@pytest.fixture
def told(package, capfd):
    """Run an operator: the words that it reports, its warnings, and the rows it leaves in the panel."""

    def run(name, **arguments):
        lines = operator_runs.lines_told(capfd, name, **arguments)
        said, warned = (
            [line.removeprefix(kind) for line in lines if line.startswith(kind)] for kind in ("Info: ", "Warning: ")
        )
        return " ".join(said), warned, dict(package("session.last_run").state.summary.rows)

    return run


def read(body, group="region"):
    """Weights (m,) of the triangles of a body, the means of their corners; areas (m,) in space and in UVs."""
    obj = body.obj
    index = obj.vertex_groups[group].index
    weight = np.array([sum(g.weight for g in v.groups if g.group == index) for v in obj.data.vertices])
    corners = np.array([p.vertices[:] for p in obj.data.polygons])
    space, flat = scenes.areas(obj)
    return weight[corners].mean(axis=1), space, np.abs(flat)


def share(parts, of):
    weight, area = (np.concatenate([part[k] for part in parts]) for k in (0, of))
    return 100 * weight @ area / area.sum()


@pytest.mark.parametrize("source", ["MESH", "UV"])
@pytest.mark.parametrize("chosen, factor", [("A", 1.5), ("AB", 1.5), ("AB", 0.5)])
def test_shares_of_a_region_are_told_before_and_after(uvs, told, source, chosen, factor):
    found = operator_runs.bodies(uvs)
    scenes.set_uv(found["B"].obj, 0.5 * uvs["B"] + [1, 0])
    scenes.select([found[letter].obj for letter in chosen])
    before = [read(found[letter]) for letter in chosen]
    said, _, rows = told("uv.omt_magnify", quality="STANDARD", weight_group="region", factor=factor, source=source)
    after = [read(found[letter]) for letter in chosen]
    first = share(before, 1 if source == "MESH" else 2)
    if source == "MESH":
        last = share(after, 2)
    else:
        # Islands count as they have area before.
        size = [flat.sum() for *_, flat in before]
        last = sum(s * share([part], 2) for s, part in zip(size, after, strict=True)) / sum(size)
    expected = [first, last, factor * first]
    assert numbers(said) == pytest.approx(expected, rel=6e-4) and said.startswith("The region went from ")
    names = ("Region before", "Region now", "Region asked")
    assert [numbers(rows[name])[0] for name in names] == pytest.approx(expected, abs=6e-4)
    assert last == pytest.approx(expected[2], rel=2e-2)


def test_shares_of_several_regions_are_told_by_their_names(uvs, told):
    body = operator_runs.bodies(uvs)["A"]
    low = [v.index for v in body.obj.data.vertices if v.co.z < -0.3]
    body.obj.vertex_groups.new(name="low").add(low, 1.0, "REPLACE")
    scenes.select([body.obj])
    factors = {"region": 1.25, "low": 0.75}
    before = {name: share([read(body, name)], 1) for name in factors}
    said, _, rows = told("uv.omt_magnify", quality="STANDARD", weight_group="region", factor=1.25, further="low=0.75",
                         source="MESH")  # fmt: skip
    parts = said.removeprefix("Of the texture, ").split(", ")
    assert [part.split(" from ")[0] for part in parts] == list(factors)
    for part, (name, factor) in zip(parts, factors.items(), strict=True):
        expected = [before[name], share([read(body, name)], 2), factor * before[name]]
        assert numbers(part) == pytest.approx(expected, rel=6e-4), part
        assert numbers(rows[name]) == pytest.approx(expected[:2], abs=6e-4) and rows[name].count("%") == 2


@pytest.mark.parametrize("shift, told_of", [(0.0, 0.0), (0.4, 0.25)])
def test_uvs_that_leave_their_tile_are_told_by_how_far(uvs, told, shift, told_of):
    """Along either axis, from the tile that they were in."""
    magnify = sys.modules[scenes.class_of("uv.omt_magnify").__module__]
    objects = [SimpleNamespace(name="A"), SimpleNamespace(name="B")]
    for axis in range(2):
        uv = np.array([[0.1, 0.1], [0.85, 0.85]])
        uv[:, axis] += shift
        inside = np.array([[0.2, 0.2], [0.9, 0.4]])
        found = magnify._beyond(objects, SimpleNamespace(corners=[np.arange(2)] * 2, uv=[inside, uv]))
        assert [k for k, _ in found] == ([1] if told_of else [])
        assert [numbers(text)[0] for _, text in found] == ([told_of] if told_of else [])


@pytest.mark.parametrize("changes", [[0.0], [-0.02], [0.01, -0.03], [0.005, 0.001]])
def test_the_greatest_change_of_a_volume_is_told_whichever_way_it_goes(package, uvs, told, monkeypatch, changes):
    flow = package("pipelines.volumes.flow")

    def stand_in(points, *_):
        yield from ()
        return SimpleNamespace(frames=(points,), volumes=np.array(changes), drift=np.array(changes) / 2, missed=0.0,
                               surge=1.0, intersecting=np.array([1, 4]), steps=3, warnings=())  # fmt: skip

    monkeypatch.setattr(flow, "flow", stand_in)
    found = operator_runs.bodies(uvs)
    for body in found.values():
        body.obj.data.vertices[0].select = True
    most = max(map(abs, changes))
    said, warned, rows = told("object.omt_flow", move=(0, 0, 0.1), result="MESH")
    assert said.startswith("Moved ") and said.endswith(f"; volume change {most:.1e}")
    assert sorted(re.split(r", ", said.removeprefix("Moved ").partition(";")[0])) == ["A", "B"]
    assert rows["Volume change"].endswith(" %") and numbers(rows["Volume change"]) == [pytest.approx(100 * most)]
    assert rows["New intersections"] == "2"
    # Faces of the first object, which is the active one, by their own numbers.
    active = bpy.context.view_layer.objects.active
    assert [text for text in warned if "pass through" in text] == [
        f"{active.name}: Faces that newly pass through one another (2): 1, 4"
    ]
    assert [p.index for p in active.data.polygons if p.select] == [1, 4]


@pytest.mark.parametrize("met", [[], [True], [False, True, True]])
@pytest.mark.parametrize("meeting", [None, 0, 3])
def test_rows_of_a_match_are_those_of_its_result(package, met, meeting):
    figures = package("operators.shapes.match")._figures
    match = SimpleNamespace(found=SimpleNamespace(met=np.array(met, bool), flipped=0.0123), fit=0.0456,
                            figures=SimpleNamespace(mean_area=1.234), intersections=meeting)  # fmt: skip
    rows = dict(figures(match))
    assert rows["Landmarks met"] == (f"{sum(met)} of {len(met)}" if met else "none set")
    assert (rows["Flipped"], rows["Distance, rms"], rows["Area ratio, mean"]) == ("1.2 %", "4.6 %", "1.23")
    assert rows.get("Faces that meet") == (None if meeting is None else str(meeting))


@pytest.mark.parametrize(
    ("name", "wrong", "right"),
    [
        ("uv.omt_unwrap", {"keep_free": "nothing"}, {"max_shear": 0.0}),
        ("uv.omt_magnify", {"weight_group": "nothing"}, {"weight_group": "region", "factor": 1.5}),
        ("mesh.omt_partition", {"capacity_group": "nothing"}, {"cells": 3, "relax": 0}),
        ("object.omt_remesh", {"density": "WEIGHTS", "weight_group": "nothing"}, {"target_vertices": 40}),
    ],
)
def test_what_was_wrong_before_a_run_that_ends_well_is_no_longer_told(package, uvs, told, name, wrong, right):
    found, state = operator_runs.bodies(uvs), package("session.last_run").state
    scenes.select([found["A"].obj])
    with pytest.raises(RuntimeError, match="nothing"):
        told(name, **wrong)
    assert "nothing" in state.error and state.summary.refused
    told(name, **right)
    assert state.error == "" and not state.summary.refused
    report = package("operators.report").report_text(bpy.context)
    assert "last error: none" in report and "nothing" not in report
