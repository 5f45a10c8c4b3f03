"""Properties of every operator, and what is drawn of them for which choice, are an interface: tables keep them."""

from __future__ import annotations

import importlib
from pathlib import Path

import bpy

import scenes
from kept import Recorder, check, plain

PROPERTIES, DRAWN = (Path(__file__).with_name(name) for name in ("interface.tsv", "drawn.tsv"))
BOUNDS = ("default", "hard_min", "hard_max", "soft_min", "soft_max", "step", "precision")


def operators(package):
    """Pairs of name and class of every operator, sorted."""
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    return sorted((scenes.name_of(c), c) for c in classes)


def own(name):
    """The properties of an operator that scripts can give."""
    group, verb = name.split(".")
    found = getattr(getattr(bpy.ops, group), verb).get_rna_type().properties
    return [p for p in found if p.identifier != "rna_type" and not p.is_readonly]


def row(prop) -> list[str]:
    """What a property is: its kind, default and bounds, or choices."""
    if prop.type == "ENUM":
        default = prop.default_flag if prop.is_enum_flag else prop.default
        return [prop.type, plain(sorted(default) if prop.is_enum_flag else default),
                " ".join(f"{i.identifier}={i.value}" for i in prop.enum_items)]  # fmt: skip
    if prop.type in ("INT", "FLOAT"):
        default = tuple(prop.default_array) if prop.is_array else prop.default
        bounds = [plain(getattr(prop, key)) for key in BOUNDS[1:] if hasattr(prop, key)]
        return [prop.type, plain(default), *bounds, prop.subtype]
    return [prop.type, plain(getattr(prop, "default", "")), prop.subtype]


def test_properties_are_those_of_the_table(package):
    lines = []
    for name, cls in operators(package):
        lines.append("\t".join([name, "", "", cls.bl_label, " ".join(sorted(cls.bl_options))]))
        lines += ["\t".join([name, p.identifier, "", *row(p), "hidden" if p.is_hidden else ""]) for p in own(name)]
        lines += list(descriptions(name, cls))
    check(PROPERTIES, lines)


def descriptions(name, cls):
    """What a button says for each choice, where that depends on choices; no two say the same."""
    if "description" not in vars(cls):
        return
    properties = bpy.context.window_manager.operator_properties_last(name)
    for prop in (p for p in own(name) if p.type in ("ENUM", "BOOLEAN")):
        told = []
        for value in values(prop):
            setattr(properties, prop.identifier, value)
            told.append(cls.description(bpy.context, properties))
            yield "\t".join([name, f"description {prop.identifier}", plain(value), told[-1]])
        properties.property_unset(prop.identifier)
        assert prop.type != "ENUM" or len(set(told)) == len(told), (name, prop.identifier)


def values(prop):
    """Values of a property at which something may be drawn in another way: choices, bounds, and 1."""
    if prop.type == "ENUM":
        return [] if prop.is_enum_flag else [i.identifier for i in prop.enum_items]
    if prop.type == "BOOLEAN":
        return [] if prop.is_array else [False, True]
    if prop.type == "STRING":
        return ["", "A"]
    if prop.type not in ("INT", "FLOAT") or prop.is_array:
        return []
    low, high = (max(prop.hard_min, -1e6), min(prop.hard_max, 1e6))
    some = {prop.default, low, high, min(max(1, low), high), min(max(2, low), high)}
    return sorted(int(v) if prop.type == "INT" else v for v in some)


def drawn(draw, properties):
    record: list[str] = []
    draw(Recorder(record), properties)
    return record


def test_what_is_drawn_for_which_choice_is_that_of_the_table(package):
    scenes.select([scenes.bump()])
    lines = []
    for name, cls in operators(package):
        draw = getattr(importlib.import_module(cls.__module__), "draw_settings", None)
        properties = bpy.context.window_manager.operator_properties_last(name)
        if draw is None or not any(p.identifier for p in own(name)):
            continue
        for prop in own(name):
            properties.property_unset(prop.identifier)
        try:
            before = drawn(draw, properties)
        except (AttributeError, TypeError):
            # The module draws the settings of another one of its operators.
            continue
        lines += [f"{name}\t\t{entry}" for entry in before]
        for prop in own(name):
            for value in values(prop):
                setattr(properties, prop.identifier, value)
                now = drawn(draw, properties)
                other = [f"-{entry}" for entry in before if entry not in now]
                other += [f"+{entry}" for entry in now if entry not in before]
                lines.append("\t".join([name, prop.identifier, plain(value), *other]))
            properties.property_unset(prop.identifier)
    check(DRAWN, lines)


class Flags(Recorder):
    """A layout that keeps how it was told to draw, too."""

    def __setattr__(self, name, value):
        self.kept[name] = value
        super().__setattr__(name, value)


def test_settings_have_their_names_beside_them_and_no_dots_for_keys(package):
    """As in every panel of Blender: the redo panel and the sidebar draw the same."""
    tried = 0
    for name, cls in operators(package):
        draw = getattr(importlib.import_module(cls.__module__), "draw_settings", None)
        if draw is None:
            continue
        layout = Flags([])
        try:
            draw(layout, bpy.context.window_manager.operator_properties_last(name))
        except (AttributeError, TypeError):
            # The module draws the settings of another one of its operators.
            continue
        assert layout.kept["use_property_split"] is True and layout.kept["use_property_decorate"] is False, name
        tried += 1
    assert tried > 8
