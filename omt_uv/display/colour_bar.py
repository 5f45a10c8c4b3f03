"""Draw the scale of the colours of distortion as small icons, one beside the other."""

from __future__ import annotations

from .colormaps import AREA_OCTAVES, SHEAR_TOP, area_colours, shear_colours

STEPS = 9
SIZE = 16
# The words at both ends and in the middle.
ENDS = {"AREA": ("1/4", "as due", "4x"), "SHEAR": ("1x", "2x", "4x")}

_icons: dict[str, list[int]] = {}
_previews: list = []


def icons(kind: str) -> list[int]:
    """Icons from the left end of the scale to the right one; kind: AREA or SHEAR."""
    if kind not in _icons:
        import bpy.utils.previews

        import numpy as np

        if not _previews:
            _previews.append(bpy.utils.previews.new())
        steps = np.linspace(0, 1, STEPS)
        rgb = (
            area_colours((2 * steps - 1) * AREA_OCTAVES) if kind == "AREA" else shear_colours(SHEAR_TOP**steps)
        ).tolist()
        made = []
        for k, colour in enumerate(rgb):
            icon = _previews[0].new(f"{kind} {k}")
            icon.icon_size = (SIZE, SIZE)
            icon.icon_pixels_float = [*colour, 1.0] * (SIZE * SIZE)
            made.append(icon.icon_id)
        _icons[kind] = made
    return _icons[kind]


def forget() -> None:
    """Give the icons back, when the add-on goes."""
    import bpy.utils.previews

    _icons.clear()
    while _previews:
        bpy.utils.previews.remove(_previews.pop())
