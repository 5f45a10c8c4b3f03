"""Draw what the last run did: always as high as it is, so that no button below it moves."""

from __future__ import annotations

import bpy

from ..operators.inspection.remedy import UV_OT_omt_notices
from ..remedies import ACTIONS
from ..session import last_run
from ..session.language import words
from .section import Section

# Lines of figures, and of a warning; what does not fit is left out, and in the report.
ROWS = 7
LINES = 3
# The lines that go first where there are more than fit.
LAST = ("Region before", "Time")
# Width of a panel and of a letter, in pixels at the scale 1, where Blender does not tell.
PANEL = 280
LETTER = 6.6
BESIDE = 40


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    summary = last_run.state.summary or last_run.Summary("Nothing has been run yet")
    outdated = last_run.state.outdated
    column = layout.column(align=True)
    draw_title(column, summary, outdated)
    figures = column.column(align=True)
    figures.active = not outdated
    for name, value in [*rows_of(summary), *[("", "")] * ROWS][:ROWS]:
        line = figures.split(factor=0.5)
        line.label(text=name)
        line.label(text=value, translate=False, icon="ERROR" if name in summary.beyond else "NONE")
    draw_notice(column, summary, characters(context))


def draw_title(column: bpy.types.UILayout, summary: last_run.Summary, outdated: str) -> None:
    """Which operator, on what, and whether that still holds."""
    row = column.split(factor=0.78)
    row.alert = summary.refused
    row.label(text=summary.title, icon=icon_of(summary, outdated))
    row.label(text=dict(summary.rows).get("Time", ""), translate=False)
    row = column.row()
    row.label(text=words("Outdated: {}", words(outdated)) if outdated else about(summary), translate=False)
    if outdated:
        row.operator("uv.omt_measure", text="", icon="FILE_REFRESH")


def draw_notice(column: bpy.types.UILayout, summary: last_run.Summary, width: int) -> None:
    """One warning in words, and below it the button that mends it; another button shows the next one."""
    notices = summary.notices
    notice = notices[last_run.state.shown % len(notices)] if notices else last_run.Notice("")
    text = last_run.lines(notice.text, width)
    if len(text) > LINES:
        text = [*text[: LINES - 1], text[LINES - 1][: width - 4] + " ..."]
    box = column.column(align=True)
    box.alert = bool(notices)
    for line in [*text, *[""] * LINES][:LINES]:
        box.label(text=line, translate=False)
    row = column.row(align=True)
    title = next((label for name, label, _ in ACTIONS if name == notice.action), "")
    if title:
        row.operator("uv.omt_remedy", text=title, icon="TOOL_SETTINGS").action = notice.action
    else:
        row.label(text="")
    if len(notices) > 1:
        count = words("{} of {}", last_run.state.shown % len(notices) + 1, len(notices))
        row.operator(UV_OT_omt_notices.bl_idname, text=count, icon="TRIA_RIGHT").whole = False
    if notices:
        row.operator(UV_OT_omt_notices.bl_idname, text="", icon="FULLSCREEN_ENTER").whole = True


def rows_of(summary: last_run.Summary) -> list[tuple[str, str]]:
    """The rows that are shown, in their order."""
    return [row for row in summary.rows if row[0] not in LAST]


def icon_of(summary: last_run.Summary, outdated: str) -> str:
    """A check mark only where all is within its bounds."""
    if summary.refused:
        return "CANCEL"
    if outdated:
        return "FILE_REFRESH"
    if summary.notices or summary.beyond & {"Folded faces", "Overlap"}:
        return "ERROR"
    if summary.beyond or not summary.rows:
        return "INFO"
    return "CHECKMARK"


def about(summary: last_run.Summary) -> str:
    """The object, or how many."""
    if len(summary.objects) == 1:
        return summary.objects[0]
    return words("{} objects", len(summary.objects)) if summary.objects else ""


def characters(context: bpy.types.Context) -> int:
    """How many letters fit into a line of the panel."""
    region, scale = context.region, context.preferences.system.ui_scale
    width = region.width / scale if region is not None and region.type == "UI" else PANEL
    return int((width - BESIDE) / LETTER)


SECTION = Section("result", "Result", draw, is_open=True)
