"""Colours come and go: the artist's own attributes, and which one was active, are as before."""

from __future__ import annotations

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("own", [True, False])
def test_colours_leave_no_trace(package, own, mode):
    colours, obj = package("blender.colour_attributes"), scenes.bump(4, 4)
    if own:
        obj.data.color_attributes.new("Mine", "FLOAT_COLOR", "POINT")
        obj.data.color_attributes.active_color = obj.data.color_attributes["Mine"]
    if mode == "EDIT":
        scenes.edit(obj)
    before = scenes.state(obj)
    for value in (0.2, 0.8):
        colours.write_colours(obj, np.arange(8), np.full((8, 3), value))
        assert colours.has_colours(obj.data)
        assert obj.data.color_attributes.active_color.name == colours.ATTRIBUTE
    colours.remove_colours(obj)
    assert not colours.has_colours(obj.data)
    assert scenes.state(obj) == before
    assert (obj.data.color_attributes.active_color.name if own else "Mine") == "Mine"
