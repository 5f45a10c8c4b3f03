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
    before, more = scenes.state(obj), dict(obj.data.items())
    for value in (0.2, 0.8):
        colours.write_colours(obj, np.arange(8), np.full((8, 3), value))
        assert colours.has_colours(obj.data)
        assert obj.data.color_attributes.active_color.name == colours.ATTRIBUTE
    colours.remove_colours(obj)
    assert not colours.has_colours(obj.data)
    assert scenes.state(obj) == before and dict(obj.data.items()) == more
    assert (obj.data.color_attributes.active_color.name if own else "Mine") == "Mine"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_corners_without_a_colour_are_grey_and_others_have_theirs(package, mode):
    colours, obj = package("blender.colour_attributes"), scenes.bump(3, 3)
    if mode == "EDIT":
        scenes.edit(obj)
    colours.write_colours(obj, np.array([2, 5]), np.array([[1.0, 0, 0.2], [0, 0.8, 1]]))
    scenes.leave_edit()
    found = np.zeros((len(obj.data.loops), 4), np.float32)
    obj.data.color_attributes[colours.ATTRIBUTE].data.foreach_get("color_srgb", found.ravel())
    asked = np.tile([0.5, 0.5, 0.5, 1.0], (len(found), 1))
    asked[[2, 5], :3] = [[1, 0, 0.2], [0, 0.8, 1]]
    np.testing.assert_allclose(found, asked, atol=1 / 255)


def test_a_match_is_shown_by_fourteen_squares_along_what_is_matched(package):
    """Every other one paler; along the other axes a place has the same colour as far as it lies in one of them."""
    module, obj = package("blender.shapes.match_objects"), scenes.bump(1, 1)
    n = len(obj.data.vertices)
    at = (np.arange(140) + 0.5) / 140
    blue = []
    for part in at.reshape(-1, n):
        module._write_colour(obj.data, np.column_stack([part, 0 * part, 0 * part]))
        found = np.zeros((n, 4), np.float32)
        obj.data.attributes[module.CHECKER].data.foreach_get("color", found.ravel())
        blue += found[:, 2].tolist()
    steps = np.flatnonzero(np.abs(np.diff(blue)) > 0.1)
    np.testing.assert_array_equal(steps, 10 * np.arange(1, 14) - 1)
