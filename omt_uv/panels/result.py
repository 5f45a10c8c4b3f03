"""Draw what the last run did."""

from __future__ import annotations

import bpy

from ..session import last_run
from .section import Section


def draw(layout: bpy.types.UILayout, _context: bpy.types.Context) -> None:
    summary = last_run.state.summary
    if summary is None:
        layout.label(text="Nothing has been run yet")
        return
    box = layout.column(align=True)
    box.label(text=summary.title, icon="ERROR" if summary.warnings else "CHECKMARK")
    for name, value in summary.rows:
        line = box.split(factor=0.55)
        line.label(text=name)
        line.label(text=value, translate=False)
    if summary.warnings:
        count = len(summary.warnings)
        box.label(text=f"{count} warning{'' if count == 1 else 's'}: see the info editor")


SECTION = Section("result", "Result", draw, is_open=True)
