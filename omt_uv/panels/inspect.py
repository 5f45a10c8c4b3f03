"""Draw the section that shows how good UVs are: colours, figures, histogram, texel density."""

from __future__ import annotations

import bpy

from ..display import overlay
from ..operators.distortion import HISTOGRAM, KINDS
from .section import Section, settings_of, split

SHOW = "uv.omt_overlay"
SET_DENSITY = "uv.omt_density_set"


def draw(layout: bpy.types.UILayout, _context: bpy.types.Context) -> None:
    row = layout.row(align=True)
    for name, title, _, _, _ in KINDS:
        row.operator(SHOW, text=title, depress=overlay.kind() == name).show = name
    if overlay.kind() == "AREA":
        layout.label(text="Blue: less, red: more", icon="INFO")
    elif overlay.kind() == "SHEAR":
        layout.label(text="Dark: none, yellow: 4x", icon="INFO")
    row = layout.row(align=True)
    row.operator("uv.omt_measure", text="Measure", icon="DRIVER_DISTANCE")
    row.operator("uv.omt_histogram", text="Histogram", icon="RNDCURVE")
    image = bpy.data.images.get(HISTOGRAM)
    if image is not None and image.preview is not None:
        layout.template_icon(icon_value=image.preview.icon_id, scale=7.0)


def draw_density(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    properties = settings_of(context, SET_DENSITY)
    split(layout)
    layout.prop(properties, "density")
    layout.prop(properties, "texture_size")
    layout.prop(properties, "scope")
    row = layout.row(align=True)
    row.operator("uv.omt_density_get", text="Get", icon="EYEDROPPER").texture_size = properties.texture_size
    row.operator(SET_DENSITY, text="Set", icon="CHECKMARK")


SECTION = Section("inspect", "Inspect", draw, (SHOW, "uv.omt_measure", "uv.omt_histogram"), is_open=True)
DENSITY = Section("density", "Texel Density", draw_density, (SET_DENSITY,), parent="inspect")
