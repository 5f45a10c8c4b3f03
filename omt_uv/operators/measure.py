"""uv.omt_measure: how far the active UVs are from keeping areas and angles."""

from __future__ import annotations

import bpy

from .common import Complaint, SolverOperator, read_objects, tell


class UV_OT_omt_measure(bpy.types.Operator):
    """Report area error, shear, folds and overlap of the active UVs, of the selected faces in Edit Mode"""

    bl_idname = "uv.omt_measure"
    bl_label = "Measure UV Distortion"
    bl_options = {"REGISTER"}

    poll = SolverOperator.poll

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..measuring import measure_readings, summary
        from ..solver.errors import MeshError

        try:
            pairs = read_objects(context)
            self.report({"INFO"}, summary(measure_readings([reading for _, reading in pairs])))
        except Complaint as complaint:
            return tell(self, context, complaint)
        except MeshError as error:
            return tell(self, context, Complaint(str(error)))
        return {"FINISHED"}
