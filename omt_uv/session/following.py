"""The live session that is on, if any, and how others end it, kept, before they start.

Whoever changes UVs or starts a run calls `keep` first, so that nothing of theirs is written over or thrown away.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from .live import Session

current: Session | None = None
_keep: Callable[[bpy.types.Context], None] | None = None


def begin(session: Session, keep_it: Callable[[bpy.types.Context], None]) -> None:
    """A session is on; keep_it(context) ends it with its UVs as they are."""
    global current, _keep
    current, _keep = session, keep_it


def end() -> None:
    """The session is over; nothing if there is none."""
    global current, _keep
    if current is not None:
        current.close()
    current, _keep = None, None


def keep(context: bpy.types.Context) -> None:
    """End the session, its UVs kept, as a step of undo of its own; nothing if there is none."""
    if current is not None and _keep is not None:
        _keep(context)
