"""Select what an operator has made or found."""

from __future__ import annotations

from collections.abc import Sequence

import bpy


def select_alone(context: bpy.types.Context, objects: Sequence[bpy.types.Object]) -> None:
    """Select these objects and no others, the first one active; those outside of the view layer are left out."""
    for obj in context.selected_objects:
        obj.select_set(False)
    there = [obj for obj in objects if obj.name in context.view_layer.objects]
    for obj in there:
        obj.select_set(True)
    if there:
        context.view_layer.objects.active = there[0]
