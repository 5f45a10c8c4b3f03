"""A fingerprint changes with what operators read, and with nothing else."""

from __future__ import annotations

import bpy

import pytest
import scenes


def move(obj):
    obj.data.vertices[3].co.z += 1e-3


def mark(obj):
    obj.data.edges[0].use_seam = True


def scale(obj):
    obj.scale.x = 2
    bpy.context.view_layer.update()


def paint(obj):
    obj.data.attributes.new("heat", "FLOAT", "POINT").data[0].value = 0.5


def flag(obj):
    obj.data.attributes.new("flags", "BOOLEAN", "FACE").data[1].value = True


def mark_nothing(obj):
    """Numbers that are all 0 are not the same as none."""
    obj.data.attributes.new("heat", "FLOAT", "POINT")


def choose(obj):
    obj.data.polygons[2].select = not obj.data.polygons[2].select


def hide(obj):
    obj.data.polygons[2].hide = True


@pytest.mark.parametrize(
    "change",
    [move, mark, scale, paint, flag, mark_nothing, choose, hide, lambda obj: scenes.set_uv(obj, [[0.5, 0.5]] * 192)],
)
def test_what_operators_read_counts(package, change):
    obj, fingerprint = scenes.bump(), package("blender.fingerprint").fingerprint
    before = fingerprint(obj)
    assert fingerprint(obj) == before
    change(obj)
    assert fingerprint(obj) != before


def test_names_of_objects_and_flags_that_are_all_off_do_not_count(package):
    obj, fingerprint = scenes.bump(), package("blender.fingerprint").fingerprint
    before = fingerprint(obj)
    obj.data.attributes.new("flags", "BOOLEAN", "FACE")
    obj.name = "Other"
    assert fingerprint(obj) == before
    scenes.edit(obj)
    assert fingerprint(obj) != before
    scenes.leave_edit()
    assert fingerprint(obj) == before
