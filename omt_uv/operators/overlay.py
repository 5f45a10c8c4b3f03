"""uv.omt_overlay and uv.omt_histogram: distortion to look at."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ..display import overlay
from .base import Complaint, read_objects, ready, tell

KINDS = (
    ("NONE", "Off", "No colours; attributes and shading are as before", "X", 0),
    ("AREA", "Area", "Blue: less texture than is due to the face, white: as due, red: more", "FACESEL", 1),
    ("SHEAR", "Shear", "Dark: angles are kept. Light: the texture is pulled four times and more", "MOD_LATTICE", 2),
)
HISTOGRAM = "OMT UV Histogram"


class UV_OT_omt_overlay(bpy.types.Operator):
    """Colour the faces by the distortion of their UVs, in the 3D View and in the UV editor"""

    bl_idname = "uv.omt_overlay"
    bl_label = "Show UV Distortion"
    bl_options = {"REGISTER", "UNDO"}

    show: EnumProperty(name="Show", description="What the colours tell", items=KINDS, default="AREA")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context)

    @classmethod
    def description(cls, _context, properties) -> str:
        return next(text for name, _, text, *_ in KINDS if name == properties.show)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..solver.errors import MeshError

        if self.show == "NONE":
            overlay.hide(context)
            return {"FINISHED"}
        try:
            overlay.show(context, read_objects(context), self.show)
        except Complaint as complaint:
            return tell(self, context, complaint)
        except MeshError as error:
            return tell(self, context, Complaint(str(error)))
        return {"FINISHED"}


class UV_OT_omt_histogram(bpy.types.Operator):
    """Draw how area error and shear are spread over the surface, as an image for the UV or image editor"""

    bl_idname = "uv.omt_histogram"
    bl_label = "UV Distortion Histogram"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..display.canvas import set_preview, show
        from ..display.histogram import histogram, thumbnail
        from ..solver.errors import MeshError

        try:
            readings = [reading for _, reading in read_objects(context)]
            image = show(HISTOGRAM, histogram(readings))
            set_preview(image, thumbnail(readings))
        except Complaint as complaint:
            return tell(self, context, complaint)
        except MeshError as error:
            return tell(self, context, Complaint(str(error)))
        if context.space_data is not None and context.space_data.type == "IMAGE_EDITOR":
            context.space_data.image = image
        else:
            self.report({"INFO"}, f"Drawn as the image {image.name!r}; choose it in an image editor")
        return {"FINISHED"}
