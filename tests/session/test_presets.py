"""Presets: values and nothing else, and only those that the operator has."""

from __future__ import annotations

import bpy

import pytest


def test_ours_are_found_and_apply(package):
    presets = package("session.presets")
    found = presets.files("uv.omt_unwrap")
    assert {"Character", "Lightmap", "Scan"} <= {path.stem for path in found}
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    for path in found:
        presets.choose(path, properties)
        for name, value in presets.values(path).items():
            if name in properties.bl_rna.properties:
                got = getattr(properties, name)
                assert got == (pytest.approx(value) if isinstance(value, float) else value), name


def test_a_preset_that_is_chosen_is_told_by_its_name(package, capfd):
    for path in package("session.presets").files("uv.omt_unwrap"):
        assert bpy.ops.uv.omt_preset(filepath=str(path)) == {"FINISHED"}
        told = capfd.readouterr().out
        assert f"Info: {path.stem}: the settings are chosen, nothing has been unwrapped yet" in told


def test_nothing_in_a_preset_is_run(package, tmp_path):
    path = tmp_path / "bad.py"
    path.write_text("import bpy\nop = bpy.context.active_operator\nop.margin = 8\nop.unknown = 1\n")
    assert package("session.presets").values(path) == {"margin": 8, "unknown": 1}
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    package("session.presets").choose(path, properties)
    assert properties.margin == 8
    path.write_text(f"op.margin = open({str(tmp_path / 'made')!r}, 'w')\n")
    with pytest.raises(ValueError, match="malformed"):
        package("session.presets").values(path)
    assert not (tmp_path / "made").exists()


@pytest.mark.skipif(not hasattr(bpy.utils, "register_preset_path"), reason="Blender lists no presets of add-ons")
def test_menus_of_presets_list_ours_while_we_are_registered(package):
    presets = package("session.presets")
    ours = str(presets.FOLDER / "presets" / "operator" / "uv.omt_unwrap")
    assert ours in bpy.utils.preset_paths("operator/uv.omt_unwrap")
    presets.unregister_folder()
    assert ours not in bpy.utils.preset_paths("operator/uv.omt_unwrap")
    presets.register_folder()
    assert ours in bpy.utils.preset_paths("operator/uv.omt_unwrap")


@pytest.mark.parametrize("bad", ["op.margin = 1e999", "op.margin = 'wide'", "op.seams = 'NONE_SUCH'"])
@pytest.mark.parametrize("chosen", [None, 24])
def test_a_preset_that_cannot_be_used_leaves_every_setting_as_it_was(package, tmp_path, bad, chosen):
    """Those that were chosen are, and those that were not still follow their defaults."""
    presets, path = package("session.presets"), tmp_path / "bad.py"
    path.write_text(f"op.max_shear = 1.5\nop.texture_size = 512\n{bad}\n")
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    for name in ("max_shear", "texture_size", "margin", "seams"):
        properties.property_unset(name)
    if chosen is not None:
        properties.margin = properties.texture_size = chosen
        properties.seams = "CHARTS"
    names = ("max_shear", "texture_size", "margin", "seams")
    before = {name: (getattr(properties, name), properties.is_property_set(name)) for name in names}
    with pytest.raises(presets.PresetError, match=r"bad\.py cannot be used"):
        presets.choose(path, properties)
    assert {name: (getattr(properties, name), properties.is_property_set(name)) for name in names} == before
    for name in names:
        properties.property_unset(name)


REFUSED = {"large": "10**20", "text": "'x'", "list": "[1, 2]", "nothing": "None", "endless": "1e999", "bytes": "b'8'"}


@pytest.mark.parametrize("value", REFUSED)
@pytest.mark.parametrize("was_set", [True, False])
def test_what_no_property_takes_leaves_all_of_them_as_they_were(value, was_set, package, tmp_path):
    presets, path = package("session.presets"), tmp_path / "odd.py"
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    properties.property_unset("margin")
    if was_set:
        properties.margin = 5
    number = "100000000000000000000" if value == "large" else REFUSED[value]
    path.write_text(f"op.balance = 0.25\nop.margin = {number}\n")
    balance = properties.balance, properties.is_property_set("balance")
    with pytest.raises(presets.PresetError, match=r"odd\.py cannot be used: .*Choose another one"):
        presets.choose(path, properties)
    assert (properties.balance, properties.is_property_set("balance")) == balance
    assert properties.is_property_set("margin") == was_set and (not was_set or properties.margin == 5)
    properties.property_unset("margin")
