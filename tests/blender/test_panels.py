"""Panels and menus draw what exists. There is no window here, so a recording layout stands in for Blender's."""

from __future__ import annotations

import types

import bpy

import pytest


class Layout:
    """Takes every call that the panels make, and checks names against the operators."""

    def __init__(self, record):
        self.record = record

    def column(self, **_):
        return Layout(self.record)

    def separator(self, **_):
        pass

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, name
        self.record.append(name)

    def operator(self, name, **_):
        group, verb = name.split(".")
        assert verb in dir(getattr(bpy.ops, group)), name
        self.record.append(name)
        return types.SimpleNamespace()


SETTINGS = [
    *("boundary", "balance", "quality", "seams", "keep_free", "fill_holes", "max_shear"),
    *("pack", "margin", "texture_size", "uv_layer"),
]


@pytest.mark.parametrize("name", ["VIEW3D_PT_omt_uv", "IMAGE_PT_omt_uv"])
def test_sidebar_shows_every_setting(name):
    record = []
    panel = getattr(bpy.types, name)
    assert panel.poll(bpy.context)
    panel.draw(types.SimpleNamespace(layout=Layout(record)), bpy.context)
    assert record == [*SETTINGS, "uv.omt_unwrap", "uv.omt_refine", "uv.omt_seams", "uv.omt_measure"]


def test_redo_panel_shows_every_setting(package):
    record = []
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    package("operators.unwrap").draw_settings(Layout(record), properties)
    assert record == SETTINGS
    assert set(SETTINGS) == {p.identifier for p in properties.bl_rna.properties if not p.is_readonly} - {"rna_type"}


def test_refine_shows_every_setting():
    record = []
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_refine")
    settings = {p.identifier for p in properties.bl_rna.properties if not p.is_readonly} - {"rna_type"}
    stand_in = types.SimpleNamespace(layout=Layout(record), bl_rna=properties.bl_rna, keep_boundary=False, pack=True)
    bpy.types.UV_OT_omt_refine.draw(stand_in, bpy.context)
    assert set(record) == settings
    assert len(record) == len(settings)


def test_menu_entry(package):
    record = []
    package("panels.menus").draw_unwrap(types.SimpleNamespace(layout=Layout(record)), bpy.context)
    assert record == ["uv.omt_unwrap", "uv.omt_refine", "uv.omt_seams", "uv.omt_measure"]


def test_the_choices_are_those_of_the_solver_and_of_the_command(package):
    """One list of boundaries and qualities, known to the solver."""
    settings, solver = package("settings"), package("solver.parameterize")
    assert {i.lower() for i, *_ in settings.BOUNDARIES} == set(solver.BOUNDARIES)
    operator = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").bl_rna.properties
    assert [item.identifier for item in operator["boundary"].enum_items] == [i for i, *_ in settings.BOUNDARIES]
    assert [item.identifier for item in operator["quality"].enum_items] == [i for i, *_ in settings.QUALITIES]
