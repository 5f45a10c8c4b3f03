"""Settings that several operators share, said once."""

from __future__ import annotations

from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..settings import DEFAULT_BALANCE, DEFAULT_MARGIN, DEFAULT_QUALITY, DEFAULT_TEXTURE_SIZE, QUALITIES


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
    texture_size: IntProperty(
        name="Texture Size",
        description="Width of the texture that the margin is measured in",
        default=DEFAULT_TEXTURE_SIZE,
        min=16,
        max=65536,
        soft_max=8192,
        subtype="PIXEL",
    )
