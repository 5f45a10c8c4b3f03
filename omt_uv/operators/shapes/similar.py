"""Find what looks like the active object, whatever its topology, size and place: object.omt_similar."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ...session import run
from ..base import Complaint, SolverOperator, complaints, select_alone
from ..properties import choose_group

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
    centre_group: StringProperty(
        name="Centre",
        description="Vertex group or landmark, of the same name on all objects, in the middle of what is compared, as "
        "the tip of a nose. Empty: whole bodies are",
    )
    start_group: StringProperty(
        name="Start",
        description="Vertex group or landmark, of the same name on all objects, as far from the centre as what is "
        "compared, or on the boundary around it",
    )
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
        own, surfaces, reasons, compared = _surface(active), [], [], [active]
        for obj in others:
            try:
                surfaces.append((obj.name, _surface(obj)))
                compared.append(obj)
            except Complaint as complaint:
                reasons.append(str(complaint))
        with complaints(active):
            markers = self._markers(compared, [own, *(surface for _, surface in surfaces)])
            found, more = yield from run.aside(alike(own, surfaces, markers))
        return found, reasons + more

    def _in_library(self, active: bpy.types.Object):
        """Pairs of a file's name and its ShapeDistance, nearest first."""
        from ...pipelines.shapes.distance import nearest_of
        from ...pipelines.shapes.signature_index import read_index

        with complaints(active):
            index = read_index(Path(bpy.path.abspath(self.index)))
            own = _surface(active)
            markers = self._markers([active], [own])
            if index.marked != (markers is not None):
                given = "with markers. Name them" if index.marked else "without markers. Empty the fields"
                raise Complaint(f"{self.index}: The library was made {given} Centre and Start.")
            found = yield from run.aside(nearest_of(own, index, self.top, markers[0] if markers else None))
        return found, []

    def _markers(self, objects: list, surfaces: list) -> list | None:
        """What is marked on each object, None without any names."""
        from ...blender.shapes.landmarks import disk_markers

        names = (self.centre_group, self.start_group)
        if not any(names):
            return None
        if not all(names):
            raise Complaint("One marker is named, the other is not. Name both, Centre and Start, or none.")
        return disk_markers(objects, [surface.positions for surface in surfaces], names)

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
        column = layout.column(align=True)
        choose_group(column, self, "centre_group")
        choose_group(column, self, "start_group")


def _surface(obj: bpy.types.Object):
    """The surface of an object. Raises Complaint."""
    from ...blender.mesh import read

    with complaints(obj):
        return read(obj).surface


def _text(distance) -> str:
    return f"{distance.distance:.3f}" if math.isfinite(distance.distance) else "-"
