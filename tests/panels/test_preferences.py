"""What preferences give to operators, and what operators keep of their own."""

from __future__ import annotations

import types

import bpy

import pytest


@pytest.fixture
def chosen(package):
    """Preferences as they come with the add-on, to be changed, and operators that start as they come afterwards."""
    module = package("panels.preferences")
    settings = module.OMTUVPreferences.bl_rna.properties
    given = {name: settings[name].default for name in (*module.DEFAULTS, "own_thread")}
    before = package("session.run").threads
    yield types.SimpleNamespace(bl_rna=types.SimpleNamespace(properties=settings), **given)
    package("session.run").threads = before
    for name in module.OPERATORS:
        last = last_of(name)
        for setting in module.DEFAULTS:
            if setting in last.bl_rna.properties:
                last.property_unset(setting)


def last_of(name):
    group, _, verb = name.partition("_OT_")
    return bpy.context.window_manager.operator_properties_last(f"{group.lower()}.{verb}")


def test_operators_start_as_they_are_told_to(package, chosen):
    chosen.margin, chosen.max_shear, chosen.texture_size = 9, 1.8, 4096
    package("panels.preferences").apply(chosen, bpy.context)
    unwrap = last_of("UV_OT_omt_unwrap")
    assert unwrap.margin == 9 and unwrap.max_shear == pytest.approx(1.8) and unwrap.texture_size == 4096
    assert last_of("UV_OT_omt_density_set").texture_size == 4096


def test_preferences_as_they_come_change_no_operator(package, chosen):
    """Magnify has a bound of the shear of its own: that of Unwrap took its place in every window."""
    module = package("panels.preferences")
    module.apply(chosen, bpy.context)
    for name in module.OPERATORS:
        last = last_of(name)
        for setting in module.DEFAULTS:
            if setting in last.bl_rna.properties:
                assert getattr(last, setting) == last.bl_rna.properties[setting].default, (name, setting)


def test_operators_that_are_not_there_are_left_out(package, chosen, monkeypatch):
    """Those of a version of Blender that lacks what they need are not registered."""
    module = package("panels.preferences")
    monkeypatch.setattr(module, "OPERATORS", ("UV_OT_omt_of_no_such_name", *module.OPERATORS))
    chosen.margin = 11
    module.apply(chosen, bpy.context)
    assert last_of("UV_OT_omt_unwrap").margin == 11


@pytest.mark.parametrize("own", [False, True])
def test_runs_are_on_a_thread_of_their_own_where_that_is_preferred(package, chosen, own):
    package("session.run").threads = not own
    chosen.own_thread = own
    package("panels.preferences").apply(chosen, bpy.context)
    assert package("session.run").threads is own
