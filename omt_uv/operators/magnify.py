"""Give a painted region a chosen number of times its share of the texture: uv.omt_magnify."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..session import run
from ..settings import (
    BOUNDARIES,
    DEFAULT_FACTOR,
    DEFAULT_QUALITY,
    DEFAULT_REGION,
    DEFAULT_SOURCE,
    OWN_BOUNDARY,
    QUALITIES,
    REGIONS,
    SOURCES,
    MagnifySettings,
)
from .base import SolverOperator, complaints, read_writable, warn, write_layers
from .properties import MarginSettings, choose_attribute, choose_group, draw_margin


class UV_OT_omt_magnify(MarginSettings, SolverOperator, bpy.types.Operator):
    """Give a painted region a chosen number of times its share of the texture, smoothly and without folds"""

    bl_idname = "uv.omt_magnify"
    bl_label = "Magnify"
    bl_options = {"REGISTER", "UNDO", "PRESET"}
    makes_uvs = True

    # Without a hard minimum: what is no factor is refused by name, and not silently made one.
    factor: FloatProperty(
        name="Factor",
        description="How many times its share of the texture the region gets. Below 1 it becomes smaller",
        default=DEFAULT_FACTOR,
        soft_min=0.1,
        soft_max=16.0,
    )
    source: EnumProperty(name="Source", description="What is magnified", items=SOURCES, default=DEFAULT_SOURCE)
    region: EnumProperty(name="Region", description="What marks the region", items=REGIONS, default=DEFAULT_REGION)
    weight_group: StringProperty(
        name="Group",
        description="Vertex group that marks the region with weight 1; saliency or curvature if no group has such a "
        "name. Empty: the active vertex group",
    )
    attribute: StringProperty(
        name="Attribute",
        description="Attribute of floats on vertices or faces that marks the region with 1, or its largest value",
    )
    exact: BoolProperty(
        name="Exact Share",
        description="The region gets exactly the factor times its share of the whole. "
        "Otherwise the factor holds between weight 1 and weight 0, and the share follows; run again, "
        "it multiplies there, but soft weights in between get less than at once",
        default=True,
    )
    boundary: EnumProperty(
        name="Boundary",
        description="Outline of every island",
        items=(OWN_BOUNDARY, *BOUNDARIES),
        default=OWN_BOUNDARY[0],
    )
    cascade: IntProperty(
        name="Times",
        description="How often in a row; twice by 2 is once by 4",
        default=1,
        min=1,
        max=16,
        soft_max=4,
    )
    quality: EnumProperty(
        name="Quality", description="How exact the areas become", items=QUALITIES, default=DEFAULT_QUALITY
    )
    image: StringProperty(
        name="Warp Image",
        description="Image that follows the UVs: a copy is made that looks on the mesh as the old one did. "
        "Only for existing UVs. Empty: none",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> MagnifySettings:
        return MagnifySettings(
            boundary=self.boundary.lower(),
            quality=self.quality.lower(),
            margin=self.margin,
            texture_size=self.texture_size,
            tile=self.tile,
            factor=self.factor,
            exact=self.exact,
            source=self.source.lower(),
            cascade=self.cascade,
        )

    def steps(self, context: bpy.types.Context):
        from ..files import images
        from ..pipelines.magnify import Region, magnify, warped_picture

        objects, readings = read_writable(context)
        with complaints(objects=objects):
            picture = images.pixels_of(images.named(self.image)) if self.image and self.source == "UV" else None
            weights, warnings = self._weights(context, list(zip(objects, readings, strict=True)))
            regions = [
                Region(r.surface, r.faces, w.values, r.all_pins, w.kind, r.up)
                for r, w in zip(readings, weights, strict=True)
            ]
            result = yield from run.aside(magnify(regions, self.settings()))
        if picture is not None:
            straight = images.has_straight_alpha(images.named(self.image))
            picture = warped_picture(picture, regions, result, self.margin, straight)
        return objects, replace(result, warnings=[*warnings, *result.warnings]), picture

    def _weights(self, context: bpy.types.Context, pairs):
        """Weights of each object, and warnings. Raises GroupError, Refusal."""
        from ..blender.weights import Weights, attribute_weights, region_weights

        if self.region == "ATTRIBUTE":
            return attribute_weights(pairs, self.attribute)
        return [Weights(w) for w in region_weights(pairs, self.weight_group or _active_group(context))], []

    def finish(self, context: bpy.types.Context, result) -> None:
        from ..files import images

        objects, magnified, picture = result
        write_layers(objects, "", magnified)
        shares = magnified.shares
        worst = max((island["area_l1"] for mine in magnified.reports for island in mine), default=0.0)
        self.said = (
            ("Region before", f"{100 * shares.before:.3f} %"),
            ("Region asked", f"{100 * shares.target:.3f} %"),
            ("Region now", f"{100 * shares.after:.3f} %"),
            ("Area error", f"{100 * worst:.2f} %"),
        )
        warn(self, objects, magnified.warnings)
        text = shares.text()
        if picture is not None:
            warped = images.packed_image(f"{self.image} warped", picture, images.named(self.image))
            text += f"; the warped image is {warped.name!r}"
        self.report({"INFO"}, text)


def _active_group(context: bpy.types.Context) -> str:
    obj = context.view_layer.objects.active
    group = obj.vertex_groups.active if obj is not None and obj.type == "MESH" else None
    return group.name if group is not None else ""


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator that count as others stand, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "factor")
    layout.prop(properties, "region")
    if properties.region == "ATTRIBUTE":
        choose_attribute(layout, properties, "attribute")
    else:
        choose_group(layout, properties, "weight_group")
    layout.prop(properties, "exact")
    layout.prop(properties, "source")
    layout.prop(properties, "boundary")
    layout.prop(properties, "cascade")
    layout.prop(properties, "quality")
    if properties.source == "UV":
        layout.prop_search(properties, "image", bpy.data, "images", icon="IMAGE_DATA")
    draw_margin(layout, properties)
