"""Put equal islands on one another, make halves the same, grids rectangles: uv.omt_stack, _symmetrize, _rectify."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty

from ...session.language import counted
from ..base import QuickOperator, complaints, read_writable, warn, write_layers

AXES = (
    ("X", "X", "Left and right of the object"),
    ("Y", "Y", "Front and back of the object"),
    ("Z", "Z", "Top and bottom of the object"),
)
HALVES = (
    ("APART", "Apart", "Mirror images of one another, each with a texture of its own"),
    ("STACKED", "On One Another", "Both halves share their part of the texture"),
)


class _Arranging(QuickOperator):
    """What the three have in common: subclasses give `arranged(readings)`."""

    said = ("Arranged {} island", "Arranged {} islands")

    def arranged(self, readings: list):
        raise NotImplementedError

    def act(self, context: bpy.types.Context) -> None:
        objects, readings = read_writable(context)
        with complaints(objects=objects):
            done = self.arranged(readings)
        write_layers(objects, "", done)
        warn(self, objects, done.warnings)
        self.report({"INFO"}, counted(done.changed, *self.said))  # type: ignore[attr-defined]


class UV_OT_omt_stack(_Arranging, bpy.types.Operator):
    """Put UV islands of equal shape on one another, so that they share their part of the texture"""

    bl_idname = "uv.omt_stack"
    bl_label = "Stack Equal UV Islands"
    bl_options = {"REGISTER", "UNDO"}
    said = ("Stacked {} island", "Stacked {} islands")

    mirrored: BoolProperty(
        name="Mirrored Too", description="Stack islands on those that they are mirror images of, too", default=True
    )

    def arranged(self, readings: list):
        from ...pipelines.arranging.actions import stack_islands

        return stack_islands(readings, self.mirrored)


class UV_OT_omt_symmetrize(_Arranging, bpy.types.Operator):
    """Give both halves of a symmetric object the same UVs, mirrored beside one another or on one another"""

    bl_idname = "uv.omt_symmetrize"
    bl_label = "Symmetrize UV Islands"
    bl_options = {"REGISTER", "UNDO"}
    said = ("Symmetrized {} island", "Symmetrized {} islands")

    axis: EnumProperty(name="Axis", description="Axis that the halves face each other along", items=AXES, default="X")
    halves: EnumProperty(name="Halves", description="Where the second half goes", items=HALVES, default="APART")

    def arranged(self, readings: list):
        from ...pipelines.arranging.actions import symmetrize_islands

        return symmetrize_islands(readings, "XYZ".index(self.axis), self.halves == "STACKED")


class UV_OT_omt_rectify(_Arranging, bpy.types.Operator):
    """Make rectangles of UV islands that are strips or grids of quads. Every row and every column keeps its area"""

    bl_idname = "uv.omt_rectify"
    bl_label = "Rectify UV Strips"
    bl_options = {"REGISTER", "UNDO"}
    said = ("Rectified {} island", "Rectified {} islands")

    def arranged(self, readings: list):
        from ...pipelines.arranging.actions import rectify_islands

        return rectify_islands(readings)
