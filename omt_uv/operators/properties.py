"""Declare and draw the settings that several operators share."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ..settings import (
    CONTEXT,
    DEFAULT_BALANCE,
    DEFAULT_MARGIN,
    DEFAULT_QUALITY,
    DEFAULT_TEXTURE_SIZE,
    FIRST_TILE,
    QUALITIES,
)


class AreaSettings:
    """How exact areas become, and at the price of what shear."""

    balance: FloatProperty(
        name="Balance",
        description="From 0, exact areas, to 1, least shear",
        default=DEFAULT_BALANCE,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    quality: EnumProperty(
        name="Quality", description="How exact the areas become", items=QUALITIES, default=DEFAULT_QUALITY
    )


def shear_bound(chosen: float) -> float:
    """The bound of the shear that a property asks for, 0 for none: nothing shears less than 1."""
    return chosen if chosen > 1 else 0.0


class SubdivisionSettings:
    """Whether what counts is the mesh, or the surface that its modifier makes of it."""

    use_subdivision: BoolProperty(
        name="Use Subdivision Surface",
        description="Where an object has a Subdivision Surface modifier, keep the areas of the subdivided surface, "
        "as it is rendered, instead of those of the mesh",
        default=True,
    )

    def subdivisions(self, readings: list) -> list:
        """The modifiers of readings that count, None for each that does not."""
        return [reading.subdivision if self.use_subdivision else None for reading in readings]


class MarginSettings:
    """How far apart islands are packed."""

    margin: IntProperty(
        name="Margin",
        description="Least distance between islands, in pixels of the texture",
        default=DEFAULT_MARGIN,
        min=0,
        max=1024,
        soft_max=64,
        subtype="PIXEL",
    )
    tile: IntProperty(
        name="UDIM Tile",
        description="Tile that the islands are packed into. 1001 is the unit square, 1002 the one to its right",
        default=FIRST_TILE,
        min=FIRST_TILE,
        max=1999,
        soft_max=1100,
    )
    texture_size: IntProperty(
        name="Texture Size",
        description="Width of the texture that the margin and the texel density are measured in",
        default=DEFAULT_TEXTURE_SIZE,
        min=16,
        max=65536,
        soft_max=8192,
        subtype="PIXEL",
    )


def draw_balance(layout: bpy.types.UILayout, properties) -> None:
    """The slider, as wide as the panel: left for area, right for angles."""
    row = layout.row()
    row.use_property_split = False
    row.prop(properties, "balance", text="Area - Angle", slider=True)


def draw_margin(layout: bpy.types.UILayout, properties, packed: bool = True) -> None:
    """The margin, which counts where islands are packed, and the texture, which always does."""
    column = layout.column()
    column.active = packed
    column.prop(properties, "margin", text="Margin", text_ctxt=CONTEXT)
    layout.prop(properties, "texture_size")


def choose_group(layout: bpy.types.UILayout, properties, name: str) -> None:
    """A field for the name of a vertex group, with those of the active object to choose from."""
    _choose(layout, properties, name, "vertex_groups", "GROUP_VERTEX")


def choose_layer(layout: bpy.types.UILayout, properties, name: str) -> None:
    """A field for the name of a UV map, with those of the active mesh to choose from."""
    _choose(layout, properties, name, "uv_layers", "GROUP_UVS")


def choose_attribute(layout: bpy.types.UILayout, properties, name: str) -> None:
    """A field for the name of an attribute, with those of the active mesh to choose from."""
    _choose(layout, properties, name, "attributes", "SPREADSHEET")


def _choose(layout: bpy.types.UILayout, properties, name: str, collection: str, icon: str) -> None:
    obj = bpy.context.object
    if obj is None or obj.type != "MESH":
        layout.prop(properties, name)
        return
    owner = obj if hasattr(obj, collection) else obj.data
    chosen = getattr(properties, name)
    if chosen and chosen not in getattr(owner, collection):
        # A name about to be made, or of other objects: a search field would show it in red, as if it were wrong.
        layout.prop(properties, name, icon=icon)
        return
    layout.prop_search(properties, name, owner, collection, icon=icon)
