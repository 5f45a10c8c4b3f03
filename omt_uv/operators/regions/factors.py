"""Edit the list of regions with factors of their own: uv.omt_region_add, uv.omt_region_remove."""

from __future__ import annotations

import bpy

from ...session.region_list import rows_of
from ..base import Complaint, QuickOperator, check_all_local


class UV_OT_omt_region_add(QuickOperator, bpy.types.Operator):
    """Add a vertex group with a factor of its own, which is magnified at the same time"""

    bl_idname = "uv.omt_region_add"
    bl_label = "Add Region"
    bl_options = {"UNDO", "INTERNAL"}
    modes = ("OBJECT", "EDIT_MESH", "PAINT_WEIGHT")

    def act(self, context: bpy.types.Context) -> None:
        found = _listed(context)
        named = {row.group for row in found.rows}
        free = [group.name for group in context.object.vertex_groups if group.name not in named]
        active = context.object.vertex_groups.active
        row = found.rows.add()
        # The active group is the first region, unless another one is named.
        others = [name for name in free if active is None or name != active.name]
        row.group = next(iter(others or free), "")
        found.active = len(found.rows) - 1


class UV_OT_omt_region_remove(QuickOperator, bpy.types.Operator):
    """Take the chosen region off the list"""

    bl_idname = "uv.omt_region_remove"
    bl_label = "Remove Region"
    bl_options = {"UNDO", "INTERNAL"}
    modes = ("OBJECT", "EDIT_MESH", "PAINT_WEIGHT")

    def act(self, context: bpy.types.Context) -> None:
        found = _listed(context)
        if not found.rows:
            raise Complaint(f"{context.object.name}: There are no further regions. Add one first.")
        found.rows.remove(min(max(found.active, 0), len(found.rows) - 1))
        found.active = max(0, min(found.active, len(found.rows) - 1))


def _listed(context: bpy.types.Context):
    """The list of the active object. Raises Complaint where it is no mesh, or would not be saved."""
    obj = context.object
    if obj is None or obj.type != "MESH":
        raise Complaint("The active object is no mesh. Select one.")
    check_all_local([(obj, None)])
    return rows_of(obj)
