"""Let UVs follow the slider and their pins while these are being dragged: uv.omt_live, and uv.omt_live_end."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..display import overlay
from ..session import following, last_run
from ..session.run import Disturbed
from ..settings import Settings
from .base import Complaint, check_all_local, complaints, figures_of, mesh_objects, read_objects, ready, tell

if TYPE_CHECKING:
    from ..session.live import Session

UNWRAP = "uv.omt_unwrap"
HINT = "Live Balance: drag the slider, or pins      Enter: Accept      Esc: Back to what was before"
# Seconds between two looks at the figures and the hint.
LOOK_EVERY = 0.4
# What an artist does during a session: its steps of undo end nothing.
BELONGS = ("TRANSFORM_OT_", "VIEW", "UV_OT_pin", "UV_OT_select", "MESH_OT_select", "UV_OT_omt_live", "SCREEN_OT_")
# Keys that do nothing by themselves.
MODIFIERS = {"LEFT_CTRL", "RIGHT_CTRL", "LEFT_SHIFT", "RIGHT_SHIFT", "LEFT_ALT", "RIGHT_ALT", "OSKEY"}
PINS = (
    ("HARD", "Hard", "Pins stay exactly where they are put; the island stretches between them", "PINNED", 0),
    ("SOFT", "Soft", "The island follows its pins as a whole, and they give way to its shape", "UNPINNED", 1),
)
ENDS = (
    ("KEEP", "Accept", "Keep the UVs as they are now"),
    ("BACK", "Cancel", "Have the UVs back as they were before"),
)


class UV_OT_omt_live(bpy.types.Operator):
    """Let the UVs follow the slider from area to angle, and pins that are dragged in the UV editor.
    Accept or Enter keeps the result, as any other operator does that is started; Esc gives the UVs back as they were"""

    bl_idname = "uv.omt_live"
    bl_label = "Live Balance"
    bl_options = {"REGISTER", "UNDO"}

    pins: EnumProperty(name="Pins", description="Whether pins hold or give way", items=PINS, default="HARD")
    pack: BoolProperty(
        name="Pack on Accept",
        description="Pack the islands again at the end, where all of them have followed and none is pinned",
        default=True,
    )

    _timer: bpy.types.Timer | None = None
    _looked = 0.0
    # The last operator that was run, as Blender lists them: its list is cut at the front, and does not grow for ever.
    _last = 0
    # Whether UVs have moved since the last step of undo.
    _unmarked = False
    _marks = 0
    # Whether UVs have moved since the figures were looked at: the last ones that move are those that stay.
    _unseen = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return following.current is not None or ready(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if following.current is not None:
            # The session sees it at its next tick, and ends.
            following.current.is_on = False
            return {"CANCELLED"}
        state = self.begin(context)
        if "RUNNING_MODAL" in state and not bpy.app.background:
            self._timer = context.window_manager.event_timer_add(0.02, window=context.window)
            context.window_manager.modal_handler_add(self)
        return state

    def execute(self, context: bpy.types.Context) -> set[str]:
        """For scripts and the redo panel: follow until nothing moves."""
        following.keep(context)
        state = self.begin(context)
        while "RUNNING_MODAL" in state:
            if not self._tick(context):
                return self._end(context, {"FINISHED"})
        return state

    def begin(self, context: bpy.types.Context) -> set[str]:
        from ..session.live import Session

        try:
            pairs = check_all_local(_read_touched(context))
            last = context.window_manager.operator_properties_last(UNWRAP)
            with complaints(objects=[obj for obj, _ in pairs]):
                session = Session(context, pairs, self.pins == "SOFT", last.use_subdivision)
        except Complaint as complaint:
            return tell(self, context, complaint)
        self._last, self._looked = _last_of(context), 0.0
        self._unmarked, self._marks, self._unseen = False, 0, False
        following.begin(session, self._keep)
        last_run.redraw(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        session = following.current
        if session is None:
            # Whoever ended it made its step of undo.
            return self._end(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            return self._back(context)
        if event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return self._accept(context)
        if event.type != "TIMER":
            self._mark_before(event)
            return {"PASS_THROUGH"}
        if self._others_began(context):
            # Before another step of ours: the UVs stay as the other one left them, and its step of undo has them.
            return self._end(context, {"CANCELLED"})
        try:
            self._tick(context)
        except Disturbed as reason:
            self.report({"INFO"}, f"Live Balance ended: {reason}. What is there is kept")
            return self._end(context, {"FINISHED"})
        if session.is_on:
            return {"PASS_THROUGH"}
        return self._back(context) if session.goes_back else self._accept(context)

    def cancel(self, context: bpy.types.Context) -> None:
        self._end(context, {"CANCELLED"})

    def _back(self, context: bpy.types.Context) -> set[str]:
        """Have the UVs back as they were."""
        if following.current is not None:
            following.current.restore()
        # What was marked on the way is in the history: what is back belongs behind it.
        return self._end(context, {"FINISHED"} if self._marks else {"CANCELLED"})

    def _accept(self, context: bpy.types.Context) -> set[str]:
        """Keep what is there, packed."""
        session = following.current
        if session is not None and self.pack:
            last = context.window_manager.operator_properties_last(UNWRAP)
            try:
                with complaints():
                    chosen = ("margin", "texture_size", "tile", "turn_to_fit")
                    session.pack(Settings(**{name: getattr(last, name) for name in chosen}))
            except Complaint as complaint:
                self.report({"WARNING"}, str(complaint))
        return self._end(context, {"FINISHED"})

    def _keep(self, context: bpy.types.Context) -> None:
        """Another operator begins: its step of undo comes behind ours."""
        following.end()
        if not bpy.app.background:
            bpy.ops.ed.undo_push(message=self.bl_label)

    def _mark_before(self, event: bpy.types.Event) -> None:
        """A step of undo before a key or button does something: what has followed until then is not undone with it."""
        if event.value == "PRESS" and event.type not in MODIFIERS and self._unmarked:
            bpy.ops.ed.undo_push(message=self.bl_label)
            self._unmarked, self._marks = False, self._marks + 1

    def _others_began(self, context: bpy.types.Context) -> bool:
        """Whether an operator has been run that is no part of this."""
        done = context.window_manager.operators
        new = []
        for k in range(len(done) - 1, -1, -1):
            if done[k].as_pointer() == self._last:
                break
            new.append(done[k].bl_idname)
        self._last = _last_of(context)
        return any(not name.startswith(BELONGS) for name in new)

    def _tick(self, context: bpy.types.Context) -> bool:
        balance = context.window_manager.operator_properties_last(UNWRAP).balance
        session = following.current
        moved = session is not None and session.follow(balance)
        self._unmarked |= moved
        self._unseen |= moved
        if session is not None and time.monotonic() - self._looked > LOOK_EVERY:
            self._looked = time.monotonic()
            if self._unseen or last_run.state.summary is None or last_run.state.summary.title != self.bl_label:
                self._unseen = False
                self._show_now(context, session)
            if not bpy.app.background and context.workspace is not None:
                # Other hints take its place after a drag.
                context.workspace.status_text_set(HINT)
        if moved:
            overlay.redraw(context)
        return moved

    def _show_now(self, context: bpy.types.Context, session: Session) -> None:
        """The figures as they are at this moment."""
        found = last_run.rows_of(session.figures())
        names = tuple(obj.name for obj in session.objects)
        last_run.state.summary = last_run.Summary(self.bl_label, found.rows, (), names, found.beyond)
        last_run.state.outdated = ""
        last_run.state.marks.clear()
        last_run.redraw(context)

    def _end(self, context: bpy.types.Context, state: set[str]) -> set[str]:
        following.end()
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        _show_figures(self.bl_label, context)
        return state


class UV_OT_omt_live_end(bpy.types.Operator):
    """End Live Balance"""

    bl_idname = "uv.omt_live_end"
    bl_label = "End Live Balance"
    bl_options = {"INTERNAL"}

    end: EnumProperty(name="End", description="What becomes of the UVs", items=ENDS, default="KEEP")

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return following.current is not None

    @classmethod
    def description(cls, _context, properties) -> str:
        return next(text for name, _, text in ENDS if name == properties.end)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        session = following.current
        if session is not None:
            # The session sees it at its next tick, packs or gives back, and ends.
            session.is_on, session.goes_back = False, self.end == "BACK"
        return {"FINISHED"}


def _last_of(context: bpy.types.Context) -> int:
    """The operator that was run last, by its address; 0 if there was none."""
    done = context.window_manager.operators
    return done[-1].as_pointer() if len(done) else 0


def _read_touched(context: bpy.types.Context) -> list:
    """Pairs of object and Reading; in Edit Mode a selected vertex stands for its faces where no face is selected."""
    from ..blender.mesh import read, touched_faces

    if context.mode != "EDIT_MESH":
        return read_objects(context)
    found = []
    for obj in mesh_objects(context):
        with complaints(obj):
            reading = read(obj)
            faces = reading.faces if reading.faces.any() else touched_faces(obj)
            found.append((obj, replace(reading, faces=faces)))
    found = [(obj, reading) for obj, reading in found if reading.faces.any()]
    return found or read_objects(context)


def _show_figures(title: str, context: bpy.types.Context) -> None:
    """Bring the panel and the colours up to date."""
    try:
        pairs = _read_touched(context)
    except Complaint:
        # The objects are gone, or nothing is selected any more: there is nothing to show.
        return
    found = figures_of(context, [reading for _, reading in pairs])
    names = tuple(obj.name for obj, _ in pairs)
    last_run.keep(last_run.Summary(title, found.rows, (), names, found.beyond))
    if found.rows:
        overlay.refresh(context, pairs)
