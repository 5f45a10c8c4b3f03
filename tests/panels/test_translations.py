"""Other languages have the same values in their words, and what they translate is there."""

from __future__ import annotations

import re

import bpy

import pytest


@pytest.mark.parametrize("language", ["de_DE", "ja_JP"])
def test_words_keep_their_values_and_are_of_the_tab(package, language):
    table = package("panels.translations.registered").LANGUAGES[language]
    others = package("panels.translations.registered").LANGUAGES.values()
    assert all(set(other) == set(table) for other in others)
    for text, words in table.items():
        assert words and text.count("{}") == words.count("{}"), text
        assert not re.search(r"^\s|\s$", words)


# What measures, compares and magnifies, with the maps of the papers and the globe.
SPOKEN = (
    "uv.omt_magnify uv.omt_region_add uv.omt_region_remove object.omt_weights uv.omt_measure uv.omt_overlay "
    "uv.omt_histogram uv.omt_regions uv.omt_attributes uv.omt_layout_image object.omt_diagram uv.omt_checker "
    "uv.omt_checker_remove uv.omt_worst object.omt_distance object.omt_compare uv.omt_unwrap uv.omt_sphere"
)


@pytest.mark.parametrize("name", SPOKEN.split())
def test_labels_settings_and_choices_have_words(package, name):
    group, verb = name.split(".")
    operator = getattr(getattr(bpy.ops, group), verb).get_rna_type()
    found = {operator.name}
    for prop in operator.properties:
        if prop.identifier == "rna_type" or prop.is_hidden:
            continue
        found.add(prop.name)
        if prop.type == "ENUM":
            found |= {item.name for item in prop.enum_items}
    missing = found - set(package("panels.translations.registered").LANGUAGES["de_DE"])
    assert not missing


def test_blender_speaks_them(package):
    view = bpy.context.preferences.view
    words = package("panels.section").words
    available = [item.identifier for item in view.bl_rna.properties["language"].enum_items]
    if "de_DE" not in available:
        pytest.skip("this Blender was built without languages")
    before = view.language
    try:
        view.language, view.use_translate_interface = "de_DE", True
        assert words("{} objects", 5) == "5 Objekte"
    finally:
        view.language = before
    assert words("{} objects", 5) == "5 objects"
