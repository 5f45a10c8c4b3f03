"""Colour the active object by its distance from another one, and say how far they are apart: object.omt_distance."""

from __future__ import annotations

import bpy

from ..base import Complaint, QuickOperator, check_all_local, complaints, read_objects


class OBJECT_OT_omt_distance(QuickOperator, bpy.types.Operator):
    """Colour the active object by its distance from the other selected one, and report how far they are apart"""

    bl_idname = "object.omt_distance"
    bl_label = "Compare With Selected"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.mode == "OBJECT"

    def act(self, context: bpy.types.Context) -> None:
        import numpy as np

        from ...blender.colour_attributes import write_colours
        from ...blender.measuring.distances import NAME, placed_mesh, write_distances
        from ...display import overlay
        from ...display.colormaps import SHEAR_TOP, shear_colours
        from ...pipelines.reading import check_places
        from ...solver.comparison.comparison_figures import compare, distances_to
        from ...solver.progress import drain

        pairs = read_objects(context)
        active = [pair for pair in pairs if pair[0] == context.view_layer.objects.active]
        others = [pair for pair in pairs if pair[0] != context.view_layer.objects.active]
        check_all_local(active)
        if len(active) != 1 or len(others) != 1:
            raise Complaint("Select two mesh objects, the one that is to be coloured last.")
        obj = active[0][0]
        for each, reading in (*active, *others):
            with complaints(each):
                check_places(reading.surface)
        mine, other = placed_mesh(*active[0]), placed_mesh(*others[0])
        with complaints():
            figures = drain(compare(other, mine))
            distance = distances_to(*other, mine[0])
            write_distances(obj, distance)
        vertices = np.zeros(len(obj.data.loops), np.int32)
        obj.data.loops.foreach_get("vertex_index", vertices)
        # Vertices of no face show no colour, and may be anywhere.
        greatest = float(distance[vertices].max())
        share = distance[vertices] / max(greatest, 1e-300)
        write_colours(obj, np.arange(len(vertices)), shear_colours(SHEAR_TOP**share))
        overlay.show_written(context)
        self.report(
            {"INFO"},
            f"Hausdorff {100 * figures.hausdorff:.3f} %, rms {100 * figures.rms:.4f} % of the diagonal of "
            f"{others[0][0].name}; yellow is {greatest:.4g} away; {NAME!r} has the distances",
        )
