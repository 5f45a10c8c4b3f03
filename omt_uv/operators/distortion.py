"""Measure, colour and draw the distortion of the active UVs: uv.omt_measure, uv.omt_overlay, uv.omt_histogram."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ..display import overlay
from ..session import last_run
from .base import QuickOperator, blaming, check_all_local, figures_of, read_objects

KINDS = (
    ("NONE", "Off", "No colours; attributes and shading are as before", "X", 0),
    ("AREA", "Area", "Blue: less texture than is due to the face, white: as due, red: more", "FACESEL", 1),
    ("SHEAR", "Shear", "Dark: angles are kept. Light: the texture is pulled four times and more", "MOD_LATTICE", 2),
)
HISTOGRAM = "OMT UV Histogram"


class UV_OT_omt_measure(QuickOperator, bpy.types.Operator):
    """Report area error, shear, folds and overlap of the active UVs, of the selected faces in Edit Mode"""

    bl_idname = "uv.omt_measure"
    bl_label = "Measure UV Distortion"
    bl_options = {"REGISTER"}

    def act(self, context: bpy.types.Context) -> None:
        from ..pipelines.distortion import measure_readings, on_subdivision, summary

        pairs = read_objects(context)
        readings = [reading for _, reading in pairs]
        with blaming(pairs):
            measured = measure_readings(readings)
        self.report({"INFO"}, summary(measured, on_subdivision(readings)))
        found, overlap = figures_of(context, readings, measured=measured), last_run.overlap_row(measured.overlap or 0.0)
        names = tuple(obj.name for obj, _ in pairs)
        last_run.keep(
            last_run.Summary(self.bl_label, found.rows + overlap.rows, (), names, found.beyond | overlap.beyond)
        )


class UV_OT_omt_overlay(QuickOperator, bpy.types.Operator):
    """Colour the faces by the distortion of their UVs, in the 3D View and in the UV editor"""

    bl_idname = "uv.omt_overlay"
    bl_label = "Show UV Distortion"
    bl_options = {"REGISTER", "UNDO"}

    show: EnumProperty(name="Show", description="What the colours tell", items=KINDS, default="AREA")

    @classmethod
    def description(cls, _context, properties) -> str:
        return next(text for name, _, text, *_ in KINDS if name == properties.show)

    def act(self, context: bpy.types.Context) -> None:
        if self.show == "NONE":
            overlay.hide(context)
        else:
            pairs = check_all_local(read_objects(context))
            with blaming(pairs):
                overlay.show(context, pairs, self.show)


class UV_OT_omt_histogram(QuickOperator, bpy.types.Operator):
    """Draw how area error and shear are spread over the surface, as an image for the UV or image editor"""

    bl_idname = "uv.omt_histogram"
    bl_label = "UV Distortion Histogram"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        from ..display.canvas import set_preview, show
        from ..display.histogram import histogram, thumbnail
        from ..pipelines.subdivision import evaluated

        pairs = read_objects(context)
        readings = [evaluated(reading) for _, reading in pairs]
        with blaming(pairs):
            image = show(HISTOGRAM, histogram(readings))
        set_preview(image, thumbnail(readings))
        if context.space_data is not None and context.space_data.type == "IMAGE_EDITOR":
            context.space_data.image = image
        else:
            self.report({"INFO"}, f"Drawn as the image {image.name!r}; choose it in an image editor")
