"""Settings that an operator does not draw as others stand, or draws as inactive, change nothing: neither what it makes,
nor what it tells."""

from __future__ import annotations

import bpy

import front_runs
import pytest
import scenes
import twin_scenes
from operator_runs import other_values

DRAFT = {"quality": "DRAFT"}
# Operator, objects, arguments: states in which there are settings that do not count.
RUNS: list[tuple[str, str, dict]] = [
    ("uv.omt_unwrap", "Band", {**DRAFT, "max_shear": 0.0}),
    ("uv.omt_unwrap", "Smooth", {**DRAFT, "boundary": "DISK"}),
    ("uv.omt_unwrap", "Smooth", {**DRAFT, "pack": False}),
    ("uv.omt_unwrap", "Seamed", {**DRAFT, "seams": "EXISTING"}),
    ("uv.omt_refine", "Band", DRAFT),
    ("uv.omt_refine", "Band", {**DRAFT, "keep_boundary": True}),
    ("uv.omt_magnify", "Band", {**DRAFT, "weight_group": "region", "source": "UV", "factor": 1.5}),
    ("uv.omt_magnify", "Smooth", {**DRAFT, "weight_group": "region", "source": "MESH", "factor": 2.0}),
    ("uv.omt_sphere", "Closed", DRAFT),
    ("uv.omt_sphere", "Closed", {**DRAFT, "orientation": "GROUPS", "pole_group": "pole"}),
    ("uv.omt_seams", "Band", {"max_shear": 1.25}),
    ("object.omt_remesh", "Band", {"target_vertices": 40}),
    ("object.omt_match", "Wall Closed", {"mode": "WRAP"}),
    ("object.omt_flow", "Closed", {"move": (0.0, 0.0, 0.25), "path": "STRAIGHT", "result": "MESH"}),
    *(("object.omt_volume", "Closed", {"tets": 100, "result": result})
      for result in ("TETS", "SHELLS", "POINTS", "SLICE", "ATTRIBUTE")),
]  # fmt: skip
# Settings that are names of vertex groups, and a group of some objects, of a single vertex where they have such.
GROUPS = {"keep_free", "centre_group", "corner_group", "weight_group", "pole_group", "meridian_group", "east_group"}
OF = {"Band": "centre", "Closed": "pole"}


class Layout:
    """What an operator draws into: which of its settings can be changed there."""

    def __init__(self, drawn: set[str], above: Layout | None = None) -> None:
        self.drawn, self.above, self.active = drawn, above, True

    def __getattr__(self, kind):
        if kind in ("column", "row", "box", "split"):
            return lambda *_, **__: Layout(self.drawn, self)
        if kind in ("prop", "prop_search"):
            return lambda _, prop, *__, **___: self.drawn.add(prop) if self.counts else None
        return lambda *_, **__: type("Properties", (), {})()

    @property
    def counts(self) -> bool:
        return self.active and (self.above is None or self.above.counts)


def drawn(name: str, arguments: dict) -> set[str]:
    operator = scenes.stand_in(name, **arguments)
    operator.layout, operator.bl_rna = Layout(set()), operator.rna_type
    operator.draw(bpy.context)
    return operator.layout.drawn


def idle(name: str, objects: str, arguments: dict) -> dict:
    """Other values of the settings that do not count with these arguments; names are those of what there is."""
    found = {}
    count = {"rna_type", *arguments, *drawn(name, arguments)}
    for prop in scenes.stand_in(name).rna_type.properties:
        if prop.identifier in count or prop.is_readonly or prop.is_hidden:
            continue
        if prop.type == "STRING":
            first = objects.split()[0]
            found[prop.identifier] = OF.get(first, "region") if prop.identifier in GROUPS else first
        elif not getattr(prop, "is_array", False) and not getattr(prop, "is_enum_flag", False):
            found[prop.identifier] = other_values(prop)[0]
    return found


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    folder = tmp_path_factory.mktemp("idle")
    twin_scenes.prepare(folder)
    return folder


@pytest.fixture
def after(folder, package, capfd):
    """What a run tells and leaves: `after(name, objects, arguments)`."""

    def run(name: str, objects: str, arguments: dict) -> list:
        twin_scenes.begin(folder, objects)
        why, lines = twin_scenes.told(capfd, name, arguments)
        return [why, lines, front_runs.rows_of(package("session.last_run").state.summary), twin_scenes.left()]

    return run


@pytest.mark.parametrize("run", range(len(RUNS)), ids=[f"{name} {list(given.values())[-1]}" for name, _, given in RUNS])
def test_what_is_not_drawn_does_not_count(after, run):
    name, objects, arguments = RUNS[run]
    others = idle(name, objects, arguments)
    assert others, "every setting counts"
    plain = after(name, objects, arguments)
    assert plain[0] is None
    assert after(name, objects, {**arguments, **others}) == plain, others
    # Nor do names of what is not there.
    others = {
        key: "nowhere"
        for key, value in others.items()
        if isinstance(value, str) and (key in GROUPS or value in objects)
    }
    assert not others or after(name, objects, {**arguments, **others}) == plain, others


@pytest.mark.parametrize(
    ("name", "objects", "arguments"),
    [
        ("uv.omt_seams", "Closed", {}),
        ("uv.omt_unwrap", "Closed", DRAFT),
        ("uv.omt_magnify", "Closed", {**DRAFT, "weight_group": "region", "source": "MESH", "factor": 2.0}),
    ],
    ids=lambda value: value if isinstance(value, str) and "omt" in value else "",
)
def test_no_shear_is_less_than_one_so_that_such_bounds_are_none(after, name, objects, arguments):
    none, *others = (after(name, objects, {**arguments, "max_shear": bound}) for bound in (0.0, 0.5, 1.0))
    assert none[0] is None and others == [none, none]
    assert after(name, objects, {**arguments, "max_shear": 1.02}) != none
