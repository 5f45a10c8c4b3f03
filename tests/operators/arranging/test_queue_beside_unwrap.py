"""Whatever Unwrap is set to, the queue does to each object as Unwrap does to it alone, and tells the same of it."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from operator_runs import other_values

UNWRAP = "uv.omt_unwrap"
# What names vertex groups, and what else it takes that it counts.
GROUPS = {
    "keep_free": {"max_shear": 0.0},
    "centre_group": {"boundary": "DISK"},
    "start_group": {"boundary": "DISK"},
    "corner_group": {"boundary": "RECTANGLE"},
}
BASE = {"quality": "DRAFT", "max_shear": 0.0}


def chosen():
    return bpy.context.window_manager.operator_properties_last(UNWRAP)


@pytest.fixture
def settings():
    """Set properties of Unwrap; they are as they were at the end."""
    names = set()

    def let(**given):
        names.update(given)
        for name, value in given.items():
            setattr(chosen(), name, value)

    let(**BASE)
    yield let
    for name in names:
        chosen().property_unset(name)


def objects():
    """Two different open patches, one of them closed up to a slit and subdivided, each with groups of its own."""
    scenes.open_empty()
    found = [scenes.bump(6, 4, name="One"), scenes.bump(5, 5, 0.9, name="Other", offset=3.0)]
    found[1].modifiers.new("Smooth", "SUBSURF").levels = 1
    for obj, corners in zip(found, ([0, 6, 34, 28], [0, 5, 35, 30]), strict=True):
        groups = {"keep_free": [8, 9], "centre_group": [16], "start_group": [corners[1]], "corner_group": corners}
        for name, vertices in groups.items():
            obj.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    return found


def left(obj):
    layers = {layer.name: scenes.uv_of(obj, layer.name) for layer in obj.data.uv_layers}
    return layers, [edge.index for edge in obj.data.edges if edge.use_seam]


def runs(package, settings, given):
    """What is left of each object, and told, of both ways."""
    summary = package("session.last_run").state
    found = []
    for queued in (False, True):
        result, told = [], []
        both = objects()
        scenes.select(both)
        settings(**given)
        for obj in both if not queued else [None]:
            if obj is None:
                bpy.ops.uv.omt_queue()
            else:
                scenes.select([obj])
                values = {name: getattr(chosen(), name) for name in (*BASE, *given)}
                bpy.ops.uv.omt_unwrap(**values)
            told += [notice.text for notice in summary.summary.notices]
        for obj in both:
            result.append(left(obj))
        found.append((result, told))
    return found


CASES = [(name, {name: name, **more}) for name, more in GROUPS.items()]
CASES += [("nothing", {}), ("cuts that are marked", {"mark_seams": True, "max_shear": 1.02})]
CASES += [("folded by a disk without Pack", {"pack": False, "boundary": "DISK", "tile": 1012})]


def every_setting():
    properties = bpy.ops.uv.omt_unwrap.get_rna_type().properties
    for prop in properties:
        if prop.is_readonly or prop.identifier in ("rna_type", *GROUPS) or getattr(prop, "is_array", False):
            continue
        # A bound of the shear makes patches like these fall apart, and takes long.
        value = other_values(prop)[0] if prop.identifier not in BASE else {"quality": "STANDARD", "max_shear": 1.1}
        yield prop.identifier, {prop.identifier: value[prop.identifier] if isinstance(value, dict) else value}


def check(package, settings, given):
    (alone, told), (queued, notices) = runs(package, settings, given)
    for (layers, seams), (other, others) in zip(alone, queued, strict=True):
        assert layers.keys() == other.keys() and seams == others
        for name, uv in layers.items():
            np.testing.assert_array_equal(uv, other[name])
    assert sorted(told) == sorted(notices)
    return alone


@pytest.mark.parametrize(("name", "given"), CASES, ids=[name for name, _ in CASES])
def test_groups_and_seams_of_unwrap_count_in_the_queue(package, settings, name, given):
    alone = check(package, settings, given)
    if name in ("centre_group", "start_group", "corner_group"):
        without = check(package, settings, {key: value for key, value in given.items() if key != name} | {name: ""})
        assert not np.array_equal(alone[0][0]["UVMap"], without[0][0]["UVMap"])


def test_every_setting_of_unwrap_counts_in_the_queue(package, settings):
    for name, given in every_setting():
        check(package, settings, given)
        chosen().property_unset(name)
        settings(**BASE)


@pytest.mark.parametrize("name", GROUPS)
def test_a_group_that_no_object_has_is_told_before_anything_is_done(package, settings, name):
    scenes.select(objects())
    settings(**{name: "nowhere", "boundary": "DISK"})
    assert "no vertex group 'nowhere'" in scenes.error_of(bpy.ops.uv.omt_queue)
    settings(**{name: name})
    # One that some have is left out for the others.
    bpy.data.objects["One"].vertex_groups.remove(bpy.data.objects["One"].vertex_groups[name])
    assert bpy.ops.uv.omt_queue() == {"FINISHED"}
    assert dict(package("session.last_run").state.summary.rows)["Done"] == "2 of 2"


def test_folds_that_are_left_are_told_by_the_queue(package, settings, monkeypatch):
    """A last look at what was written is not that of the solver."""
    gate = package("pipelines.gate")
    seen = []

    def folded(readings, apart=False):
        seen.append(apart)
        return gate.Gate(5, 2, 0.25)

    monkeypatch.setattr(gate, "gate", folded)
    scenes.select([scenes.bump(name="A"), scenes.bump(name="B")])
    for pack in (True, False):
        settings(pack=pack)
        assert bpy.ops.uv.omt_queue() == {"FINISHED"}
        told = [notice.text for notice in package("session.last_run").state.summary.notices]
        assert sum("2 faces are folded in the UVs" in text for text in told) == 2
        assert sum("25 %" in text for text in told) == 2
    assert seen == [False, False, True, True]
