"""uv.omt_measure: how far the active UVs are from keeping areas and angles."""

from __future__ import annotations

import bpy

from ..session import summary as last_run
from ..settings import DEFAULT_TEXTURE_SIZE
from .base import Complaint, read_objects, ready, tell


class UV_OT_omt_measure(bpy.types.Operator):
    """Report area error, shear, folds and overlap of the active UVs, of the selected faces in Edit Mode"""

    bl_idname = "uv.omt_measure"
    bl_label = "Measure UV Distortion"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..pipelines.distortion import measure_readings, summary
        from ..solver.errors import MeshError

        try:
            readings = [reading for _, reading in read_objects(context)]
            self.report({"INFO"}, summary(measure_readings(readings)))
            rows = last_run.figures(readings, DEFAULT_TEXTURE_SIZE, context.scene.unit_settings.scale_length)
            last_run.state.summary = last_run.Summary(self.bl_label, rows)
        except Complaint as complaint:
            return tell(self, context, complaint)
        except MeshError as error:
            return tell(self, context, Complaint(str(error)))
        return {"FINISHED"}
