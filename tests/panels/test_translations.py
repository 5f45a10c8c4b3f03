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
