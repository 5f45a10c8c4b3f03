"""Draw the sections of many objects and of islands that exist: queue, stack, symmetrize, rectify."""

from __future__ import annotations

import bpy

from ..blender.versions import progress_bar
from ..session import queue
from .section import Section, settings_of, split

QUEUE = "uv.omt_queue"
STACK = "uv.omt_stack"
SYMMETRIZE = "uv.omt_symmetrize"
RECTIFY = "uv.omt_rectify"
ICONS = {"WAITING": "PAUSE", "RUNNING": "PLAY", "DONE": "CHECKMARK", "FAILED": "ERROR"}


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    split(layout)
    layout.prop(settings_of(context, STACK), "mirrored")
    layout.operator(STACK, text="Stack Equal Islands", icon="DUPLICATE")
    properties = settings_of(context, SYMMETRIZE)
    layout.prop(properties, "axis")
    layout.prop(properties, "halves")
    layout.operator(SYMMETRIZE, text="Symmetrize", icon="MOD_MIRROR")
    layout.operator(RECTIFY, text="Rectify Strips", icon="MESH_GRID")


def draw_queue(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    split(layout)
    layout.prop(settings_of(context, QUEUE), "limit")
    jobs = queue.state
    if jobs is not None and not jobs.is_over:
        layout.operator("uv.omt_queue_stop", text="Stop, Keep What Is Done", icon="X")
    else:
        layout.operator(QUEUE, text="Unwrap in a Queue", icon="PRESET")
    for job in jobs.jobs if jobs is not None else ():
        row = layout.row()
        row.alert = job.state == "FAILED"
        row.label(text=job.name, icon=ICONS[job.state], translate=False)
        progress_bar(row, job.progress, f"{100 * job.progress:.0f} %")


SECTION = Section("arrange", "Arrange", draw, (STACK, SYMMETRIZE, RECTIFY))
QUEUE_SECTION = Section("queue", "Queue", draw_queue, (QUEUE,), parent="")
