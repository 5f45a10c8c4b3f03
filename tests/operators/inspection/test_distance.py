"""object.omt_distance: distances from another object, as an attribute, as colours, and in words."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture
def two(package, monkeypatch):
    """A bump, and a copy of it that is turned, and 0.25 higher in the world."""
    # A hundred thousand points take most of the time of so small a mesh.
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 2000)
    first = scenes.bump()
    for vertex in first.data.vertices:
        vertex.co.z = 0
    second = first.copy()
    second.data = first.data.copy()
    bpy.context.scene.collection.objects.link(second)
    second.location.z = 0.25
    bpy.context.view_layer.update()
    for obj in (first, second):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = second
    return first, second


def test_the_active_object_gets_its_distances(package, two):
    first, second = two
    space = next(a for w in bpy.context.window_manager.windows for a in w.screen.areas if a.type == "VIEW_3D").spaces[0]
    before = space.shading.color_type
    assert bpy.ops.object.omt_distance() == {"FINISHED"}
    values = np.zeros(len(second.data.vertices), np.float32)
    second.data.attributes["OMT Distance"].data.foreach_get("value", values)
    assert values == pytest.approx(0.25, abs=1e-6)
    assert second.data.color_attributes.active_color.name == "OMT UV Distortion"
    assert "OMT Distance" not in first.data.attributes
    # The views show it, and Off gives their shading back.
    assert space.shading.color_type == "VERTEX" and package("display.overlay").kind() == "OTHER"
    bpy.ops.uv.omt_overlay(show="NONE")
    assert space.shading.color_type == before
    assert not second.data.color_attributes


def test_one_object_or_three_are_refused(two):
    first, second = two
    first.select_set(False)
    assert "Select two mesh objects" in scenes.error_of(bpy.ops.object.omt_distance)
    first.select_set(True)
    second.data.attributes.new("OMT Distance", "INT", "FACE")
    assert "another attribute" in scenes.error_of(bpy.ops.object.omt_distance)
    assert not second.data.color_attributes
