"""A field for a name offers what the setting is a name of, by every operator, however its other settings stand."""

from __future__ import annotations

import bpy

import pytest
import scenes
from operator_runs import other_values

# What stands in the description of a setting that is a name: of what it is one, and who has those.
OF = {
    "Vertex group": ("vertex_groups", "Object"),
    "UV map": ("uv_layers", "Mesh"),
    "Attribute": ("attributes", "Mesh"),
    "Image": ("images", "BlendData"),
    "Object": ("objects", "BlendData"),
    "Closed mesh object": ("objects", "BlendData"),
}
# Several names in one, and half a name, which nobody could choose.
WRITTEN = {("uv.omt_magnify", "further"), ("object.omt_match", "landmark_prefix")}


class Searched:
    """What an operator draws into: the fields with a search, and what is searched there."""

    def __init__(self, found: set) -> None:
        self.found = found

    def __getattr__(self, kind):
        if kind == "prop_search":
            return lambda _, name, owner, collection, **__: self.found.add((name, collection, owner.bl_rna.identifier))
        if kind in ("column", "row", "box", "split"):
            return lambda *_, **__: Searched(self.found)
        return lambda *_, **__: type("Properties", (), {})()


def names(operator) -> dict[str, tuple[str, str]]:
    """Settings of an operator that are names, and of what."""
    return {prop.identifier: of for prop in operator.rna_type.properties if prop.type == "STRING"
            for begin, of in OF.items() if prop.description.startswith(begin)}  # fmt: skip


def searched(name: str) -> set:
    """All fields with a search of an operator, with each other value of each of its settings."""
    found: set = set()
    properties = scenes.stand_in(name).rna_type.properties
    states = [{}]
    for prop in properties:
        if prop.type in ("ENUM", "BOOLEAN") and not getattr(prop, "is_array", False) and not prop.is_readonly:
            values = [i.identifier for i in prop.enum_items] if prop.type == "ENUM" else other_values(prop)
            states += [{prop.identifier: value} for value in values if not getattr(prop, "is_enum_flag", False)]
    for state in states:
        operator = scenes.stand_in(name, **state)
        operator.layout, operator.bl_rna = Searched(found), operator.rna_type
        operator.draw(bpy.context)
    return found


def operators(package):
    return [c.bl_idname for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]


def test_every_name_is_searched_for_among_those_of_its_kind(package):
    obj = scenes.bump()
    asked, there = set(), set()
    for name in operators(package):
        operator = scenes.stand_in(name)
        wished = names(operator)
        asked |= {(name, setting) for setting in wished} - WRITTEN
        if not wished or not hasattr(operator, "draw"):
            continue
        for setting, (collection, _) in wished.items():
            # What is about to be made stands in a field without a search.
            if getattr(operator, setting) and collection == "vertex_groups":
                obj.vertex_groups.new(name=getattr(operator, setting))
        for setting, collection, owner in searched(name):
            assert (collection, owner) == wished[setting], (name, setting)
            there.add((name, setting))
    assert len(there) > 20
    assert asked - there == set()


@pytest.mark.parametrize("begin", OF)
def test_there_are_settings_of_every_kind(package, begin):
    every = [prop.description for name in operators(package) for prop in scenes.stand_in(name).rna_type.properties]
    assert any(text.startswith(begin) for text in every)
