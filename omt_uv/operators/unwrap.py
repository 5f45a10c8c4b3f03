"""Unwrap whole objects or selected faces, area preserving: uv.omt_unwrap."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ..session import run
from ..settings import (
    BOUNDARIES,
    CONTEXT,
    DEFAULT_BOUNDARY,
    DEFAULT_MAP,
    DEFAULT_MAX_SHEAR,
    DEFAULT_SEAMS,
    MAPS,
    SEAMS,
    Settings,
)
from .base import SolverOperator, complaints, read_writable, warn, write_layers
from .properties import (
    AreaSettings,
    MarginSettings,
    SubdivisionSettings,
    choose_group,
    choose_layer,
    draw_balance,
    draw_margin,
    shear_bound,
)

# Settings that name vertex groups, by what they are for.
MARKERS = {"centre": "centre_group", "start": "start_group", "corners": "corner_group"}


class UV_OT_omt_unwrap(AreaSettings, SubdivisionSettings, MarginSettings, SolverOperator, bpy.types.Operator):
    """Unwrap so that every part of the surface gets its share of the texture. Islands follow the seams, pins stay"""

    bl_idname = "uv.omt_unwrap"
    bl_label = "Unwrap Area Preserving"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    makes_uvs = True

    boundary: EnumProperty(
        name="Boundary",
        description="Outline of every island",
        items=BOUNDARIES,
        default=DEFAULT_BOUNDARY,
    )
    kind: EnumProperty(name="Map", description="Which map", items=MAPS, default=DEFAULT_MAP)
    aspect: FloatProperty(
        name="Aspect",
        description="Height over width of rectangles. 0: the aspect that the island has without shear",
        default=0.0,
        min=0.0,
        max=1000.0,
        soft_max=10.0,
    )
    centre_group: StringProperty(
        name="Centre", description="Vertex group of the vertex that goes to the middle of a disk"
    )
    start_group: StringProperty(
        name="Start", description="Vertex group of the vertex of the boundary that goes to the right of the middle"
    )
    corner_group: StringProperty(
        name="Corners",
        description="Vertex group of four vertices that go into the corners of a rectangle; of three, to the right, "
        "upper and left end of a disk",
    )
    seams: EnumProperty(name="Seams", description="Where islands are cut", items=SEAMS, default=DEFAULT_SEAMS)
    fill_holes: BoolProperty(
        name="Fill Holes",
        description="Take holes such as eyes and nostrils for filled instead of cutting to them; "
        "the longest boundary of a part stays open",
        default=False,
    )
    keep_free: StringProperty(
        name="Keep Free", description="Vertex group that new cuts avoid, the more the larger the weight. Empty: none"
    )
    max_shear: FloatProperty(
        name="Max Shear",
        description="Seams are added until the mean shear of islands is below this, where they are seen least. "
        "0: only those that are needed to open a part. Islands whose seams you marked are left as they are",
        default=DEFAULT_MAX_SHEAR,
        min=0.0,
        soft_max=3.0,
    )
    cut_further: BoolProperty(
        name="Cut Further", description="Add seams to islands whose seams you marked, too", default=False
    )
    mark_seams: BoolProperty(
        name="Mark Seams", description="Mark the edges that were cut as seams of the mesh", default=False
    )
    pack: BoolProperty(
        name="Pack Islands",
        description="Arrange the islands in the unit square. Otherwise they are centred one upon the other, "
        "the largest as wide as the square",
        default=True,
    )
    pack_around: BoolProperty(
        name="Pack Around",
        description="Leave room for islands that stay where they are: those with pins, and in Edit Mode those of faces "
        "that are not selected. Otherwise they are packed as if there were none",
        default=False,
    )
    turn_to_fit: BoolProperty(
        name="Turn to Fit",
        description="Turn islands any way that packs them closer. Otherwise they stand as the body does, and "
        "small ones may lie on a side",
        default=False,
    )
    uv_layer: StringProperty(
        name="UV Map", description="UV map to write, made if there is none of this name. Empty: the active one"
    )

    def stacks(self) -> bool:
        return not self.pack

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> Settings:
        return Settings(
            boundary=self.boundary.lower(),
            quality=self.quality.lower(),
            balance=self.balance,
            margin=self.margin,
            texture_size=self.texture_size,
            pack=self.pack,
            pack_around=self.pack_around,
            turn_to_fit=self.turn_to_fit,
            tile=self.tile,
            seams=self.seams.lower(),
            fill_holes=self.fill_holes,
            max_shear=shear_bound(self.max_shear),
            cut_further=self.cut_further,
            kind=self.kind.lower(),
            aspect=self.aspect,
        )

    def steps(self, context: bpy.types.Context):
        from ..blender.vertex_groups import avoided, map_markers
        from ..pipelines.layout import UnwrapJob
        from ..pipelines.unwrap import lay_out

        objects, readings = read_writable(context, self.uv_layer)
        with complaints(objects=objects):
            free = avoided(objects, kept_free(self))
            marked = map_markers(objects, groups_of_markers(self))
            jobs = [
                UnwrapJob.of(r, modifier, avoid, marks)
                for r, avoid, marks, modifier in zip(readings, free, marked, self.subdivisions(readings), strict=True)
            ]
            layout = yield from run.aside(lay_out(jobs, self.settings()))
        return objects, layout

    def finish(self, context: bpy.types.Context, result) -> None:
        objects, layout = result
        warn(self, objects, write_result(self, objects, layout))


def kept_free(chosen) -> str:
    """Vertex group that cuts avoid; none where there are no cuts but those that exist."""
    return "" if chosen.seams == "EXISTING" else chosen.keep_free


def groups_of_markers(chosen) -> dict[str, str]:
    """Vertex groups of markers by what they mark: of outlines that are free, what goes to the right alone counts."""
    counting = MARKERS if chosen.boundary != "FREE" else ("start",)
    return {role: getattr(chosen, name) if role in counting else "" for role, name in MARKERS.items()}


def write_result(chosen, objects: list, layout) -> list[tuple[int, str]]:
    """Write the UVs of objects, and their seams if the settings that were chosen say so: warnings, each with the number
    of its object."""
    from ..blender.seams import mark_seams
    from ..blender.subdivision import subdivision_warnings

    write_layers(objects, chosen.uv_layer, layout)
    if chosen.mark_seams:
        for obj, surface_map in zip(objects, layout.maps, strict=True):
            mark_seams(obj, surface_map.seams)
    return layout.warnings + (subdivision_warnings(objects) if chosen.use_subdivision else [])


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel."""
    draw_balance(layout, properties)
    draw_main(layout, properties)
    layout.separator()
    draw_more(layout, properties)


def draw_main(layout: bpy.types.UILayout, properties) -> None:
    """What everybody looks at, below the slider."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "boundary", text="Boundary", text_ctxt=CONTEXT)
    layout.prop(properties, "quality")


def draw_more(layout: bpy.types.UILayout, properties) -> None:
    """Where islands are cut, and where they go."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "kind")
    column = layout.column()
    column.active = properties.boundary == "RECTANGLE"
    column.prop(properties, "aspect")
    choose_group(layout, properties, "start_group")
    column = layout.column()
    column.active = properties.boundary != "FREE"
    choose_group(column, properties, "corner_group")
    choose_group(column, properties, "centre_group")
    layout.separator()
    layout.prop(properties, "seams")
    column = layout.column()
    column.active = properties.seams != "EXISTING"
    choose_group(column, properties, "keep_free")
    layout.prop(properties, "fill_holes")
    column = layout.column()
    column.active = properties.seams == "AUTO" and properties.boundary == "FREE"
    column.prop(properties, "max_shear")
    column.prop(properties, "cut_further")
    layout.prop(properties, "mark_seams")
    layout.prop(properties, "use_subdivision", text="Subdivision")
    layout.separator()
    layout.prop(properties, "pack")
    column = layout.column()
    column.active = properties.pack
    column.prop(properties, "pack_around")
    column.prop(properties, "turn_to_fit")
    draw_margin(layout, properties, properties.pack)
    # What is not packed lies in it, too.
    layout.prop(properties, "tile")
    choose_layer(layout, properties, "uv_layer")
