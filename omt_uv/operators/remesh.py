"""Make a new mesh of a chosen size beside the old one, with everything that it carries: object.omt_remesh."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..session import run
from ..settings import CONTEXT, COUNTS, DEFAULT_STRATEGY, DENSITIES, STRATEGIES, RemeshSettings
from .base import Complaint, SolverOperator, complaints, mesh_objects, ready, select_alone, warn
from .properties import choose_attribute, choose_group


class OBJECT_OT_omt_remesh(SolverOperator, bpy.types.Operator):
    """Make a new object with triangles of even shape and a chosen number. The object itself stays as it is"""

    bl_idname = "object.omt_remesh"
    bl_label = "Remesh Area Preserving"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    count_of: EnumProperty(name="Count", description="What sets the size of the new mesh", items=COUNTS)
    target_vertices: IntProperty(
        name="Vertices", description="Vertices of the new mesh", default=5000, min=4, soft_max=100_000
    )
    target_faces: IntProperty(
        name="Faces", description="Triangles of the new mesh", default=10_000, min=4, soft_max=200_000
    )
    edge_length: FloatProperty(
        name="Edge Length",
        description="Mean length of the edges, with the scale of the object",
        default=0.1,
        min=1e-6,
        soft_max=10,
        precision=4,
        subtype="DISTANCE",
    )
    density: EnumProperty(name="Density", description="Where triangles are smaller", items=DENSITIES)
    weight_group: StringProperty(name="Group", description="Vertex group that says where triangles are smaller")
    weight_factor: FloatProperty(
        name="Factor",
        description="Vertices per area where the weight, or the saliency, is 1, next to where it is 0",
        default=4.0,
        min=0.01,
        max=1000.0,
        soft_min=1.0,
        soft_max=32.0,
    )
    amount: FloatProperty(
        name="Amount",
        description="How much curvature counts next to area. At 1, half of the vertices of a sphere follow it",
        default=1.0,
        min=0.0,
        max=1000.0,
        soft_max=10.0,
    )
    density_attribute: StringProperty(
        name="Attribute", description="Attribute of positive floats, on vertices or faces"
    )
    grading: FloatProperty(
        name="Grading",
        description="Most that the edge length grows by per length, so that sizes change gently. 0: any",
        default=0.0,
        min=0.0,
        soft_max=1.0,
    )
    use_preserve_boundary: BoolProperty(
        name="Preserve Boundary",
        description="Keep the outline of open meshes, and its corners. Without, it is smoothed as far as the new edges "
        "are too long to show it, and vertices are even along it",
        default=True,
    )
    use_preserve_sharp: BoolProperty(
        name="Preserve Sharp",
        description="Keep edges that are marked sharp, creased, or sharper than the angle",
        default=False,
    )
    sharp_angle: FloatProperty(
        name="Sharp Angle",
        description="Edges with more than this angle between their faces are sharp",
        default=0.7,
        min=0.0,
        max=3.1416,
        subtype="ANGLE",
    )
    use_preserve_seams: BoolProperty(
        name="Preserve Seams",
        description="Keep seams and the outlines of UV islands, so that UV maps are carried without a stretch",
        default=True,
    )
    use_preserve_materials: BoolProperty(
        name="Preserve Material Borders", description="Keep the edges between materials", default=True
    )
    preserve_attributes: BoolProperty(
        name="Preserve Attributes",
        description="Carry UV maps, vertex groups, colours, shape keys and other attributes to the new mesh",
        default=True,
    )
    use_modifiers: BoolProperty(
        name="Apply Modifiers", description="Remesh what the modifiers make of the mesh", default=False
    )
    levels: IntProperty(
        name="Levels", description="How many objects to make, LOD0 the finest", default=1, min=1, max=16, soft_max=6
    )
    ratio: FloatProperty(
        name="Ratio",
        description="Size of each level next to the one before",
        default=0.5,
        min=0.01,
        max=0.99,
        subtype="FACTOR",
    )
    hide_original: BoolProperty(
        name="Hide Original",
        description="Hide the object that the new one was made of, which lies in the same place. Alt H shows it",
        default=True,
    )
    strategy: EnumProperty(
        name="Strategy",
        description="On which map vertices are placed, and on which they are joined",
        items=STRATEGIES,
        default=DEFAULT_STRATEGY,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode == "EDIT_MESH":
            cls.poll_message_set("Makes new objects, so it works in Object Mode only")  # type: ignore[attr-defined]
            return False
        return ready(cls, context)

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> RemeshSettings:
        counts = {"VERTICES": self.target_vertices, "FACES": self.target_faces, "EDGE": self.edge_length}
        return RemeshSettings(
            count_of=self.count_of.lower(),
            count=counts[self.count_of],
            density=self.density.lower(),
            factor=self.weight_factor,
            amount=self.amount,
            source=self.weight_group if self.density == "WEIGHTS" else self.density_attribute,
            grading=self.grading,
            preserve_boundary=self.use_preserve_boundary,
            preserve_sharp=self.use_preserve_sharp,
            sharp_angle=self.sharp_angle,
            preserve_seams=self.use_preserve_seams,
            preserve_materials=self.use_preserve_materials,
            preserve_attributes=self.preserve_attributes,
            levels=self.levels,
            ratio=self.ratio,
            strategy=self.strategy.lower(),
        )

    def steps(self, context: bpy.types.Context):
        from ..blender.remesh_objects import alike, read_request

        groups = alike(mesh_objects(context, shared=True), self.use_modifiers)
        objects = [group[0] for group in groups]
        depsgraph = context.evaluated_depsgraph_get() if self.use_modifiers else None
        requests = []
        try:
            for obj in objects:
                with complaints(obj):
                    requests.append(read_request(obj, self.settings(), depsgraph))
            with complaints(objects=objects):
                results = yield from run.aside(_remesh_all(requests, self.settings()))
        except Complaint as complaint:
            if self.use_modifiers:
                # Elements of a mesh with modifiers are none of the object's.
                complaint.error = None
            raise
        return [(group, request, *result) for group, request, result in zip(groups, requests, results, strict=True)]

    def finish(self, context: bpy.types.Context, result) -> None:
        from ..blender.remesh_objects import carried_gate, lost, mark_source, new_objects

        names, warnings = [], []
        for k, (group, request, series, carried) in enumerate(result):
            warnings += [(k, text) for text in (*lost(group[0], request, carried), *series.warnings)]
            new_names = new_objects(group, request, series, carried)
            # Objects that share a mesh have its UVs in common.
            told = carried_gate(group[0], new_names[:: len(group)])
            warnings += [(-1, text) for texts in told for text in texts]
            names += new_names
            mark_source(group, new_names)
        select_alone(context, [bpy.data.objects[name] for name in names])
        if self.hide_original:
            for obj in (obj for group, *_ in result for obj in group):
                obj.hide_set(True)
        self.said = _figures([series.levels[0] for _, _, series, _ in result])
        warn(self, [group[0] for group, *_ in result], warnings)
        self.report({"INFO"}, f"Made {', '.join(names)}")


def _figures(levels: list) -> tuple[tuple[str, str], ...]:
    """Rows for the panel about the finest mesh of every object: size and the smallest angles of its triangles."""
    import numpy as np

    from ..solver.mesh.geometry import least_angles

    least = np.degrees(np.concatenate([least_angles(level.positions, level.triangles) for level in levels]))
    return (
        ("Vertices", f"{sum(len(level.positions) for level in levels)}"),
        ("Triangles", f"{len(least)}"),
        ("Angles, 99 %", f"above {np.percentile(least, 1):.1f}°"),
    )


def _remesh_all(requests: list, settings: RemeshSettings):
    """The series of every request and what its meshes carry; Refusal says which one has none."""
    from ..blender.remesh_objects import carried_attributes
    from ..pipelines.layout import in_turn
    from ..pipelines.remesh import remesh_series

    found = yield from in_turn([remesh_series(request.job, settings) for request in requests])
    return [(series, carried_attributes(request, series)) for request, series in zip(requests, found, strict=True)]


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator that count as others stand, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "count_of")
    of = {"VERTICES": "target_vertices", "FACES": "target_faces", "EDGE": "edge_length"}
    layout.prop(properties, of[properties.count_of])
    layout.prop(properties, "density")
    _draw_density(layout, properties)
    _draw_preserved(layout.column(heading="Preserve"), properties)
    layout.column(heading="Apply").prop(properties, "use_modifiers", text="Modifiers")
    layout.prop(properties, "levels")
    if properties.levels > 1:
        layout.prop(properties, "ratio")
    layout.prop(properties, "hide_original")
    layout.prop(properties, "strategy")


def _draw_density(layout: bpy.types.UILayout, properties) -> None:
    if properties.density == "WEIGHTS":
        choose_group(layout, properties, "weight_group")
    if properties.density == "ATTRIBUTE":
        choose_attribute(layout, properties, "density_attribute")
    if properties.density in ("WEIGHTS", "SALIENCY"):
        layout.prop(properties, "weight_factor")
    if properties.density in ("CURVATURE", "GAUSSIAN"):
        layout.prop(properties, "amount")
    if properties.density != "UNIFORM":
        layout.prop(properties, "grading")


def _draw_preserved(column: bpy.types.UILayout, properties) -> None:
    column.prop(properties, "use_preserve_boundary", text="Boundary", text_ctxt=CONTEXT)
    column.prop(properties, "use_preserve_seams", text="Seams")
    column.prop(properties, "use_preserve_materials", text="Materials")
    column.prop(properties, "use_preserve_sharp", text="Sharp Edges")
    column.prop(properties, "preserve_attributes", text="Attributes")
    if properties.use_preserve_sharp:
        column.prop(properties, "sharp_angle")
