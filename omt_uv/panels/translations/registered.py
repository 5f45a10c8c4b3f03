"""The tables as Blender takes them: by language, context and message."""

from __future__ import annotations

from ...settings import CONTEXT
from .german import GERMAN
from .japanese import JAPANESE

# Of labels and settings, of names of operators, and of words that Blender's dictionary has in another meaning.
CONTEXTS = ("*", "Operator", CONTEXT)
LANGUAGES = {"de_DE": GERMAN, "ja_JP": JAPANESE}


def tables_of() -> dict[str, dict[tuple[str, str], str]]:
    """Messages of all languages, for `bpy.app.translations.register`."""
    return {
        language: {(context, text): words for text, words in table.items() for context in CONTEXTS}
        for language, table in LANGUAGES.items()
    }
