"""Draw the section that shows how good UVs are: colours, figures, histogram, texel density."""

from __future__ import annotations

import bpy

from ..display import colour_bar, overlay
from ..operators.distortion import HISTOGRAM, KINDS
from ..operators.inspection.worst import FIGURES
from ..settings import CONTEXT
from .section import Section, settings_of, split

SHOW = "uv.omt_overlay"
SET_DENSITY = "uv.omt_density_set"


def draw(layout: bpy.types.UILayout, _context: bpy.types.Context) -> None:
    row = layout.row(align=True)
    for name, title, _, _, _ in KINDS:
        row.operator(SHOW, text=title, text_ctxt=CONTEXT, depress=overlay.kind() == name).show = name
    draw_bar(layout, overlay.kind())
    row = layout.row(align=True)
    row.operator("uv.omt_checker", text="Checker", icon="TEXTURE")
    row.operator("uv.omt_checker_remove", text="", icon="X")
    row = layout.row(align=True)
    row.operator("uv.omt_measure", text="Measure", icon="DRIVER_DISTANCE")
    row.operator("uv.omt_histogram", text="Histogram", icon="RNDCURVE")
    column = layout.column(align=True)
    column.label(text="Select Worst Faces")
    row = column.row(align=True)
    for name, title, _ in FIGURES:
        row.operator("uv.omt_worst", text=title, text_ctxt=CONTEXT).figure = name
    row = layout.row(align=True)
    row.operator("object.omt_distance", text="Compare", icon="MOD_MESHDEFORM")
    row.operator("uv.omt_regions", text="Copy Table", icon="COPYDOWN")
    row.operator("uv.omt_attributes", text="", icon="SPREADSHEET")
    row = layout.row(align=True)
    row.operator("uv.omt_layout_image", text="Layout to Image", icon="IMAGE_DATA")
    row.operator("object.omt_diagram", text="", icon="MESH_CIRCLE")
    image = bpy.data.images.get(HISTOGRAM)
    if image is not None and image.preview is not None:
        layout.template_icon(icon_value=image.preview.icon_id, scale=7.0)


def draw_bar(layout: bpy.types.UILayout, kind: str) -> None:
    """What the colours mean; as high as it is without colours, so that nothing moves."""
    column = layout.column(align=True)
    bar = column.row(align=True)
    bar.alignment = "CENTER"
    ends = column.split(factor=0.33)
    if kind not in colour_bar.ENDS:
        bar.label(text="")
        ends.label(text="")
        return
    for icon in colour_bar.icons(kind):
        bar.label(text="", icon_value=icon)
    for text, side in zip(colour_bar.ENDS[kind], ("LEFT", "CENTER", "RIGHT"), strict=True):
        place = ends.row()
        place.alignment = side
        place.label(text=text)


def draw_density(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    properties = settings_of(context, SET_DENSITY)
    split(layout)
    layout.prop(properties, "density")
    layout.prop(properties, "unit")
    layout.prop(properties, "texture_size")
    layout.prop(properties, "scope")
    row = layout.row(align=True)
    get = row.operator("uv.omt_density_get", text="Get", icon="EYEDROPPER")
    get.texture_size, get.unit = properties.texture_size, properties.unit
    row.operator(SET_DENSITY, text="Set", icon="CHECKMARK")


SECTION = Section(
    "inspect",
    "Inspect",
    draw,
    (
        SHOW,
        "uv.omt_measure",
        "uv.omt_histogram",
        "uv.omt_checker",
        "uv.omt_worst",
        "object.omt_distance",
        "uv.omt_regions",
        "uv.omt_attributes",
        "uv.omt_layout_image",
        "object.omt_diagram",
    ),
    is_open=True,
)
DENSITY = Section("density", "Texel Density", draw_density, (SET_DENSITY,), parent="inspect")
