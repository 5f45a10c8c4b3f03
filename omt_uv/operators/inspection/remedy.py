"""Do what a warning or a refusal advises, by one click: uv.omt_remedy; page through them: uv.omt_notices."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty

from ...remedies import ACTIONS
from ...session import last_run
from ...session.language import counted, words
from ..base import Complaint, QuickOperator, check_all_local, complaints

UNWRAP = "uv.omt_unwrap"


class UV_OT_omt_remedy(QuickOperator, bpy.types.Operator):
    """Do what the result advises, on the objects that it is about"""

    bl_idname = "uv.omt_remedy"
    bl_label = "OMT Remedy"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    action: EnumProperty(name="Action", description="What is done", items=ACTIONS, default="MERGE")

    @classmethod
    def description(cls, _context, properties) -> str:
        return next(text for name, _, text in ACTIONS if name == properties.action)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if self.action != "CUT_FURTHER":
            return self.execute(context)
        # A run in the window like any other, with its own step of undo.
        bpy.ops.uv.omt_unwrap("INVOKE_DEFAULT", cut_further=True)
        return {"CANCELLED"}

    def act(self, context: bpy.types.Context) -> None:
        from ...blender import clean, subdivision

        if self.action == "CUT_FURTHER":
            bpy.ops.uv.omt_unwrap("EXEC_DEFAULT", cut_further=True)
            return
        mend = {
            "NORMALS": clean.turn_outside,
            "MERGE": clean.merge,
            "DISSOLVE": clean.dissolve,
            "APPLY_LEVEL": subdivision.apply_level,
        }[self.action]
        objects = _objects(context)
        check_all_local([(obj, None) for obj in objects])
        if self.action == "APPLY_LEVEL" and (reason := subdivision.why_not_applied(objects)):
            raise Complaint(reason)
        for obj in objects if self.action in ("NORMALS", "MERGE") else ():
            with complaints(about=obj):
                clean.check_faces(obj)
        count = sum(mend(obj) for obj in objects)
        said = {
            "NORMALS": ("Turned {} face over", "Turned {} faces over"),
            "MERGE": ("Merged {} vertex", "Merged {} vertices"),
            "DISSOLVE": ("Dissolved {} element", "Dissolved {} elements"),
            "APPLY_LEVEL": ("Applied a level of {} modifier", "Applied a level of {} modifiers"),
        }
        self.report({"INFO"}, f"{counted(count, *said[self.action])}. {words('Run it again now')}")


def _objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Those that the result is about, as far as they are in this view layer, one for each mesh."""
    from ...blender.mesh import one_for_each_mesh

    summary = last_run.state.summary
    names = summary.objects if summary is not None else ()
    found = [obj for obj in map(context.view_layer.objects.get, names) if obj is not None and obj.type == "MESH"]
    found = found or last_run.chosen_objects(context)
    if not found:
        raise Complaint("The objects of the last run are gone. Select one or more mesh objects.")
    return one_for_each_mesh(found)


class UV_OT_omt_notices(bpy.types.Operator):
    """Show the warnings of the last run, all of them in full or one after the other"""

    bl_idname = "uv.omt_notices"
    bl_label = "OMT Warnings"
    bl_options = {"INTERNAL"}

    whole: BoolProperty(name="Whole", description="Show all of them in full in a window of their own", default=True)

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return last_run.state.summary is not None and bool(last_run.state.summary.notices)

    def execute(self, context: bpy.types.Context) -> set[str]:
        notices = last_run.state.summary.notices if last_run.state.summary else ()
        if not self.whole:
            last_run.state.shown = (last_run.state.shown + 1) % max(1, len(notices))
            last_run.redraw(context)
            return {"FINISHED"}
        if not bpy.app.background:
            context.window_manager.popup_menu(_draw, title="Warnings", icon="ERROR")
        return {"FINISHED"}


def _draw(menu, _context: bpy.types.Context) -> None:
    summary = last_run.state.summary
    for notice in summary.notices if summary else ():
        for line in last_run.lines(notice.text, 100):
            menu.layout.label(text=line, translate=False)
        menu.layout.separator()
