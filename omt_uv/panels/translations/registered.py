"""The tables as Blender takes them: by language, context and message."""

from __future__ import annotations

from .german import GERMAN
from .japanese import JAPANESE

# Of labels and settings, and of names of operators.
CONTEXTS = ("*", "Operator")
LANGUAGES = {"de_DE": GERMAN, "ja_JP": JAPANESE}


def tables_of() -> dict[str, dict[tuple[str, str], str]]:
    """Messages of all languages, for `bpy.app.translations.register`."""
    return {
        language: {(context, text): words for text, words in table.items() for context in CONTEXTS}
        for language, table in LANGUAGES.items()
    }
