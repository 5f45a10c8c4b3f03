"""Map closed parts to the sphere without a seam, and from there to a layout of the globe: uv.omt_sphere."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ..session import run
from ..settings import (
    DEFAULT_PROJECTION,
    DEFAULT_SPHERE_METHOD,
    IMAGE_LAYOUTS,
    PROJECTIONS,
    SPHERE_METHODS,
    GlobeSettings,
)
from .base import SolverOperator, complaints, read_writable, warn, write_layers
from .properties import AreaSettings, choose_group, choose_layer, draw_balance

ORIENTATIONS = (
    ("AXES", "Object Axes", "Z is north, the front (-Y) the middle of the map"),
    ("GROUPS", "Vertex Groups", "Vertex groups mark the north pole, the middle of the map, and its east"),
    ("PICKED", "Picked Vertices", "Three vertices picked in Edit Mode: north pole, middle of the map, east of it"),
)


class UV_OT_omt_sphere(AreaSettings, SolverOperator, bpy.types.Operator):
    """Map closed parts to a globe, area preserving and without a seam, and project it to the texture"""

    bl_idname = "uv.omt_sphere"
    bl_label = "OMT Sphere Projection"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    makes_uvs = True

    projection: EnumProperty(
        name="Projection", description="Layout of the globe", items=PROJECTIONS, default=DEFAULT_PROJECTION
    )
    method: EnumProperty(
        name="Method",
        description="How areas are moved on the sphere",
        items=SPHERE_METHODS,
        default=DEFAULT_SPHERE_METHOD,
    )
    fill_holes: BoolProperty(
        name="Fill Holes",
        description="Take holes for filled, for the map alone",
        default=False,
    )
    weight_group: StringProperty(
        name="Weights", description="Vertex group of what gets more of the texture. Empty: none"
    )
    weight_factor: FloatProperty(
        name="Factor",
        description="How many times the texture of vertices with weight 0 those with weight 1 get",
        default=2.0,
        min=0.01,
        soft_max=16.0,
    )
    orientation: EnumProperty(
        name="Orientation", description="What turns the globe", items=ORIENTATIONS, default="AXES"
    )
    pole_group: StringProperty(name="Pole", description="Vertex group of the north pole")
    meridian_group: StringProperty(name="Meridian", description="Vertex group of the middle of the map. Empty: none")
    east_group: StringProperty(name="East", description="Vertex group on the eastern side of the map. Empty: none")
    inside: BoolProperty(
        name="Inside the Tile",
        description="Scale the layout into the tile where faces across its edge reach beyond it. "
        "Without, it fits globe textures as they are, which repeat",
        default=True,
    )
    image: StringProperty(
        name="Redraw Image",
        description="Image to redraw for the layout, as a new image beside it. Empty: none",
    )
    image_layout: EnumProperty(
        name="Image Is", description="What the image shows", items=IMAGE_LAYOUTS, default=IMAGE_LAYOUTS[0][0]
    )
    uv_layer: StringProperty(
        name="UV Map", description="UV map to write, made if there is none of this name. Empty: the active one"
    )

    def stacks(self) -> bool:
        return True

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> GlobeSettings:
        return GlobeSettings(
            projection=self.projection.lower(),
            quality=self.quality.lower(),
            balance=self.balance,
            method=self.method.lower(),
            inside=self.inside,
            fill_holes=self.fill_holes,
        )

    def steps(self, context: bpy.types.Context):
        from ..blender.markers import globe_densities
        from ..files import images
        from ..pipelines.globe import globe_jobs, project
        from ..pipelines.panorama_redraw import redraw
        from ..solver.globe.rotation import MarkerError

        objects, readings = read_writable(context, self.uv_layer)
        with complaints(objects=objects, others=(MarkerError,)):
            markers = self._markers(context, objects)
            pairs = list(zip(objects, readings, strict=True))
            densities = globe_densities(pairs, self.weight_group, self.weight_factor)
            jobs = globe_jobs(readings, densities, markers)
            pixels = images.pixels_of(images.named(self.image)) if self.image else None
            globes = yield from run.aside(project(jobs, self.settings()))
        if pixels is not None:
            pixels = yield from run.aside(redraw(pixels, self.image_layout.lower(), self.projection.lower()))
        return objects, globes, pixels

    def _markers(self, context: bpy.types.Context, objects: list) -> list:
        from ..blender.markers import group_markers, picked_markers
        from ..solver.globe.rotation import MarkerError

        if self.orientation == "AXES":
            return [None] * len(objects)
        if self.orientation == "GROUPS":
            if not self.pole_group:
                raise MarkerError("Name the vertex group that marks the north pole, or turn the globe by the axes.")
            return group_markers(objects, self.pole_group, self.meridian_group, self.east_group)
        active = context.view_layer.objects.active
        return [picked_markers(obj) if obj == active else None for obj in objects]

    def finish(self, context: bpy.types.Context, result) -> None:
        from ..files import images

        objects, globes, pixels = result
        # A layout of the whole globe cannot keep areas; the map to the sphere does.
        reports = [globe.report() for mine in globes.globes for globe in mine]
        self.said = (
            ("Area error", f"{100 * max(r['area_l1_sphere'] for r in reports):.2f} %"),
            ("Shear", f"{max(r['angle_mean_sphere'] for r in reports):.3f}"),
            ("Folds on the sphere", str(sum(r["folds_sphere"] for r in reports))),
        )
        write_layers(objects, self.uv_layer, globes)
        if pixels is not None:
            source = images.named(self.image)
            images.packed_image(f"{source.name} {self.projection.lower()}", pixels, source)
        warn(self, objects, globes.warnings)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator that count as others stand, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    draw_balance(layout, properties)
    layout.prop(properties, "projection")
    layout.prop(properties, "quality")
    layout.prop(properties, "method")
    layout.prop(properties, "fill_holes")
    layout.prop(properties, "inside")
    choose_group(layout, properties, "weight_group")
    if properties.weight_group:
        layout.prop(properties, "weight_factor")
    layout.prop(properties, "orientation")
    if properties.orientation == "GROUPS":
        for name in ("pole_group", "meridian_group", "east_group"):
            choose_group(layout, properties, name)
    layout.prop_search(properties, "image", bpy.data, "images", icon="IMAGE_DATA")
    column = layout.column()
    column.active = bool(properties.image)
    column.prop(properties, "image_layout")
    choose_layer(layout, properties, "uv_layer")
