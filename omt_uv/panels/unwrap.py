"""Draw the first section: the button, the slider, the main settings, and below them what is needed less often."""

from __future__ import annotations

import bpy

from ..blender.versions import progress_bar
from ..operators.unwrap import draw_main, draw_more
from ..session import following, run
from ..session.language import stage_words
from ..settings import CONTEXT
from .section import Section, big_button, operator_section, settings_of

UNWRAP = "uv.omt_unwrap"
LIVE = "uv.omt_live"
# The bar of a run is as high as the button, so that nothing below moves.
HEIGHT = 1.5


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    if run.current is not None:
        draw_run(layout, run.current)
    elif following.current is not None:
        draw_end(layout)
    else:
        big_button(layout, UNWRAP, "UV", "Unwrap", HEIGHT)
    properties = settings_of(context, UNWRAP)
    if run.current is None:
        draw_live(layout, properties)
    else:
        # In place of the slider, which nobody can move meanwhile.
        layout.label(text=run.current.keys())
    draw_main(layout.column(), properties)


def draw_live(layout: bpy.types.UILayout, properties) -> None:
    """The slider, and the button that makes the UVs follow it; red while they do."""
    row = layout.row(align=True)
    row.alert = following.current is not None
    row.prop(properties, "balance", text="Area - Angle", slider=True)
    row.operator(LIVE, text="", icon="PLAY", depress=following.current is not None)
    row.prop(settings_of(bpy.context, LIVE), "pins", text="", icon_only=True)


def draw_end(layout: bpy.types.UILayout) -> None:
    """What ends a live session, in place of the button."""
    row = layout.row(align=True)
    row.scale_y = HEIGHT
    row.operator("uv.omt_live_end", text="Accept", text_ctxt=CONTEXT, icon="CHECKMARK").end = "KEEP"
    row.operator("uv.omt_live_end", text="Cancel", icon="X").end = "BACK"


def draw_run(layout: bpy.types.UILayout, current: run.Run) -> None:
    row = layout.row(align=True)
    row.scale_y = HEIGHT
    progress_bar(row, current.fraction, f"{stage_words(current.stage)}, {current.seconds:.1f} s")


def draw_options(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    draw_more(layout.column(), settings_of(context, UNWRAP))


SECTION = Section("", "OMT UV", draw, (UNWRAP,), is_open=True)
OPTIONS = Section("more", "Seams and Packing", draw_options, (UNWRAP,), parent="")
REFINE = operator_section("refine", "Refine Area", "uv.omt_refine", "MOD_SMOOTH", parent="")
SEAMS = operator_section("seams", "Mark Seams", "uv.omt_seams", "EDGESEL", "", button="Mark Seams")
