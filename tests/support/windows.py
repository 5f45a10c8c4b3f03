"""A stand-in for Blender's window: what operators and panels ask of it is written down."""

from __future__ import annotations

import inspect
import itertools
import sys
from types import SimpleNamespace

import bpy


class Instead:
    """Something of Blender's with a few attributes that are others; `real` is asked for each time, as files are loaded
    meanwhile."""

    def __init__(self, real, **others):
        self.__dict__.update(real=real, **others)

    def __getattr__(self, name):
        return getattr(self.real(), name)


class Window(Instead):
    """A context with a window in it: timers that are on, who hears events, the hint in the status bar, menus shown."""

    def __init__(self, area="IMAGE_EDITOR", **others):
        super().__init__(lambda: bpy.context, timers=[], listeners=[], hints=[None], menus=[], redrawn=[])
        self.__dict__["window"] = window = SimpleNamespace(name="the window")
        self.__dict__["window_manager"] = Instead(
            lambda: bpy.context.window_manager,
            event_timer_add=lambda seconds, window: self.timers.append((seconds, window)) or self.timers[-1],
            event_timer_remove=self.timers.remove,
            modal_handler_add=self.listeners.append,
            popup_menu=lambda draw, title, icon: self.menus.append((draw, title)),
            clipboard="",
        )
        self.__dict__["workspace"] = Instead(lambda: bpy.context.workspace, status_text_set=self.hints.append)
        view = SimpleNamespace(tag_redraw=lambda: self.redrawn.append(area), type=area)
        self.__dict__.update({"area": view, "region_data": object(), "region": SimpleNamespace(type="WINDOW")} | others)
        assert window is self.window


def in_front(monkeypatch, package) -> None:
    """Let operators take Blender for one with a window."""
    root = package("operators").__name__
    there = Instead(lambda: bpy, app=Instead(lambda: bpy.app, background=False))
    for name, module in list(sys.modules.items()):
        if name.startswith(root) and getattr(module, "bpy", None) is bpy:
            monkeypatch.setattr(module, "bpy", there)


def in_single_steps(monkeypatch, package) -> None:
    """Let a slice of a run, and of what follows a slider, be one step of it, and figures be shown after each: no clock
    decides what comes of it. Both may be watched by `recorded_calls`."""
    run, live = package("session.run"), package("session.live")
    for function in (run.Run.advance, live.Session.follow):
        monkeypatch.setattr(inspect.unwrap(function), "__defaults__", (0.0,))
    monkeypatch.setattr(run, "threads", False)
    # What the queue takes, too.
    monkeypatch.setattr(run, "SLICE", 0.0)
    monkeypatch.setattr(package("operators.live"), "LOOK_EVERY", -1.0)
    # A queue looks at the clock before each step: every second time its slice is over.
    ticks = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: 0.6 * run.SLICE * next(ticks))
    monkeypatch.setattr(package("operators.arranging.queue"), "time", clock)


def event(kind, value="PRESS", at=(0, 0)):
    """A key, a button, a move of the mouse, or a tick of a timer."""
    return SimpleNamespace(type=kind, value=value, mouse_region_x=at[0], mouse_region_y=at[1])
