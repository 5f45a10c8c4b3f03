"""The scale of the colours of distortion, as icons."""

from types import SimpleNamespace

import bpy.utils.previews

import numpy as np
import pytest


class Previews(dict):
    """A collection of icons; Blender has none without a window."""

    def new(self, name):
        self[name] = SimpleNamespace(icon_id=100 + len(self))
        return self[name]


@pytest.mark.parametrize("kind", ["AREA", "SHEAR"])
def test_icons_have_the_colours_of_the_scale_from_end_to_end(package, kind, monkeypatch):
    bar, colours, made = package("display.colour_bar"), package("display.colormaps"), Previews()
    bar.forget()
    monkeypatch.setattr(bpy.utils.previews, "new", lambda: made)
    monkeypatch.setattr(bpy.utils.previews, "remove", lambda old: old.clear())
    icons = bar.icons(kind)
    assert icons == [100 + k for k in range(bar.STEPS)] and bar.icons(kind) is icons
    steps = np.linspace(0, 1, bar.STEPS)
    if kind == "AREA":
        expected = colours.area_colours((2 * steps - 1) * colours.AREA_OCTAVES)
    else:
        expected = colours.shear_colours(colours.SHEAR_TOP**steps)
    for k, colour in enumerate(expected.tolist()):
        icon = made[f"{kind} {k}"]
        assert icon.icon_size == (bar.SIZE, bar.SIZE)
        assert icon.icon_pixels_float == [*colour, 1.0] * bar.SIZE**2
    bar.forget()
    assert not made and not bar._previews and not bar._icons
