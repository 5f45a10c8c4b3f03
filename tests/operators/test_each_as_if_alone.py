"""What is done to every object by itself is the same among others as alone, in Edit Mode as in Object Mode, and with
things beside it that are idle: an empty slot, group or layer, a second collection, an object that is not selected."""

from __future__ import annotations

import bpy

import pytest
import scenes
import whole_file

# Operator, arguments, and whether it works in Edit Mode.
RUNS: list[tuple[str, dict, bool]] = [
    *(("mesh.omt_partition", {"cells": 4, "relax": 0, "write": write, "capacity_group": "region"}, True)
      for write in ("FACE_SETS", "MATERIALS", "ATTRIBUTE", "SEAMS", "MESH", "POINTS")),
    *(("object.omt_weights", {"kind": kind, "weight_group": "region", "show": False}, True)
      for kind in ("GAUSSIAN", "MEAN")),
    ("uv.omt_seams", {"max_shear": 0.0, "keep_free": "second"}, True),
    ("uv.omt_density_set", {"density": 40.0}, True),
    ("uv.omt_attributes", {}, False),
    ("uv.omt_overlay", {"show": "SHEAR"}, True),
    ("uv.omt_checker", {"size": 256}, True),
    ("uv.omt_sphere", {"quality": "DRAFT"}, True),
    ("uv.omt_stack", {}, True),
    ("uv.omt_remedy", {"action": "MERGE"}, True),
    ("uv.omt_remedy", {"action": "NORMALS"}, True),
    ("object.omt_volume", {"tets": 100, "result": "ATTRIBUTE"}, False),
]  # fmt: skip
NAMES = [f"{name} {list(given.values())[-2:]}" for name, given, _ in RUNS]
# What stands aside in the file that has it, and changes nothing.
IDLE = "idle"


def _twice(obj: bpy.types.Object) -> None:
    """Two vertices of the object lie on one another, and a face looks inside."""
    mesh = obj.data
    points = [tuple(v.co) for v in mesh.vertices]
    mesh.vertices[3].co = points[mesh.edges[0].vertices[1]]
    mesh.polygons[7].flip()
    mesh.update()


@pytest.fixture(scope="module")
def rich(package, tmp_path_factory):
    """Two bodies of which one is of two collections and has slots of its own, one of them empty."""
    folder = tmp_path_factory.mktemp("alone")
    scenes.open_empty()
    A, B = whole_file.make()
    bpy.data.collections["Inner"].objects.link(A)
    A.data.materials.append(None)
    for face in A.data.polygons:
        face.material_index = face.index % 3
    slot = B.material_slots[0]
    slot.link, slot.material = "OBJECT", bpy.data.materials.new("of the object")
    for obj in (A, B):
        for items in (obj.data.vertices, obj.data.edges, obj.data.polygons):
            items.foreach_set("select", [True] * len(items))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "plain.blend"))
    for obj in (A, B):
        obj.data.materials.append(None)
        obj.vertex_groups.new(name="idle")
        obj.data.uv_layers.new(name="idle", do_init=False)
        bpy.data.collections["Out"].objects.link(obj)
    scenes.cube("idle")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "idle.blend"))
    return folder


def after(folder, run: int, chosen: str, file: str = "plain", edited: bool = False) -> dict[str, dict]:
    """All that objects hold after a run on the objects whose names begin so; what is made of vertices that lie
    together, or of faces that look inside, where that is mended."""
    name, given, _ = RUNS[run]
    bpy.ops.wm.open_mainfile(filepath=str(folder / f"{file}.blend"))
    objects = [bpy.data.objects[letter] for letter in chosen]
    if "remedy" in name:
        for obj in objects:
            _twice(obj)
    scenes.select(objects)
    if edited:
        bpy.ops.object.mode_set(mode="EDIT")
    module, verb = name.split(".")
    assert getattr(getattr(bpy.ops, module), verb)("EXEC_DEFAULT", True, **given) == {"FINISHED"}
    if edited:
        bpy.ops.object.mode_set(mode="OBJECT")
    return {obj.name: _told(obj) for obj in bpy.data.objects if obj.name[0] in "AB"}


def _told(obj: bpy.types.Object) -> dict:
    """All that an object and its mesh hold, but what is selected, and what is idle."""
    found: dict = {}
    whole_file._attributes(obj.data, "", found)
    found = {key: value for key, value in found.items() if "select" not in key and IDLE not in key}
    names = {group.index: group.name for group in obj.vertex_groups if group.name != IDLE}
    slots = [(slot.link, slot.material.name if slot.material else "") for slot in obj.material_slots]
    return found | {
        "groups": names,
        "weights": [[(names[g.group], g.weight) for g in vertex.groups] for vertex in obj.data.vertices],
        "slots": slots[:-1] if IDLE in obj.vertex_groups else slots,
        "faces": [face.material_index for face in obj.data.polygons],
        "edges": [tuple(edge.vertices) for edge in obj.data.edges],
        "corners": [loop.vertex_index for loop in obj.data.loops],
        "layers": [layer.name for layer in obj.data.uv_layers if layer.name != IDLE],
        "active": (obj.data.uv_layers.active.name if obj.data.uv_layers else "", obj.data.attributes.active_color_name),
        "collections": [collection.name for collection in obj.users_collection if collection.name != "Out"],
        "own": [str(whole_file._plain(value)) for block in (obj, obj.data) for _, value in sorted(block.items())],
        "place": [obj.parent.name if obj.parent else "", *map(tuple, obj.matrix_world)],
        "modifiers": [(modifier.name, modifier.type, modifier.show_viewport) for modifier in obj.modifiers],
        "keys": [key.name for key in obj.data.shape_keys.key_blocks] if obj.data.shape_keys else [],
    }


def differences(one: dict, other: dict, letter: str, may: tuple[str, ...] = ()) -> list[str]:
    """What differs between two files of an object, and of what was made of it."""
    mine, others = ({key: x for key, x in each.items() if key.startswith(letter)} for each in (one, other))
    assert mine.keys() == others.keys() and mine
    return [f"{name} {key}" for name in mine for key in mine[name].keys() | others[name].keys()
            if key not in may and mine[name].get(key) != others[name].get(key)]  # fmt: skip


@pytest.fixture(scope="module")
def both(rich):
    """What runs leave of both objects, each made once."""
    found: dict[int, dict] = {}

    def told(run: int) -> dict[str, dict]:
        if run not in found:
            found[run] = after(rich, run, "AB")
        return found[run]

    return told


@pytest.mark.parametrize("run", range(len(RUNS)), ids=NAMES)
def test_an_object_gets_among_others_what_it_gets_alone(rich, both, run):
    if RUNS[run][0] == "object.omt_volume":
        pytest.importorskip("tetgen")
    for letter in "AB":
        assert not differences(both(run), after(rich, run, letter), letter)


@pytest.mark.parametrize("run", range(len(RUNS)), ids=NAMES)
def test_what_is_idle_changes_nothing_and_edit_mode_neither(rich, both, run):
    name, given, in_edit_mode = RUNS[run]
    if name == "object.omt_volume":
        pytest.importorskip("tetgen")
    mine = after(rich, run, "AB", IDLE, in_edit_mode)
    # New slots come behind all that there are.
    may = ("/attributes/material_index", "faces", "slots") if given.get("write") == "MATERIALS" else ()
    # A checker is on the idle slot as well.
    may = ("own",) if name == "uv.omt_checker" else may
    for letter in "AB":
        assert not differences(both(run), mine, letter, may)
    for obj in (bpy.data.objects[letter] for letter in "AB"):
        assert {IDLE} == {x.name for x in (*obj.vertex_groups, *obj.data.uv_layers) if x.name == IDLE}
        assert "Out" in [collection.name for collection in obj.users_collection]
        slot = obj.material_slots[3 if obj.name == "A" else 2].material
        assert slot is None or "Checker" in slot.name
