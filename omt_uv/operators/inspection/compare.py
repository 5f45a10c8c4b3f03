"""Show the original in place of the remeshed object, and the next level in place of that: object.omt_compare."""

from __future__ import annotations

import bpy

from ...session.language import counted
from ..base import Complaint, QuickOperator, mesh_objects


class OBJECT_OT_omt_compare(QuickOperator, bpy.types.Operator):
    """Show the original in place of the new mesh, then its levels one after the other, the finest first"""

    bl_idname = "object.omt_compare"
    bl_label = "Compare Remesh"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.mode == "OBJECT"

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.remesh_objects import family

        active = context.view_layer.objects.active
        obj = active if active is not None and active.type == "MESH" else mesh_objects(context)[0]
        layer = context.view_layer.objects
        kin = [each for each in family(obj) if each.name in layer]
        if len(kin) < 2:
            raise Complaint(f"{obj.name}: There is nothing to compare it with. Remesh it first.")
        shown = next((k for k, each in enumerate(kin) if each == obj), 0)
        following = kin[(shown + 1) % len(kin)]
        for each in kin:
            each.hide_set(each != following)
            each.select_set(each == following)
        layer.active = following
        self.report({"INFO"}, f"{following.name}: {counted(len(following.data.vertices), '{} vertex', '{} vertices')}")
