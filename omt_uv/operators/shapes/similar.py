"""Find what looks like the active object, whatever its topology, size and place: object.omt_similar."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ...session import run
from ..base import Complaint, SolverOperator, complaints, select_alone

SELECT = (
    ("DUPLICATES", "Duplicates", "The active object, and all that are the same but for triangles, size and place"),
    ("NEAREST", "Nearest", "The nearest object, with the active one last: what Match asks for"),
    ("NOTHING", "Nothing", "Leave the selection as it is"),
)
# Without a measured floor, as of two signatures that are alike to the last digit.
LEAST_FLOOR = 1e-6


class OBJECT_OT_omt_similar(SolverOperator, bpy.types.Operator):
    """List the objects of the scene, or files of a library, whose shapes are nearest to that of the active object"""

    bl_idname = "object.omt_similar"
    bl_label = "Similar"
    bl_options = {"REGISTER", "UNDO"}
    modes = ("OBJECT",)

    index: StringProperty(
        name="Library",
        description="Index that the command library has made of a folder. Empty: the objects of this scene",
        subtype="FILE_PATH",
    )
    top: IntProperty(name="Count", description="How many are listed", default=5, min=1, max=100)
    select: EnumProperty(name="Select", description="What is selected in the end", items=SELECT, default="DUPLICATES")
    bound: FloatProperty(
        name="Duplicates Within",
        description="How far apart duplicates may be, over how far apart two samplings of one shape are",
        default=1.5,
        min=1.0,
        soft_max=5.0,
    )

    def steps(self, context: bpy.types.Context):
        active = context.view_layer.objects.active
        if active is None or active.type != "MESH":
            raise Complaint("No mesh is active. Click the one to look for.")
        if self.index:
            return (yield from self._in_library(active))
        return (yield from self._in_scene(context, active))

    def _in_scene(self, context: bpy.types.Context, active: bpy.types.Object):
        """Pairs of an object's name and its ShapeDistance, nearest first, and why others have none."""
        from ...pipelines.shapes.distance import alike

        others = [obj for obj in context.view_layer.objects if obj.type == "MESH" and obj != active]
        if not others:
            raise Complaint("There is no other mesh in the scene. Name a library, or add objects.")
        own, surfaces, reasons = _surface(active), [], []
        for obj in others:
            try:
                surfaces.append((obj.name, _surface(obj)))
            except Complaint as complaint:
                reasons.append(str(complaint))
        with complaints(active):
            found, more = yield from run.aside(alike(own, surfaces))
        return found, reasons + more

    def _in_library(self, active: bpy.types.Object):
        """Pairs of a file's name and its ShapeDistance, nearest first."""
        from ...pipelines.shapes.distance import nearest_of
        from ...pipelines.shapes.signature_index import read_index

        with complaints(active):
            index = read_index(Path(bpy.path.abspath(self.index)))
            found = yield from run.aside(nearest_of(_surface(active), index, self.top))
        return found, []

    def finish(self, context: bpy.types.Context, result) -> None:
        found, reasons = result
        active = context.view_layer.objects.active
        same = [name for name, d in found if d.raw <= self.bound * max(d.floor, LEAST_FLOOR)]
        if not self.index and self.select != "NOTHING":
            names = same if self.select == "DUPLICATES" else [name for name, _ in found[:1]]
            select_alone(context, [active, *(context.view_layer.objects[name] for name in names)])
        for text in reasons:
            self.report({"WARNING"}, text)
        self.said = tuple((name, _text(d)) for name, d in found[: self.top])
        listed = ", ".join(f"{name} {_text(d)}" for name, d in found[: self.top])
        self.report({"INFO"}, f"Nearest to {active.name}: {listed or 'none'}; duplicates: {len(same)}")

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in ("index", "top", "select", "bound"):
            layout.prop(self, name)


def _surface(obj: bpy.types.Object):
    """The surface of an object. Raises Complaint."""
    from ...blender.mesh import read

    with complaints(obj):
        return read(obj).surface


def _text(distance) -> str:
    return f"{distance.distance:.3f}" if math.isfinite(distance.distance) else "-"
