"""Run one solver at a time in Blender's window: stepped in slices, watched, and thrown away without a trace.

The operators' base class drives it; the panels look at `current`. What knows nothing of Blender may run on a thread of
its own (`aside`); whatever touches Blender stays in front.
"""

from __future__ import annotations

import gc
import time
from typing import TYPE_CHECKING

import bpy

from .language import stage_words, words

if TYPE_CHECKING:
    from ..solver.progress import EarlyEnd

# Seconds of work between two looks at the keyboard.
SLICE = 0.05


class Disturbed(Exception):
    """What a run works on is no longer what it was."""


class Run:
    """A generator of Progress, how long it has taken, and what it works on."""

    def __init__(self, label: str, context: bpy.types.Context, objects: list, steps):
        self.label, self.steps = label, steps
        self.began = time.monotonic()
        self.stage, self.fraction = "Reading", 0.0
        self.result = None
        self.early: EarlyEnd | None = None
        self.is_ending = False
        self._watch = Watch(context, objects)

    @property
    def seconds(self) -> float:
        return time.monotonic() - self.began

    def advance(self, seconds: float = SLICE) -> bool:
        """Work for about so long; whether the result is there.

        Raises
        ------
        Disturbed : the mesh or the mode has changed, so the result would be of no use
        """
        from ..solver.progress import ThreadProgress, take_step

        begin = time.monotonic()
        self._watch.check()
        more = True
        while more:
            try:
                progress = take_step(self.steps)
            except StopIteration as stop:
                self.result = stop.value
                self._watch.check(thoroughly=True)
                return True
            # A solver may begin a round anew; the bar does not.
            self.fraction = max(self.fraction, progress.fraction)
            self.stage, self.early = progress.stage, progress.early
            if self.is_ending and self.early is not None:
                self.early.ask()
            more = time.monotonic() - begin < seconds and not isinstance(progress, ThreadProgress)
        return False

    def end_early(self) -> bool:
        """End with what there is already, of every object that comes; whether there is anything."""
        if self.early is None:
            return False
        self.early.ask()
        self.is_ending = True
        return True

    def text(self) -> str:
        """One line for the status bar: what it does, and the keys that end it."""
        line = f"{words(self.label)}: {stage_words(self.stage)}   {100 * self.fraction:.0f} %   {self.seconds:.1f} s"
        return f"{line}      {words(self.keys())}"

    def keys(self) -> str:
        """The keys that end it, as things are."""
        if self.is_ending:
            return "Keeping the Best So Far      Esc: Cancel"
        return "Enter: Keep Best So Far      Esc: Cancel" if self.early is not None else "Esc: Cancel"

    def close(self) -> None:
        self._watch.close()
        self.steps.close()


class Watch:
    """Notices when objects that a run works on change, vanish, or are exchanged by undo; any_mode: that of the scene
    may change, as somebody may work on other objects."""

    def __init__(self, context: bpy.types.Context, objects: list, any_mode: bool = False):
        self._mode = None if any_mode else context.mode
        self._objects = [(obj, obj.name) for obj in objects]
        self._marks = self._fingerprints()
        self._suspect = self._lost = False
        handlers = bpy.app.handlers
        self._handlers = [
            (handlers.depsgraph_update_post, self._on_update),
            *((kind, self._on_exchange) for kind in (handlers.undo_post, handlers.redo_post, handlers.load_pre)),
        ]
        for kind, function in self._handlers:
            kind.append(function)

    def close(self) -> None:
        for kind, function in self._handlers:
            if function in kind:
                kind.remove(function)

    def check(self, thoroughly: bool = False) -> None:
        """Raise Disturbed if anything has changed; looks closely when told to, or when Blender said so."""
        if self._lost:
            raise Disturbed("Something was undone meanwhile")
        try:
            if any(bpy.data.objects.get(name) != obj for obj, name in self._objects):
                raise Disturbed("An object was renamed or deleted meanwhile")
            if self._mode not in (None, bpy.context.mode):
                raise Disturbed("The mode was changed meanwhile")
            if (thoroughly or self._suspect) and self._fingerprints() != self._marks:
                raise Disturbed("The mesh was changed meanwhile")
        except ReferenceError as error:
            raise Disturbed("An object was deleted meanwhile") from error
        self._suspect = False

    def _fingerprints(self) -> list[bytes]:
        from ..blender.fingerprint import fingerprint

        return [fingerprint(obj) for obj, _ in self._objects]

    def _on_update(self, _scene, depsgraph=None) -> None:
        self._suspect = True

    def _on_exchange(self, *_) -> None:
        self._lost = True


current: Run | None = None
# Whether solvers may work on a thread of their own; a preference.
threads = True


# Solvers at work on threads of their own; those of runs that were cancelled end a little later.
_solving: set = set()


def aside(steps):
    """A solver that knows nothing of Blender, on a thread of its own while a run is on; as it is in a script.

    Garbage is collected in front meanwhile: what is Blender's may be part of it, and must not be freed on a thread.
    """
    from ..solver import progress

    if current is None or not threads:
        return steps
    return _collecting(progress.on_thread(_without_collector(steps)))


def _without_collector(steps):
    token = object()
    _solving.add(token)
    gc.disable()
    try:
        return (yield from steps)
    finally:
        _solving.discard(token)
        if not _solving:
            gc.enable()


def _collecting(steps):
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        gc.collect(0)
        yield progress
