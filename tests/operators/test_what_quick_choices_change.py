"""Every other value of every property of an operator without a long solver changes what is told, selected or left; and
every one leaves what is not selected as it was, whatever is chosen."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
import twin_scenes
from operator_runs import other_values

# Objects, where one is not enough, and arguments.
PAIR = "Wall Closed"
GIVEN: dict[str, tuple[str, dict]] = {
    "uv.omt_stack": ("Cubes", {}),
    "uv.omt_symmetrize": ("Cubes", {}),
    "uv.omt_rectify": ("Smooth", {}),
    "uv.omt_regions": ("Closed", {}),
    "uv.omt_worst": ("Closed Cubes", {}),
    "uv.omt_checker": ("Closed", {"size": 256}),
    "uv.omt_layout_image": ("Closed", {"size": 32}),
    "object.omt_distance": (PAIR, {}),
    "object.omt_strain": (PAIR, {"of": "UV"}),
    "object.omt_landmarks_clear": (PAIR, {}),
    "object.omt_landmarks_suggest": (PAIR, {}),
}
# Values of a property in place of any other ones, and what is given besides.
VALUES: dict[tuple[str, str], tuple[list, dict]] = {
    ("uv.omt_regions", "attribute"): (["height"], {"kind": "ATTRIBUTE"}),
    ("uv.omt_worst", "share"): ([5.0, 50.0], {}),
    ("uv.omt_checker", "size"): ([512], {}),
    ("uv.omt_layout_image", "size"): ([48], {}),
    ("object.omt_landmarks_clear", "prefix"): (["mark "], {}),
    ("object.omt_strain", "shape_key"): (["Bent"], {"of": "KEY"}),
    ("object.omt_strain", "of"): (["KEY", "OBJECT"], {}),
}
# Bodies without anything that stands out have no landmarks to suggest, and picking them needs a window.
ELSEWHERE = {"object.omt_landmarks_suggest", "object.omt_landmarks"}


def quick(package):
    """Names of the operators that do all at once, and of those their properties."""
    base = package("operators.base").QuickOperator
    for cls in package("registration").CLASSES:
        if issubclass(cls, bpy.types.Operator) and issubclass(cls, base):
            yield scenes.name_of(cls)


def properties(name):
    module, verb = name.split(".")
    found = getattr(getattr(bpy.ops, module), verb).get_rna_type().properties
    return [p for p in found if p.identifier != "rna_type" and not p.is_readonly]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, package):
    made = tmp_path_factory.mktemp("quick")
    twin_scenes.prepare(made)
    return made


def selection(obj):
    """What is selected of a mesh, and which vertex is where."""
    obj.update_from_editmode()
    mesh, flags = obj.data, []
    for of in (mesh.vertices, mesh.edges, mesh.polygons):
        found = np.zeros(len(of), bool)
        of.foreach_get("select", found)
        flags.append(found.tobytes())
    return flags


@pytest.fixture
def outcome(package, folder, capfd, monkeypatch):
    """All that an operator tells, selects and leaves; what is not selected stays."""
    figures, tables = package("pipelines.measuring.region_figures"), []
    told = figures.table_text
    monkeypatch.setattr(figures, "table_text", lambda *a: tables.append(told(*a)) or told(*a))

    def run(name, objects, arguments):
        twin_scenes.begin(folder, objects)
        for obj in [bpy.data.objects[each] for each in objects.split()]:
            for mark in ("LM_0", "mark 0") * (name == "object.omt_landmarks_clear"):
                empty = bpy.data.objects.new(mark, None)
                bpy.context.collection.objects.link(empty)
                empty.parent = obj
            if name == "object.omt_strain" and not obj.data.shape_keys:
                obj.shape_key_add(name="Basis")
                for k, key in enumerate(("First", "Bent")):
                    for point in obj.shape_key_add(name=key).data:
                        point.co.z *= 1.1 + 0.4 * k
        before = twin_scenes.left()
        tables.clear()
        why, lines = twin_scenes.told(capfd, name, arguments)
        chosen = {o.name for o in bpy.data.objects if o.select_get() or o.mode == "EDIT"}
        mode = bpy.context.mode
        selected = {o.name: selection(o) for o in bpy.data.objects if o.type == "MESH"}
        if mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        after = twin_scenes.left()
        assert all(before[other] == after.get(other) for other in before if other not in objects.split()), name
        empties = sorted((o.name, tuple(o.location)) for o in bpy.data.objects if o.type == "EMPTY")
        return [why, lines, list(tables), chosen, mode, selected, after, empties]

    return run


def test_every_other_value_of_every_quick_operator_changes_something(package, outcome):
    alike, tried = [], 0
    for name in sorted(set(quick(package)) - ELSEWHERE):
        objects, base = GIVEN.get(name, ("Closed Band", {}))
        plain = outcome(name, objects, base)
        for prop in properties(name):
            values, besides = VALUES.get((name, prop.identifier), (None, {}))
            first = outcome(name, objects, base | besides) if besides else plain
            found = [first]
            for value in other_values(prop) if values is None else values:
                found.append(outcome(name, objects, base | besides | {prop.identifier: value}))
                tried += 1
            # What is refused is told so, and two may be for one cause.
            made = [first, *(one for one in found[1:] if one[0] is None or first[0] is not None)]
            if any(made.index(one) < k for k, one in enumerate(made)):
                alike.append((name, prop.identifier, [(made.index(f), f[0], f[1]) for f in made]))
    assert tried > 20 and alike == []
