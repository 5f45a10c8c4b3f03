"""Regions with factors of their own, as a list that an object keeps: saved with it, and undone as all that it holds."""

from __future__ import annotations

import bpy
from bpy.props import CollectionProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..errors import UserError
from ..settings import DEFAULT_FACTOR

# The property of objects that holds the list.
NAME = "omt_uv_regions"


class RegionListError(UserError):
    """A row of the list that is no region."""


class OMTUVRegion(bpy.types.PropertyGroup):
    """A vertex group and its factor."""

    group: StringProperty(name="Group", description="Vertex group that is magnified by a factor of its own")
    factor: FloatProperty(
        name="Factor",
        description="How many times its share of the texture the region gets. Below 1 it becomes smaller",
        default=DEFAULT_FACTOR,
        soft_min=0.1,
        soft_max=16.0,
    )


class OMTUVRegionList(bpy.types.PropertyGroup):
    """The regions of an object, and which of them is chosen."""

    rows: CollectionProperty(type=OMTUVRegion)
    active: IntProperty(name="Region", description="The region that is chosen", default=0)


def rows_of(obj: bpy.types.Object) -> OMTUVRegionList:
    """The list of an object."""
    return getattr(obj, NAME)


def pairs_of(obj: bpy.types.Object | None) -> list[tuple[str, float]]:
    """Pairs of group and factor of an object's list.

    Raises
    ------
    RegionListError : a row names no group, or two name one
    """
    # A program that runs commands registers no lists.
    rows = rows_of(obj).rows if obj is not None and hasattr(obj, NAME) else ()
    pairs = [(row.group, row.factor) for row in rows]
    for k, (name, _) in enumerate(pairs):
        if not name:
            raise RegionListError(f"Row {k + 1} names no vertex group. Choose one, or remove the row.")
        if name in dict(pairs[:k]):
            raise RegionListError(f"{name!r} stands in the list twice. Remove one of the rows.")
    return pairs


def register_list() -> None:
    """Let objects have the list; its classes are registered."""
    setattr(bpy.types.Object, NAME, PointerProperty(type=OMTUVRegionList))


def unregister_list(_=None) -> None:
    delattr(bpy.types.Object, NAME)
