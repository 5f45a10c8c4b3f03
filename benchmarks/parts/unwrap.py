"""Compare Blender's unwraps and ours on the same chart: area, shear, folds, overlap and time."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import available, load_case, our_uv
from benchmarks.part import BOUNDARY, MODELS, PRESET, RUNS, Option, Part
from benchmarks.rivals import METHODS, REFERENCE, median_unwrap
from benchmarks.tables import Table, missed
from benchmarks.timing import median_of
from omt_uv.solver.errors import MeshError
from omt_uv.solver.maps.distortion import distortion

RIVALS = Option(
    "methods",
    None,
    "rivals to unwrap with; default all, and then meshes of 20,000 faces and more run once",
    {"nargs": "+", "choices": list(METHODS)},
)
# What a free Standard map is to be faster than.
FAST = "Minimum Stretch 10"
# Faces from which only --methods brings medians: all methods together take minutes a run.
LARGE = 20_000
# What a map should reach, by (boundary is free, preset): area_l1. Draft has no goal.
AREA_GOALS = {(True, "standard"): 0.01, (True, "exact"): 0.001, (False, "standard"): 0.02, (False, "exact"): 0.005}
OVERLAP_GOAL = 1e-4  # share of the layout
# Of an exact disk of so many faces, in at most the time of the reference.
DEVIATION_GOAL = 1e-3
DEVIATION_FACES = (16_000, 100_000)
# Times the time of the reference, by preset; a free Standard map has to be faster than FAST.
TIME_GOALS = {"standard": 1.0, "exact": 3.0}
TIMED_MODELS = ("lion", "face", "stanford_bunny*", "armadillo*")
FIGURES = ("area_l1", "area_sd", "angle_mean", "folds", "overlap")


def unwrap_table(args) -> Table:
    """One row for every model and method, ours by boundary and preset."""
    table = Table(
        f"Unwraps of one chart; ratio = time / time of {REFERENCE}, to 10: of {FAST}; * is cut along a fixed seam",
        {"model": 15, "faces": 7, "method": 20, "area_l1": 9, "area_sd": 9, "angle_mean": 10, "folds": 5, "overlap": 8}
        | {"time": 8, "ratio": 7, "to 10": 7, "missed goals": 20},
    )
    for case in map(load_case, available(args.models)):
        runs = args.runs if len(case.F) < LARGE or args.methods else 1
        rivals = {m: median_unwrap(case, m, runs) for m in args.methods or METHODS}
        times = {m: found.processor_seconds for m, found in rivals.items()}
        for method, found in rivals.items():
            _add(table, case, method, found.uv, found.processor_seconds, times)
        for boundary in args.boundaries:
            for preset in args.presets:
                try:
                    (uv, _), seconds = median_of(runs, lambda c=case, b=boundary, p=preset: our_uv(c, b, p))
                except MeshError as error:
                    refusal = f"{type(error).__name__}: {error.cause}"
                    table.add(**_head(case, f"ours {preset} {boundary}"), **{"missed goals": refusal})
                    continue
                _add(table, case, f"ours {preset} {boundary}", uv, seconds, times, (boundary, preset))
    return table


def _head(case, method):
    return {"model": case.name, "faces": len(case.F), "method": method}


def _add(table, case, method, uv, seconds, times, ours=None):
    """A row; `times` are those of the rivals by method, `ours` is the pair boundary, preset of a map of ours."""
    d = distortion(case.V, case.F, uv)
    ratio, faster = (seconds / times.get(m, np.nan) for m in (REFERENCE, FAST))
    figures = {k: getattr(d, k) for k in FIGURES} | {"time": seconds, "ratio": ratio, "to 10": faster}
    goals = _goals(case, d, ratio, faster, *ours) if ours and ours[1] in TIME_GOALS else {}
    table.add(**_head(case, method), **figures, **missed(**goals))


def _goals(case, d, ratio, faster, boundary, preset):
    """The goals of a map of ours by name, each with whether it is missed."""
    free = boundary == "free"
    timed_here = free and case.name in TIMED_MODELS
    exact_disk = boundary == "disk" and preset == "exact" and DEVIATION_FACES[0] <= len(case.F) <= DEVIATION_FACES[1]
    slow = faster > 1 if preset == "standard" else ratio > TIME_GOALS[preset]
    return {
        "folds": d.folds,
        "overlap": d.overlap > OVERLAP_GOAL,
        "area": d.area_l1 > AREA_GOALS[free, preset] and (free or case.name != "maze"),
        "area_sd": exact_disk and d.area_sd > DEVIATION_GOAL,
        "time": (timed_here and slow) or (exact_disk and ratio > 1),
    }


PARTS = (
    Part("unwrap", "Blender's unwraps and ours on the same chart", unwrap_table,
         (MODELS, RIVALS, BOUNDARY, PRESET, RUNS)),
)  # fmt: skip
