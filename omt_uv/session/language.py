"""Words in the language of the interface, where Blender does not translate them by itself."""

from __future__ import annotations

import re

import bpy


def words(text: str, *values) -> str:
    """A text in the language of the interface, with values in the place of its braces."""
    return bpy.app.translations.pgettext_iface(text).format(*values)


def counted(count: int, one: str, many: str, *values) -> str:
    """What is said of one or of several in that language, with values in the place of braces: by default the count."""
    return words(one if count == 1 else many, *(values or (count,)))


def stage_words(stage: str) -> str:
    """The stage of a solver in that language; a number at its end is a value."""
    number = re.search(r"\d+$", stage)
    return words(stage[: number.start()] + "{}", number.group()) if number else words(stage)
