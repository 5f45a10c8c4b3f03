"""Map the insides of closed bodies to a ball, a cube or another body, and make objects of them: object.omt_volume."""

from __future__ import annotations

import importlib.util

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ...pipelines.volumes.choices import (
    AXES,
    DEFAULT_TETS,
    VOLUME_DOMAINS,
    VOLUME_LIBRARIES,
    VOLUME_METHODS,
    VOLUME_RESULTS,
)
from ...session import run
from ..base import Complaint, SolverOperator, complaints, mesh_objects, select_alone, warn

# What pip has to install for a library: fTetWild does not bring PyVista, which it asks for.
PACKAGES = {"TETGEN": ("tetgen",), "TETWILD": ("pytetwild", "pyvista")}


class OBJECT_OT_omt_volume(SolverOperator, bpy.types.Operator):
    """Map the inside of a closed body so that every part keeps its share of the volume, and make shells, points,
    tetrahedra or slices of it"""

    bl_idname = "object.omt_volume"
    bl_label = "Map Volume"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    modes = ("OBJECT",)

    domain: EnumProperty(name="Domain", description="What the inside is mapped to", items=VOLUME_DOMAINS)
    body: StringProperty(name="Body", description="Closed mesh object to whose inside it is mapped")
    method: EnumProperty(name="Method", description="How volumes are made right", items=VOLUME_METHODS)
    tets: IntProperty(
        name="Tetrahedra",
        description="About how many tetrahedra fill the body",
        default=DEFAULT_TETS,
        min=10,
        soft_min=1000,
        soft_max=200_000,
    )
    library: EnumProperty(name="Library", description="What fills the body with tetrahedra", items=VOLUME_LIBRARIES)
    result: EnumProperty(name="Result", description="What is made of the map", items=VOLUME_RESULTS)
    shells: IntProperty(name="Shells", description="How many shells divide the body", default=3, min=1, max=64)
    points: IntProperty(
        name="Points",
        description="How many points are put inside",
        default=2000,
        min=1,
        max=10_000_000,
        soft_max=100_000,
    )
    seed: IntProperty(name="Seed", description="Another number puts the points elsewhere", default=0, min=0)
    axis: EnumProperty(name="Axis", description="Which way the body is cut", items=AXES)
    place: FloatProperty(
        name="Place", description="Where it is cut, from one end to the other", default=0.5, min=0.0, max=1.0
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def steps(self, context: bpy.types.Context):
        from ...blender.volumes.tet_objects import read_volume_body
        from ...pipelines.layout import in_turn
        from ...pipelines.volumes.volume import VolumeSettings, mapped_volume

        objects = [obj for obj in mesh_objects(context) if self.domain != "BODY" or obj.name != self.body]
        other = None
        bodies = []
        for obj in objects:
            with complaints(obj):
                bodies.append(read_volume_body(obj))
        if self.domain == "BODY":
            goal = bpy.data.objects.get(self.body)
            if goal is None or goal.type != "MESH" or not objects:
                raise Complaint(f"There is no mesh {self.body!r} to map to, besides what is mapped. Choose one.")
            with complaints(goal):
                other = read_volume_body(goal)
        settings = VolumeSettings(self.domain.lower(), self.method.lower(), self.tets, self.library.lower())
        with complaints(objects=objects):
            found = yield from run.aside(in_turn([mapped_volume(body, settings, other) for body in bodies]))
        return list(zip(objects, found, strict=True))

    def finish(self, context: bpy.types.Context, result) -> None:
        made = [new for obj, found in result for new in self._make(obj, found)]
        found = [each for _, each in result]
        warn(self, [obj for obj, _ in result], [(k, text) for k, f in enumerate(found) for text in f.map.warnings])
        self.said = (
            ("Tetrahedra", f"{sum(len(f.map.tets) for f in found)}"),
            ("Inverted", f"{sum(f.map.inverted for f in found)}"),
            ("Volume error", f"{100 * max(f.map.around_vertices for f in found):.2g} %"),
        )
        if made:
            select_alone(context, made)
        self.report({"INFO"}, f"Mapped {', '.join(obj.name for obj, _ in result)}")

    def _make(self, obj: bpy.types.Object, found) -> list:
        """The new objects of one map."""
        from ...blender.volumes import tet_objects

        if self.result == "SHELLS":
            return tet_objects.shell_objects(obj, found, self.shells)
        if self.result == "POINTS":
            return [tet_objects.point_object(obj, found, self.points, self.seed)]
        if self.result == "SLICE":
            return [tet_objects.slice_object(obj, found, "XYZ".index(self.axis), self.place)]
        if self.result == "TETS":
            return [tet_objects.tet_object(obj, found)]
        tet_objects.write_places(obj, found)
        return []


def missing(library: str) -> str:
    """The packages that a library for tetrahedra needs, as pip takes them, empty where all are installed."""
    packages = PACKAGES[library]
    return "" if all(map(importlib.util.find_spec, packages)) else " ".join(packages)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator that count as others stand, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "domain")
    if properties.domain == "BODY":
        layout.prop_search(properties, "body", bpy.data, "objects")
    layout.prop(properties, "method")
    layout.prop(properties, "tets")
    layout.prop(properties, "library")
    layout.prop(properties, "result")
    if properties.result == "SHELLS":
        layout.prop(properties, "shells")
    if properties.result == "POINTS":
        layout.prop(properties, "points")
        layout.prop(properties, "seed")
    if properties.result == "SLICE":
        layout.prop(properties, "axis")
        layout.prop(properties, "place")
