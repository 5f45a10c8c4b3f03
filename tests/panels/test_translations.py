"""Other languages have the same values in their words, and what they translate is there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import bpy

import pytest
import scenes

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("language", ["de_DE", "ja_JP"])
def test_words_keep_their_values_and_are_of_the_tab(package, language):
    table = package("panels.translations.registered").LANGUAGES[language]
    others = package("panels.translations.registered").LANGUAGES.values()
    assert all(set(other) == set(table) for other in others)
    for text, words in table.items():
        assert words and text.count("{}") == words.count("{}"), text
        assert not re.search(r"^\s|\s$", words)


# What is told by one word, though by two in English, but for singular and plural.
ONE_WORD = {
    "de_DE": ("Inspect Checking", "Sphere Ball", "Margin Distance", "Scope Region", "Get Reading", "Size Figure",
              "Even, Well Shaped/Uniform", "Show Warped Image/Show Warped", "Of From", "Relax Relaxation",
              "Points Vertices", "Wrap Wrapping"),
    "ja_JP": ("Arrange Layout", "Magnify Magnification", "Further Regions/More Regions", "Auto Automatic",
              "Nothing None", "Relax Relaxation", "Distance distances", "Invert Flipped Inverted"),
}  # fmt: skip


def _singular(text: str) -> str:
    return re.sub(r"s\b", "", text.replace("vertices", "vertex")).lower()


@pytest.mark.parametrize("language", ONE_WORD)
def test_what_differs_has_words_that_differ(package, language):
    """Two settings of one name would be taken for each other, as From and To would, if both were told as an end."""
    table, same = package("panels.translations.registered").LANGUAGES[language], {}
    for text, words in table.items():
        same.setdefault(words, []).append(text)
    known = [set(re.split("/", pair) if "/" in pair else pair.split()) for pair in ONE_WORD[language]]
    for words, texts in same.items():
        assert len({_singular(text) for text in texts}) == 1 or set(texts) in known, (words, texts)


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
    words = package("session.language").words
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


def classes(package):
    bases = (bpy.types.Operator, bpy.types.Panel, bpy.types.Menu, bpy.types.AddonPreferences)
    return [cls for cls in package("registration").CLASSES if issubclass(cls, bases)]


def of_classes(package):
    """What Blender shows of operators, panels and preferences: labels, names of settings and of their choices."""
    for cls in classes(package):
        yield getattr(cls, "bl_label", "")
        rna = cls.bl_rna
        inherited = {p.identifier for p in rna.base.properties} | {"rna_type"}
        if issubclass(cls, bpy.types.Operator):
            rna = bpy.context.window_manager.operator_properties_last(scenes.name_of(cls)).bl_rna
        for prop in rna.properties:
            if prop.identifier not in inherited and not prop.is_hidden:
                yield prop.name
                yield from (item.name for item in prop.enum_items) if prop.type == "ENUM" else ()


def trees(*patterns):
    for pattern in patterns:
        for path in sorted((ROOT / "omt_uv").glob(pattern)):
            yield from ast.walk(ast.parse(path.read_text()))


def constant(node):
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def of_code():
    """What panels draw as text, and what they say through `words`; stages of solvers; names of the figures of runs."""
    for node in trees("panels/*.py", "operators/**/*.py", "session/*.py"):
        if isinstance(node, ast.Call):
            yield from (constant(k.value) for k in node.keywords if k.arg in ("text", "button"))
            if getattr(node.func, "id", "") == "words":
                yield constant(node.args[0])
            if getattr(node.func, "id", "") == "counted":
                yield from map(constant, node.args[1:3])
    for node in trees("**/*.py"):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Progress":
            yield constant(node.args[0])
    for node in trees("operators/**/*.py", "session/last_run.py", "pipelines/magnify.py"):
        if isinstance(node, ast.Tuple) and len(node.elts) == 2 and isinstance(node.elts[1], ast.JoinedStr):
            yield constant(node.elts[0])


# What is the same in every language.
CODE = {"python -m pip install", "tetgen", "pytetwild pyvista", ""}


@pytest.mark.parametrize("language", ["de_DE", "ja_JP"])
def test_everything_that_is_shown_has_its_words(package, language):
    """Labels, settings, choices, buttons, stages, figures and keys. Who adds one adds its words."""
    table = package("panels.translations.registered").LANGUAGES[language]
    keys = {f"{keep}Esc: Cancel" for keep in ("", "Enter: Keep Best So Far      ", "Keeping the Best So Far      ")}
    shown = {*of_classes(package), *of_code(), *keys} - CODE
    missing = sorted(text for text in shown if any(c.isalpha() for c in text) and text not in table)
    assert not missing, f"{language} has no words for {missing}"


def in_contexts(package):
    """Pairs of a context and what is shown in it: of classes, that which they name or Blender's own, of buttons and
    settings that name one that, of other buttons that of operators."""
    for cls in classes(package):
        usual = "Operator" if issubclass(cls, bpy.types.Operator) else "*"
        yield getattr(cls, "bl_translation_context", usual), getattr(cls, "bl_label", "")
    own = package("settings").CONTEXT
    for node in trees("panels/*.py", "operators/**/*.py"):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        given = {keyword.arg: keyword.value for keyword in node.keywords}
        usual = "Operator" if node.func.attr == "operator" else "*"
        yield own if getattr(given.get("text_ctxt"), "id", "") == "CONTEXT" else usual, constant(given.get("text"))


def test_what_is_shown_has_its_words_in_the_context_in_which_it_is_shown(package):
    shown = {(context, text) for context, text in in_contexts(package) if text not in CODE}
    assert {context for context, _ in shown} == {"*", "Operator", package("settings").CONTEXT}
    for language, table in package("panels.translations.registered").tables_of().items():
        missing = sorted(pair for pair in shown if any(c.isalpha() for c in pair[1]) and pair not in table)
        assert not missing, f"{language} has no words for {missing}"


def test_one_and_several_have_words_of_their_own(package):
    counted = package("session.language").counted
    texts = ("Opened {} part along {}", "Opened {} parts along {}")
    assert [counted(k, "Selected {} face", "Selected {} faces") for k in (0, 1, 2)] == [
        "Selected 0 faces",
        "Selected 1 face",
        "Selected 2 faces",
    ]
    assert counted(1, *texts, 1, "7 edges") == "Opened 1 part along 7 edges"


def test_a_number_at_the_end_of_a_stage_is_a_value(package):
    stage_words = package("session.language").stage_words
    assert stage_words("Seams, cut 3") == "Seams, cut 3" and stage_words("") == ""
    assert "Seams, cut {}" in package("panels.translations.registered").LANGUAGES["de_DE"]
