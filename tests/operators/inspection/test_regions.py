"""uv.omt_regions and uv.omt_attributes: a table in the clipboard, and values that nodes can read."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture
def bump():
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    obj.vertex_groups.new(name="half").add([v.index for v in obj.data.vertices if v.co.x < 1.1], 1.0, "REPLACE")
    return obj


def test_regions_are_measured_and_nothing_changes(bump):
    before = len(bump.data.attributes)
    assert bpy.ops.uv.omt_regions(kind="GROUPS") == {"FINISHED"}
    assert len(bump.data.attributes) == before
    assert "no material" in scenes.error_of(bpy.ops.uv.omt_regions, kind="MATERIALS")
    assert "No attribute is named" in scenes.error_of(bpy.ops.uv.omt_regions, kind="ATTRIBUTE")
    assert "no attribute 'x'" in scenes.error_of(bpy.ops.uv.omt_regions, kind="ATTRIBUTE", attribute="x")


def test_values_agree_with_the_figures_and_a_second_run_fills_them_again(package, bump):
    for _ in range(2):
        assert bpy.ops.uv.omt_attributes() == {"FINISHED"}
    values = np.zeros(len(bump.data.polygons), np.float32)
    bump.data.attributes["OMT UV Shear"].data.foreach_get("value", values)
    found = package("pipelines.measuring.per_face").face_values(package("blender.mesh").read(bump))
    assert values == pytest.approx(found.shear, rel=1e-5) and values.max() > 1.01
    assert len([a for a in bump.data.attributes if a.name.startswith("OMT UV")]) == 3


def test_another_attribute_of_that_name_is_refused_and_nothing_changes(bump):
    bump.data.attributes.new("OMT UV Stretch", "INT", "POINT")
    assert "another attribute 'OMT UV Stretch'" in scenes.error_of(bpy.ops.uv.omt_attributes)
    assert "OMT UV Area" not in bump.data.attributes
    bpy.ops.object.mode_set(mode="EDIT")
    assert "Object Mode" in scenes.error_of(bpy.ops.uv.omt_attributes)


def test_texel_densities_are_those_of_the_texture_that_is_chosen(package, bump, monkeypatch):
    """Nothing else in the table is of the texture."""
    region_figures = package("pipelines.measuring.region_figures")
    tables, told = [], region_figures.table_text
    monkeypatch.setattr(region_figures, "table_text", lambda rows, *more: tables.append(rows) or told(rows, *more))
    for size in (1024, 256):
        assert bpy.ops.uv.omt_regions(kind="GROUPS", texture_size=size) == {"FINISHED"}
    assert len(tables[0]) == 2
    for one, other in zip(*tables, strict=True):
        first, second = vars(one), vars(other)
        assert first.pop("texel_density") == pytest.approx(4 * second.pop("texel_density"))
        assert first == second


@pytest.mark.parametrize("kind", ["INT", "BOOLEAN"])
def test_values_of_an_attribute_are_regions_in_edit_mode_too(package, bump, monkeypatch, kind):
    region_figures = package("pipelines.measuring.region_figures")
    tables, told = [], region_figures.table_text
    monkeypatch.setattr(region_figures, "table_text", lambda rows, *more: tables.append(rows) or told(rows, *more))
    values = np.arange(len(bump.data.polygons)) % 2
    bump.data.attributes.new("zone", kind, "FACE").data.foreach_set("value", values.tolist())
    for enter in (lambda: None, lambda: scenes.edit(bump)):
        enter()
        assert bpy.ops.uv.omt_regions(kind="ATTRIBUTE", attribute="zone") == {"FINISHED"}
    assert tables[0] == tables[1] and len(tables[0]) == 3
    assert len(bpy.data.meshes) == 1
