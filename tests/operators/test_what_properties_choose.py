"""Every property of an operator reaches the setting of its name, with its value, and no other one."""

from __future__ import annotations

import pytest
import scenes
from operator_runs import other_values

# Settings of Unwrap alone, which others take as they are.
UNWRAP = {"seams", "fill_holes", "cut_further", "kind", "aspect", "pack_around"}
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
