"""What panels and menus draw in which state, and what preferences and settings of objects are: tables keep them."""

from __future__ import annotations

import re
import types
from pathlib import Path

import bpy

import scenes
from kept import Recorder, check, plain

PANELS, SETTINGS = (Path(__file__).with_name(name) for name in ("drawn.tsv", "settings.tsv"))
BOUNDS = ("hard_min", "hard_max", "soft_min", "soft_max", "step", "precision")


def classes(package, base):
    return sorted((c for c in package("registration").CLASSES if issubclass(c, base)), key=lambda c: c.__name__)


def unwrapped():
    scenes.bump()
    bpy.ops.uv.omt_unwrap(quality="DRAFT")


def refused():
    scenes.select([])
    scenes.error_of(bpy.ops.uv.omt_unwrap)


def two_objects():
    first = scenes.bump()
    other = first.copy()
    other.data = first.data.copy()
    bpy.context.collection.objects.link(other)
    scenes.select([first, other])


def in_mode(mode):
    scenes.bump()
    bpy.context.object.vertex_groups.new(name="Region")
    bpy.ops.object.mode_set(mode=mode)


STATES = {
    "nothing": lambda: None,
    "mesh": scenes.bump,
    "two": two_objects,
    "unwrapped": unwrapped,
    "refused": refused,
    **{mode.lower().replace("_", " "): lambda mode=mode: in_mode(mode) for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT")},
}


def drawn(cls):
    """What a panel or menu draws, digits apart; nothing where it is not shown."""
    if hasattr(cls, "poll") and not cls.poll(bpy.context):
        return []
    record: list[str] = []
    stand_in = types.SimpleNamespace(layout=Recorder(record), section=getattr(cls, "section", None))
    for method in ("draw_header_preset", "draw"):
        # Methods of Blender's own classes draw nothing of ours.
        if any(method in vars(c) for c in cls.__mro__ if c.__module__ != "bpy_types" and "omt" in c.__module__):
            getattr(cls, method)(stand_in, bpy.context)
    return [re.sub(r"\d[\d.,]*", "#", entry) for entry in record]


def test_what_panels_draw_in_which_state_is_that_of_the_table(package, monkeypatch):
    # Libraries that somebody has not installed are asked for in the panel.
    monkeypatch.setattr(package("panels.volumes"), "missing", lambda _: "")
    # Tests before may have left a queue, and which these are changes from run to run.
    monkeypatch.setattr(package("session.queue"), "state", None)
    found: dict[tuple[str, str], list[str]] = {}
    for name, make in STATES.items():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        package("session.last_run").forget()
        make()
        for cls in [*classes(package, bpy.types.Panel), *classes(package, bpy.types.Menu)]:
            found[cls.__name__, name] = drawn(cls)
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
    # Most look the same in both editors and in most states, which is said and not written out.
    lines = []
    for (cls, name), entries in found.items():
        others = [(cls.replace("IMAGE", "VIEW3D", 1), name), *((cls, other) for other in STATES)]
        same = next((other for other in others if other != (cls, name) and found[other] == entries), None)
        earlier = same is not None and (same[0] != cls or [*STATES].index(same[1]) < [*STATES].index(name))
        lines.append("\t".join([cls, name, "", *([f"as {' '.join(same)}"] if earlier else entries)]))
    check(PANELS, sorted(lines))


def owners(package):
    """What has settings besides operators: preferences, groups of properties, and Blender's types that we add to."""
    own = [c.bl_rna for c in classes(package, (bpy.types.PropertyGroup, bpy.types.AddonPreferences))]
    own += [getattr(bpy.types, kind).bl_rna for kind in ("Scene", "Object", "Mesh", "WindowManager", "Image")]
    for rna in own:
        base = {p.identifier for p in rna.base.properties} if rna.base else set()
        yield rna, [p for p in rna.properties if p.is_runtime and "omt" in f"{rna.identifier}{p.identifier}".lower()
                    and p.identifier not in base]  # fmt: skip


def row(prop):
    """What a property is: its kind, default and bounds, or choices."""
    default = getattr(prop, "default_flag" if getattr(prop, "is_enum_flag", False) else "default", "")
    default = sorted(default) if isinstance(default, set) else default
    bounds = [plain(getattr(prop, key)) for key in BOUNDS if prop.type in ("INT", "FLOAT") and hasattr(prop, key)]
    items = " ".join(f"{i.identifier}={i.value}" for i in prop.enum_items) if prop.type == "ENUM" else ""
    return [prop.type, plain(default), *bounds, items, prop.subtype, prop.name, prop.description]


def test_settings_besides_those_of_operators_are_those_of_the_table(package):
    lines = ["\t".join([rna.identifier, p.identifier, "", *row(p)]) for rna, props in owners(package) for p in props]
    assert len(lines) > 10
    check(SETTINGS, lines)
