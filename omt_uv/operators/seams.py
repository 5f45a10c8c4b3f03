"""Mark the seams that unwrapping needs, and stop, so that they can be seen and edited: uv.omt_seams."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from ..session import run
from ..session.language import counted
from ..settings import DEFAULT_MAX_SHEAR
from .base import SolverOperator, check_all_local, complaints, read_objects, warn
from .properties import SubdivisionSettings, choose_group, shear_bound


class UV_OT_omt_seams(SubdivisionSettings, SolverOperator, bpy.types.Operator):
    """Mark short seams that open every part into one island, along creases and hollows. Seams that exist are kept"""

    bl_idname = "uv.omt_seams"
    bl_label = "Seams for Area Preserving"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    max_shear: FloatProperty(
        name="Max Shear",
        description="Seams are added until maps are predicted to shear less than this in the mean, where they are seen "
        "least. 0: only those that open a part, and to extremities",
        default=DEFAULT_MAX_SHEAR,
        min=0.0,
        soft_max=3.0,
    )
    extremities: IntProperty(
        name="Extremities",
        description="Without Max Shear: tips such as ears and limbs that a part may be cut to, at most. "
        "More seams let the map shear less; no more are added than pay",
        default=8,
        min=0,
        max=32,
    )
    fill_holes: BoolProperty(
        name="Fill Holes",
        description="Take holes for filled, so that no seam runs to them; the longest boundary of a part stays open",
        default=False,
    )
    keep_free: StringProperty(
        name="Keep Free", description="Vertex group that seams avoid, the more the larger the weight. Empty: none"
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def steps(self, context: bpy.types.Context):
        from ..blender.vertex_groups import avoided
        from ..pipelines.layout import in_turn

        pairs = check_all_local(read_objects(context))
        objects = [obj for obj, _ in pairs]
        options = {"fill": self.fill_holes, "extremities": self.extremities}
        bound = shear_bound(self.max_shear)
        with complaints(objects=objects):
            free = avoided(objects, self.keep_free)
            readings = [reading for _, reading in pairs]
            every = zip(readings, free, self.subdivisions(readings), strict=True)
            cutting = [_cut(reading, avoid, modifier, bound, options) for reading, avoid, modifier in every]
            cuts = yield from run.aside(in_turn(cutting))
        return list(zip(objects, cuts, strict=True))

    def finish(self, context: bpy.types.Context, result) -> None:
        from ..blender.seams import mark_seams

        new = [mark_seams(obj, cuts.edges) for obj, cuts in result]
        warn(self, [obj for obj, _ in result], [(k, text) for k, (_, c) in enumerate(result) for text in c.warnings])
        opened = sum(len(cuts.components) for _, cuts in result)
        if sum(new):
            edges = counted(sum(new), "{} edge", "{} edges")
            text = counted(opened, "Opened {} part along {}", "Opened {} parts along {}", opened, edges)
            self.report({"INFO"}, text)
        else:
            self.report({"INFO"}, "Every part is an island already; no seam is needed")


def _cut(reading, avoid, modifier, bound: float, options: dict):
    """The cuts of a surface, as it is or as a modifier subdivides it, for a bound of the shear or, with 0, none."""
    from ..pipelines.subdivision import on_subdivided_surface
    from ..solver.parameterization.chart_indices import clear_of_pins
    from ..solver.parameterization.unwrap import predicted_cuts
    from ..solver.progress import Progress

    yield Progress("Seams", 0.0)
    clear = clear_of_pins(reading.surface, reading.pins, avoid)
    surface = on_subdivided_surface(reading.surface, modifier)
    return predicted_cuts(surface, reading.faces, bound, reading.axes, avoid=clear, **options)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "max_shear")
    column = layout.column()
    column.active = properties.max_shear <= 1
    column.prop(properties, "extremities")
    layout.prop(properties, "fill_holes")
    layout.prop(properties, "use_subdivision", text="Subdivision")
    choose_group(layout, properties, "keep_free")
