"""Every property of an operator reaches the setting of its name, with its value, and no other one."""

from __future__ import annotations

import pytest
import scenes
from operator_runs import other_values

# Settings of Unwrap alone, which others take as they are.
UNWRAP = {"seams", "fill_holes", "cut_further", "kind", "aspect", "pack_around", "turn_to_fit"}
# Operator, arguments of its `settings`; properties whose settings have other names; settings of no property; what one
# property decides besides.
OPERATORS = {
    "uv.omt_unwrap": ((), {"map": "kind"}, set(), {}),
    "uv.omt_refine": ((), {}, UNWRAP | {"boundary", "max_shear"}, {}),
    "uv.omt_magnify": (("mesh",), {"source": None}, UNWRAP | {"source", "pack"}, {}),
    "uv.omt_sphere": ((), {}, set(), {}),
    "object.omt_remesh": (
        (),
        {
            "target_vertices": "count",
            "weight_factor": "factor",
            "use_preserve_boundary": "preserve_boundary",
            "use_preserve_sharp": "preserve_sharp",
            "use_preserve_seams": "preserve_seams",
            "use_preserve_materials": "preserve_materials",
            "density_attribute": "source",
        },
        set(),
        {"count_of": {"count"}, "density": {"source"}},
    ),
}


@pytest.mark.parametrize("name", OPERATORS)
def test_every_property_reaches_its_setting_and_no_other(name):
    given, renamed, without, besides = OPERATORS[name]
    base = vars(scenes.stand_in(name).settings(*given))
    reached = set()
    for prop in scenes.stand_in(name).rna_type.properties:
        if prop.is_readonly or prop.identifier == "rna_type" or getattr(prop, "is_array", False):
            continue
        for value in other_values(prop):
            found = vars(scenes.stand_in(name, **{prop.identifier: value}).settings(*given))
            changed = {key: v for key, v in found.items() if v != base[key]}
            field = renamed.get(prop.identifier, prop.identifier)
            more = besides.get(prop.identifier, set())
            assert set(changed) <= {field, *more}, (prop.identifier, value)
            if field in base:
                assert changed[field] == (value.lower() if prop.type == "ENUM" else value), (prop.identifier, value)
                reached |= set(changed)
    assert set(base) - reached == without


@pytest.mark.parametrize("source", ["mesh", "uv"])
@pytest.mark.parametrize("balance", [0.0, 0.3, 1.0])
def test_of_uvs_in_the_plane_areas_alone_are_asked_for(source, balance):
    """All else reaches its setting, wherever the region is magnified."""
    plain = vars(scenes.stand_in("uv.omt_magnify").settings(source))
    found = vars(scenes.stand_in("uv.omt_magnify", balance=balance, factor=3.0).settings(source))
    changed = {key: value for key, value in found.items() if value != plain[key]}
    assert changed == {"factor": 3.0} | ({"balance": balance} if source == "mesh" and balance else {})
    assert found["source"] == source and found["balance"] == (balance if source == "mesh" else 0.0)


@pytest.mark.parametrize("pack", [True, False])
@pytest.mark.parametrize("around", [True, False])
def test_islands_may_lie_on_one_another_where_they_are_not_packed(pack, around):
    assert scenes.stand_in("uv.omt_unwrap", pack=pack, pack_around=around).stacks() == (not pack)
