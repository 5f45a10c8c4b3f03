"""Give a painted region a chosen number of times its share of the texture: uv.omt_magnify."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ..session import run
from ..session.region_list import NAME as REGION_LIST
from ..session.region_list import pairs_of, rows_of
from ..settings import (
    AUTO_SOURCE,
    BOUNDARIES,
    CONTEXT,
    DEFAULT_BALANCE,
    DEFAULT_FACTOR,
    DEFAULT_MAGNIFIED_SHEAR,
    DEFAULT_QUALITY,
    DEFAULT_REGION,
    OWN_BOUNDARY,
    QUALITIES,
    REGIONS,
    SOURCES,
    MagnifySettings,
)
from .base import SolverOperator, complaints, read_writable, warn, write_layers
from .properties import MarginSettings, SubdivisionSettings, choose_attribute, choose_group, draw_margin, shear_bound


class UV_OT_omt_magnify(SubdivisionSettings, MarginSettings, SolverOperator, bpy.types.Operator):
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
    source: EnumProperty(name="Source", description="What is magnified", items=(AUTO_SOURCE, *SOURCES), default="AUTO")
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
    further: StringProperty(
        name="Further Regions",
        description="Vertex groups that get factors of their own at the same time, such as: eyes=3, mouth=1.5. "
        "All shares are exact together. Empty: those of the list that the active object keeps",
        # The list stands in the panel, and what a script gave once shall not stand above it.
        options={"SKIP_SAVE"},
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
    balance: FloatProperty(
        name="Balance",
        description="From 0, exact areas, to 1, least shear, where UVs are made anew. The share of the region is exact "
        "at 0 alone",
        default=DEFAULT_BALANCE,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    max_shear: FloatProperty(
        name="Max Shear",
        description="Where UVs are made anew, seams are added until the mean shear of islands is below this. "
        "0: only those that are needed to open a part. Islands whose seams you marked are left as they are",
        default=DEFAULT_MAGNIFIED_SHEAR,
        min=0.0,
        soft_max=3.0,
    )
    use_image: BoolProperty(
        name="Show Warped Image",
        description="Let the materials of the objects show the warped image in place of the old one",
        default=True,
    )
    detail: StringProperty(
        name="Detail Image",
        description="Image of higher resolution that is laid over what is magnified. Empty: none",
    )
    detail_box: FloatVectorProperty(
        name="Detail Box",
        description="Lower left and upper right corner of what the detail image shows, in the old UVs. "
        "Without an area: the box of the region",
        size=4,
        default=(0.0, 0.0, 0.0, 0.0),
    )
    image_size: IntProperty(
        name="Image Width",
        description="Pixels of the warped image along its width. 0: as the old one",
        default=0,
        min=0,
        max=65536,
        subtype="PIXEL",
    )
    image: StringProperty(
        name="Warp Image",
        description="Image that follows the UVs: a copy is made that looks on the mesh as the old one did. "
        "Only for existing UVs. Empty: none",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self, listed=False)

    def settings(self, source: str) -> MagnifySettings:
        return MagnifySettings(
            boundary=self.boundary.lower(),
            quality=self.quality.lower(),
            margin=self.margin,
            texture_size=self.texture_size,
            tile=self.tile,
            factor=self.factor,
            exact=self.exact,
            source=source,
            balance=self.balance if source == "mesh" else 0.0,
            max_shear=shear_bound(self.max_shear),
            cascade=self.cascade,
        )

    def steps(self, context: bpy.types.Context):
        from ..files import images
        from ..pipelines.magnify import Region, magnify, warped_picture
        from ..pipelines.regions.several import magnify_several

        objects, readings = read_writable(context)
        with complaints(objects=objects):
            source = self.source.lower()
            if source == "auto":
                source = "uv" if all(reading.uv is not None for reading in readings) else "mesh"
            picture = images.pixels_of(images.named(self.image)) if self.image and source == "uv" else None
            pairs = list(zip(objects, readings, strict=True))
            weights, warnings = self._weights(context, pairs)
            regions = [
                Region(r.surface, r.faces, w.values, r.all_pins, w.kind, r.axes, modifier)
                for r, w, modifier in zip(readings, weights, self.subdivisions(readings), strict=True)
            ]
            several = self._further(pairs, regions, self._factors(context))
            settings = self.settings(source)
            steps = magnify_several(several, settings) if len(several) > 1 else magnify(regions, settings)
            result = yield from run.aside(steps)
            if picture is not None and (self.detail or self.image_size):
                picture = self._detailed(picture, regions, result)
            elif picture is not None:
                straight = images.has_straight_alpha(images.named(self.image))
                picture = warped_picture(picture, regions, result, self.margin, straight)
        return objects, replace(result, warnings=[*warnings, *result.warnings]), picture

    def _weights(self, context: bpy.types.Context, pairs):
        """Weights of each object, and warnings. Raises GroupError, Refusal."""
        from ..blender.weights import Weights, attribute_weights, region_weights

        if self.region == "ATTRIBUTE":
            return attribute_weights(pairs, self.attribute)
        return [Weights(w) for w in region_weights(pairs, self.weight_group or _active_group(context))], []

    def _detailed(self, picture, regions, result):
        """The warped picture with the detail laid over its box. Raises GroupError."""
        from ..blender.vertex_groups import GroupError
        from ..files import images
        from ..pipelines.regions.detail import box_of, detailed_picture
        from ..solver.editing.inset_images import InsetImage

        height, width = picture.shape[:2]
        wide = self.image_size or width
        insets = []
        if self.detail:
            low, high = tuple(self.detail_box[:2]), tuple(self.detail_box[2:])
            box = (low, high) if high[0] > low[0] and high[1] > low[1] else box_of(regions)
            if box is None:
                raise GroupError("Detail Image: No face with UVs is in the region. Paint it, or give the box.")
            insets.append(InsetImage(images.pixels_of(images.named(self.detail)), *box))
        size = (max(1, round(height * wide / width)), wide)
        return detailed_picture(picture, regions, result, insets, size, self.margin)

    def _factors(self, context: bpy.types.Context) -> list[tuple[str, float]]:
        """Pairs of group and factor of *Further Regions*. Raises GroupError."""
        from ..blender.vertex_groups import GroupError
        from ..pipelines.regions.several import region_factors

        texts = [text for text in self.further.split(",") if text.strip()]
        try:
            return region_factors(texts) if texts else pairs_of(context.view_layer.objects.active)
        except ValueError as error:
            raise GroupError(f"Further Regions: {str(error).rstrip('.')}.") from error

    def _further(self, pairs, regions, factors: list[tuple[str, float]]) -> list:
        """The region, and others with factors of their own. Raises GroupError."""
        from dataclasses import replace as changed

        from ..blender.vertex_groups import GroupError
        from ..blender.weights import region_weights
        from ..pipelines.regions.several import NamedRegion

        group = "" if self.region == "ATTRIBUTE" else self.weight_group or _active_group(bpy.context)
        if group and group in dict(factors):
            raise GroupError(f"Further Regions: {group!r} is the region itself, whose factor stands above.")
        found = [NamedRegion(group or self.attribute or "Region", self.factor, tuple(regions))]
        for name, factor in factors:
            weights = region_weights(pairs, name)
            parts = [changed(r, weights=w, kind="vertex") for r, w in zip(regions, weights, strict=True)]
            found.append(NamedRegion(name, factor, tuple(parts)))
        return found

    def finish(self, context: bpy.types.Context, result) -> None:
        from ..files import images

        objects, magnified, picture = result
        write_layers(objects, "", magnified)
        shares = magnified.shares
        worst = max((island["area_l1"] for mine in magnified.reports for island in mine), default=0.0)
        self.said = (*shares.said(), ("Area error", f"{100 * worst:.2f} %"))
        warn(self, objects, [*magnified.warnings, *_beyond(objects, magnified)])
        text = shares.text()
        if picture is not None:
            old = images.named(self.image)
            warped = images.packed_image(f"{self.image} warped", picture, old)
            text += f"; the warped image is {warped.name!r}"
            if self.use_image:
                _show_image(objects, old, warped)
        self.report({"INFO"}, text)


def _beyond(objects: list, magnified) -> list[tuple[int, str]]:
    """A warning for each object whose UVs have left the tile that they were in."""
    from ..pipelines.texel_density import beyond_tile

    found = []
    for k, (corners, uv) in enumerate(zip(magnified.corners, magnified.uv, strict=True)):
        far = beyond_tile(uv) if len(corners) else 0.0
        if far > 0:
            found.append((k, f"UVs reach {far:.3f} beyond their tile; use Pack Islands, or a smaller factor"))
    return found


def _show_image(objects: list, old: bpy.types.Image, new: bpy.types.Image) -> None:
    """Let texture nodes of the objects' materials that show one image show another."""
    materials = {slot.material for obj in objects for slot in obj.material_slots if slot.material is not None}
    for material in materials:
        for node in material.node_tree.nodes if material.node_tree is not None else ():
            if node.type == "TEX_IMAGE" and node.image == old:
                node.image = new


def _active_group(context: bpy.types.Context) -> str:
    obj = context.view_layer.objects.active
    group = obj.vertex_groups.active if obj is not None and obj.type == "MESH" else None
    return group.name if group is not None else ""


def draw_settings(layout: bpy.types.UILayout, properties, listed: bool = True) -> None:
    """The settings of the operator that count as others stand; further regions as the list that the object keeps, or
    as text."""
    draw_main(layout, properties)
    layout.separator()
    draw_more(layout, properties, listed)
    layout.separator()
    draw_image(layout, properties)


def draw_main(layout: bpy.types.UILayout, properties) -> None:
    """Which region, how large, and in which UVs."""
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
    layout.prop(properties, "quality")


def draw_more(layout: bpy.types.UILayout, properties, listed: bool = True) -> None:
    """Other regions at the same time, and how islands are made and packed."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    if listed:
        _draw_list(layout, bpy.context.object)
    else:
        # Its whole name is cut off in a narrow sidebar.
        layout.prop(properties, "further", text="More Regions")
    layout.prop(properties, "cascade")
    layout.prop(properties, "boundary", text="Boundary", text_ctxt=CONTEXT)
    column = layout.column()
    column.active = properties.source != "UV"
    column.prop(properties, "balance", text="Area - Angle", slider=True)
    column.prop(properties, "max_shear")
    column.prop(properties, "use_subdivision", text="Subdivision")
    draw_margin(layout, properties)
    layout.prop(properties, "tile")


def _draw_list(layout: bpy.types.UILayout, obj: bpy.types.Object | None) -> None:
    """The list of further regions of an object."""
    if obj is None or obj.type != "MESH" or not hasattr(obj, REGION_LIST):
        return
    found = rows_of(obj)
    layout.label(text="Further Regions")
    row = layout.row()
    lines = 3 if found.rows else 1
    row.template_list("UV_UL_omt_regions", "", found, "rows", found, "active", rows=lines, maxrows=6)
    column = row.column(align=True)
    column.operator("uv.omt_region_add", text="", icon="ADD")
    column.operator("uv.omt_region_remove", text="", icon="REMOVE")


def draw_image(layout: bpy.types.UILayout, properties) -> None:
    """The image that follows UVs that exist."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    if properties.source == "MESH":
        return
    layout.prop_search(properties, "image", bpy.data, "images", icon="IMAGE_DATA")
    column = layout.column()
    column.active = bool(properties.image)
    column.prop(properties, "use_image", text="Show Warped")
    column.prop(properties, "image_size")
    column.prop_search(properties, "detail", bpy.data, "images", icon="IMAGE_DATA")
    column.prop(properties, "detail_box")
