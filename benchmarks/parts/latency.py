"""Measure how long Blender waits for a run: the longest slice between two looks at the keyboard, and cancelling.

`slice` and `cancel` are wall-clock milliseconds, which other jobs on the machine lengthen; `working` and `writing` are
those that the main thread itself worked. The last slice writes and measures: it cannot be cancelled, and stands apart.
"""

from __future__ import annotations

import time
import types

import bpy

import meshes
import numpy as np
import scenes

from benchmarks.part import Option, Part
from benchmarks.tables import Table, missed

SIZES = Option("sizes", (100, 224, 316), "heads of N * N vertices", {"nargs": "+", "type": int, "metavar": "N"})
SLICE_GOAL = 200.0  # milliseconds, up to the second of the sizes
CANCEL_GOAL = 300.0  # milliseconds
LIVE_GOAL = 300.0  # milliseconds of work, at the first of the sizes
CANCELLED = 4  # times, at moments spread over a run
SETTLING = 0.5  # seconds in which a solver that was thrown away ends in the background
OPERATORS = ("uv.omt_unwrap", "uv.omt_refine", "uv.omt_seams")
TIMER = types.SimpleNamespace(type="TIMER", value="NOTHING")
ESCAPE = types.SimpleNamespace(type="ESC", value="PRESS")


def latency_table(args) -> Table:
    """One row for every size, mode and operator."""
    from omt_uv import registration

    table = Table(
        "Milliseconds that Blender waits during a run, and until Esc is obeyed",
        {"vertices": 8, "operator": 15, "mode": 6, "seconds": 8, "slices": 7, "slice": 7, "working": 8, "writing": 8}
        | {"cancel": 7, "longest slice in": 22, "missed goals": 20},
    )
    registration.register()
    try:
        for size in args.sizes:
            for mode in ("OBJECT", "EDIT"):
                for name in OPERATORS:
                    _add(table, size, mode, name)
                _add_live(table, size, mode)
    finally:
        registration.unregister()
    return table


def _add(table, size, mode, name):
    """The row of an operator."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    V, F = meshes.head(size)
    obj = scenes.add(V, F)
    if name == "uv.omt_refine":
        # Planar from the side of the nose; the folds are straightened first.
        angle, height = np.arctan2(V[:, 1], V[:, 0]), V[:, 2]
        r = 1.5 + height.max() - height
        scenes.set_uv(obj, np.column_stack([r * np.cos(angle), r * np.sin(angle)])[F.ravel()])
    if mode == "EDIT":
        scenes.edit(obj)
    begin = time.perf_counter()
    slices = _slices(scenes.stand_in(name))
    seconds = time.perf_counter() - begin
    *during, (_, writing, _) = slices
    longest = max(during, default=(0.0, 0.0, ""))
    worked = max((own for _, own, _ in during), default=0.0)
    cancel = longest[0] + _cancelling(scenes.stand_in(name), seconds)
    goals = {"slice": longest[1] > SLICE_GOAL and size <= SIZES.default[1], "cancel": cancel > CANCEL_GOAL}
    table.add(
        vertices=len(V),
        operator=name,
        mode=mode,
        seconds=seconds,
        slices=len(slices),
        slice=longest[0],
        working=worked,
        writing=writing,
        cancel=cancel,
        **{"longest slice in": longest[2]},
        **missed(**goals),
    )
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")


def _add_live(table, size, mode):
    """The slider dragged from area to angle in steps of a twentieth: the longest wait for the UVs to follow one."""
    from omt_uv.operators import base
    from omt_uv.session import live as following

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = scenes.add(*meshes.head(size))
    bpy.ops.uv.omt_unwrap(quality="DRAFT")
    if mode == "EDIT":
        scenes.edit(obj)
    session = following.Session(bpy.context, base.read_objects(bpy.context))
    waits, works = [], []
    for balance in np.linspace(0, 1, 21):
        wall, own = time.perf_counter(), time.thread_time()
        session.follow(float(balance))
        waits.append(1e3 * (time.perf_counter() - wall))
        works.append(1e3 * (time.thread_time() - own))
    session.close()
    table.add(
        vertices=len(obj.data.vertices),
        operator="uv.omt_live",
        mode=mode,
        slices=len(waits),
        slice=max(waits),
        working=max(works),
        cancel=max(waits),
        **missed(live=size <= SIZES.default[0] and max(works) > LIVE_GOAL),
    )
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")


def _slices(operator):
    """Wall-clock milliseconds, those of the main thread, and the stage, of every slice."""
    from omt_uv.session import run as running

    found: list[tuple[float, float, str]] = []
    state = {"RUNNING_MODAL"}
    while "RUNNING_MODAL" in state:
        wall, own = time.perf_counter(), time.thread_time()
        stage = running.current.stage if running.current else "Reading"
        state = operator.modal(bpy.context, TIMER) if found else operator.start(bpy.context)
        found.append((1e3 * (time.perf_counter() - wall), 1e3 * (time.thread_time() - own), stage))
    if state != {"FINISHED"}:
        raise SystemExit(f"{operator.bl_label}: {operator.reports}")
    return found


def _cancelling(operator, seconds):
    """The most milliseconds that the answer to Esc takes, at moments spread over a run of so many seconds."""
    most = 0.0
    for k in range(CANCELLED):
        begin = time.perf_counter()
        state = operator.start(bpy.context)
        while "RUNNING_MODAL" in state and time.perf_counter() - begin < seconds * k / CANCELLED:
            state = operator.modal(bpy.context, TIMER)
        if "RUNNING_MODAL" in state:
            begin = time.perf_counter()
            operator.modal(bpy.context, ESCAPE)
            most = max(most, 1e3 * (time.perf_counter() - begin))
            time.sleep(SETTLING)
    return most


PARTS = (
    Part("latency", "how long Blender waits for a slice of a run and for Esc, wall clock", latency_table, (SIZES,)),
)
