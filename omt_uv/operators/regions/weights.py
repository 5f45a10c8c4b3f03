"""Write saliency, curvature, sharp edges or distance into a vertex group, to be repainted: object.omt_weights."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...display.shading import view_spaces
from ...session import run
from ...settings import DEFAULT_GROUP, DEFAULT_HIGH, DEFAULT_KIND, DEFAULT_LOW, WEIGHT_KINDS
from ..base import SolverOperator, complaints, mesh_objects
from ..properties import choose_group


class OBJECT_OT_omt_weights(SolverOperator, bpy.types.Operator):
    """Weigh vertices by what they show, into a vertex group that can be repainted and magnified"""

    bl_idname = "object.omt_weights"
    bl_label = "OMT Weights"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    modes = ("OBJECT", "EDIT_MESH", "PAINT_WEIGHT")

    kind: EnumProperty(name="Kind", description="What is weighed", items=WEIGHT_KINDS, default=DEFAULT_KIND)
    weight_group: StringProperty(
        name="Vertex Group",
        description="Vertex group to write, made if there is none of this name",
        default=DEFAULT_GROUP,
    )
    low: FloatProperty(
        name="From",
        description="Share of the surface, that with the least score, that gets weight 0",
        default=DEFAULT_LOW,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    high: FloatProperty(
        name="To",
        description="Share of the surface beyond which the weight is 1; between both it grows softly",
        default=DEFAULT_HIGH,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    invert: BoolProperty(name="Invert", description="Weight 1 where it would be 0, and 0 for 1", default=False)

    show: BoolProperty(
        name="Show",
        description="Show the weights in Weight Paint, to be repainted, or as an overlay in Edit Mode",
        default=True,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def steps(self, context: bpy.types.Context):
        from ...blender.mesh import read
        from ...blender.vertex_groups import check_group_target, selected_vertices
        from ...pipelines.layout import in_turn

        objects = [context.object] if context.mode == "PAINT_WEIGHT" else mesh_objects(context)
        jobs = []
        for obj in objects:
            with complaints(obj):
                check_group_target(obj, self.weight_group)
                selected = selected_vertices(obj) if self.kind == "DISTANCE" else None
                jobs.append((read(obj), selected))
        options = {"low": self.low, "high": self.high, "invert": self.invert}
        with complaints(objects=objects):
            weighing = [_weigh(reading, selected, self.kind.lower(), options) for reading, selected in jobs]
            weights = yield from run.aside(in_turn(weighing))
        return list(zip(objects, weights, strict=True))

    def finish(self, context: bpy.types.Context, result) -> None:
        from ...blender.vertex_groups import write_group

        for obj, weights in result:
            write_group(obj, self.weight_group, weights)
        # What is computed has no border that an artist drew: it gets so much denser, and no exact share, which soft
        # weights of half a surface reach by densities that shear far too much.
        context.window_manager.operator_properties_last("uv.omt_magnify").exact = False
        if self.show:
            _show(context)
        self.report({"INFO"}, f"Weights are in the vertex group {self.weight_group!r}")


def _show(context: bpy.types.Context) -> None:
    """Weight Paint of the active object where there is a window; in Edit Mode, the overlay of the views."""
    if bpy.app.background or context.window is None:
        return
    if context.mode == "OBJECT" and context.object is not None and context.object.type == "MESH":
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    elif context.mode == "EDIT_MESH":
        for space in view_spaces(context):
            space.overlay.show_weight = True


def _weigh(reading, selected, kind: str, options: dict):
    """Weights (n,) for a reading and a selection."""
    from ...blender.weights import computed_weights
    from ...solver.progress import Progress

    yield Progress("Weights", 0.0)
    return computed_weights(reading, kind, selected=selected, **options)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "kind")
    choose_group(layout, properties, "weight_group")
    column = layout.column(align=True)
    column.prop(properties, "low", slider=True)
    column.prop(properties, "high", slider=True)
    layout.prop(properties, "invert")
    layout.prop(properties, "show")
