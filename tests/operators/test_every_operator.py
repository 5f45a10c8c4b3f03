"""What holds for every operator, by reflection: no operator can be added that does not keep to it."""

from __future__ import annotations

import math

import bpy

import pytest
import scenes


def operators(package):
    """Triples of module, name and class of every operator."""
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    return [(*c.bl_idname.split("."), c) for c in classes]


def test_every_float_refuses_nan_and_what_blender_makes_of_infinity(package):
    obj = scenes.bump()
    tried = 0
    for module, name, _ in operators(package):
        operator = getattr(getattr(bpy.ops, module), name)
        for prop in (p for p in operator.get_rna_type().properties if p.type == "FLOAT"):
            for value in (math.nan, math.inf) if prop.hard_max > 3e38 else (math.nan,):
                with pytest.raises(RuntimeError, match=f"{prop.name} is not a finite number"):
                    operator(**{prop.identifier: value})
                assert not obj.data.uv_layers and list(bpy.data.objects) == [obj]
                tried += 1
    assert tried >= 12
