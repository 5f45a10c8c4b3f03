"""Let UVs follow the slider and their pins while these are being dragged: uv.omt_live."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ..display import overlay
from ..session import last_run
from ..session.run import Disturbed
from .base import Complaint, check_all_local, complaints, figures_of, read_objects, ready, tell

if TYPE_CHECKING:
    from ..session.live import Session

# The session that is on; the panel shows its button pressed.
current: Session | None = None
UNWRAP = "uv.omt_unwrap"


class UV_OT_omt_live(bpy.types.Operator):
    """Let the UVs follow the slider from area to angle, and pins that are dragged in the UV editor.
    Click again or press Enter to keep the result, Esc to have the UVs as they were"""

    bl_idname = "uv.omt_live"
    bl_label = "Live Balance"
    bl_options = {"REGISTER", "UNDO"}

    _timer: bpy.types.Timer | None = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return current is not None or ready(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if current is not None:
            # The session sees it at its next tick, and ends.
            current.is_on = False
            return {"CANCELLED"}
        state = self.start(context)
        if "RUNNING_MODAL" in state and not bpy.app.background:
            self._timer = context.window_manager.event_timer_add(0.02, window=context.window)
            context.window_manager.modal_handler_add(self)
            context.workspace.status_text_set("Live Balance: drag the slider, or pins.      Enter: Keep      Esc: Back")
        return state

    def execute(self, context: bpy.types.Context) -> set[str]:
        """For scripts and the redo panel: follow until nothing moves."""
        state = self.start(context)
        while "RUNNING_MODAL" in state:
            if not self._tick(context):
                return self._end(context, {"FINISHED"})
        return state

    def start(self, context: bpy.types.Context) -> set[str]:
        global current
        from ..session.live import Session

        try:
            pairs = check_all_local(read_objects(context))
            with complaints(objects=[obj for obj, _ in pairs]):
                current = Session(context, pairs)
        except Complaint as complaint:
            return tell(self, context, complaint)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if current is None:
            return self._end(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            current.restore()
            return self._end(context, {"CANCELLED"})
        if event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return self._end(context, {"FINISHED"})
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            self._tick(context)
        except Disturbed as reason:
            self.report({"INFO"}, f"Live Balance ended: {reason}")
            return self._end(context, {"FINISHED"})
        return {"PASS_THROUGH"} if current.is_on else self._end(context, {"FINISHED"})

    def cancel(self, context: bpy.types.Context) -> None:
        self._end(context, {"CANCELLED"})

    def _tick(self, context: bpy.types.Context) -> bool:
        balance = context.window_manager.operator_properties_last(UNWRAP).balance
        moved = current is not None and current.follow(balance)
        if moved:
            for area in (a for w in context.window_manager.windows for a in w.screen.areas):
                if area.type in {"VIEW_3D", "IMAGE_EDITOR"}:
                    area.tag_redraw()
        return moved

    def _end(self, context: bpy.types.Context, state: set[str]) -> set[str]:
        global current
        if current is not None:
            current.close()
            current = None
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        if "FINISHED" in state:
            _show_figures(self.bl_label, context)
        return state


def _show_figures(title: str, context: bpy.types.Context) -> None:
    """Bring the panel and the colours up to date."""
    try:
        pairs = read_objects(context)
    except Complaint:
        # The objects are gone, or nothing is selected any more: there is nothing to show.
        return
    found = figures_of(context, [reading for _, reading in pairs])
    names = tuple(obj.name for obj, _ in pairs)
    last_run.keep(last_run.Summary(title, found.rows, (), names, found.beyond))
    if found.rows:
        overlay.refresh(context, pairs)
