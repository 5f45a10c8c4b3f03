"""Magnification: the share that a painted region gets, beside Blender's Minimum Stretch with the same vertex group.

The region is a geodesic ball of 5 % of the surface about a random vertex, with a soft rim.
"""

from __future__ import annotations

import time

import bpy

import numpy as np
from cases import Table, load_case, timed
from rivals import make_object, read_uv, remove_object

from omt_uv.solver.chart_map import unwrap_chart
from omt_uv.solver.charts import split, triangle_surface
from omt_uv.solver.distortion import measure
from omt_uv.solver.exact_share import exact_share
from omt_uv.solver.geometry import face_areas, signed_areas, vertex_areas
from omt_uv.solver.measure import from_vertices, normalised, share
from omt_uv.solver.overlap import overlap_share
from omt_uv.solver.progress import drain
from omt_uv.solver.scores import distance

MODELS = ["lion", "max_planck", "face"]
FACTORS = [0.25, 2.0, 4.0, 16.0]
RIVAL_FACTORS = [1.0, 4.0, 16.0]
SHARE, RIM = 0.05, 0.25
# What a magnification should reach.
SHARE_GOAL, AREA_GOAL, OVERLAP_GOAL, TIME_GOAL = 5e-3, 0.02, 1e-4, 1.3


def ball(V, F, seed=1):
    """Weights (n,) of a geodesic ball with the given share of the area about a random vertex, and a soft rim."""
    d = distance(V, F, np.array([np.random.default_rng(seed).choice(np.unique(F))]))
    area = vertex_areas(V, F)
    order = np.argsort(d)
    radius = d[order[np.searchsorted(np.cumsum(area[order]) / area.sum(), SHARE)]]
    t = np.clip((radius * (1 + RIM) - d) / (2 * RIM * radius), 0, 1)
    return t * t * (3 - 2 * t)


def magnify_part(args):
    table = Table(
        "Share of a region against the share asked; area errors against the density; ratio = time / plain unwrap",
        {"model": 15, "method": 24, "asked": 8, "share": 8, "error": 9, "area_l1": 9, "inside": 8, "outside": 8}
        | {"folds": 5, "overlap": 8, "time": 8, "ratio": 7, "missed goals": 20},
    )
    for name in args.models or MODELS:
        case = load_case(name)
        weights = ball(case.V, case.F)
        for factor in RIVAL_FACTORS:
            _rival(table, case, weights, factor)
        (chart,) = split(triangle_surface(case.V, case.F, case.seams))
        for boundary in args.boundaries:
            plain = min(timed(lambda b=boundary, c=chart: drain(unwrap_chart(c, boundary=b)))[1] for _ in range(2))
            for factor in FACTORS:
                _ours(table, case.name, chart, weights[chart.vertex_ids], factor, boundary, plain)
    return table


def _ours(table, name, chart, weights, factor, boundary, plain):
    F = chart.triangles
    area, w = face_areas(chart.vertices, F), from_vertices(weights, F)
    found = exact_share(w, area, factor)
    density = normalised(found.density, area)
    job = unwrap_chart(chart, boundary=boundary, density=density, region=w)
    result, seconds = timed(lambda: drain(job))
    has, target = signed_areas(result.uv, F), area * density / area.sum()
    error = np.abs(has / has.sum() - target)
    inside, outside = (error[part].sum() / target[part].sum() for part in (w >= 1, w <= 0))
    got, overlap, folds = share(w, has), overlap_share(result.uv[F]), int((has <= 0).sum())
    off = got / found.asked - 1
    missed = [
        text
        for text, wrong in (
            ("share", abs(off) > SHARE_GOAL),
            ("area", max(error.sum(), inside, outside) > AREA_GOAL),
            ("folds", folds),
            ("overlap", overlap > OVERLAP_GOAL),
            ("time", seconds > TIME_GOAL * plain),
        )
        if wrong
    ]
    table.add(
        model=name,
        method=f"ours {factor:g} x {boundary}",
        asked=found.asked,
        share=got,
        error=off,
        area_l1=float(error.sum()),
        inside=float(inside),
        outside=float(outside),
        folds=folds,
        overlap=overlap,
        time=seconds,
        ratio=seconds / plain,
        **{"missed goals": ", ".join(missed)},
    )


def _rival(table, case, weights, factor):
    """Minimum Stretch with the vertex group, the clock around the operator alone."""
    obj = make_object(case.V, case.F, case.seams)
    group = obj.vertex_groups.new(name="region")
    for vertex, weight in enumerate(weights.tolist()):
        group.add([vertex], weight, "REPLACE")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    start = time.process_time()
    bpy.ops.uv.unwrap(
        method="MINIMUM_STRETCH",
        iterations=50,
        use_weights=True,
        weight_group="region",
        weight_factor=factor,
        fill_holes=True,
        correct_aspect=False,
        margin=0.0,
    )
    seconds = time.process_time() - start
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = read_uv(obj)
    remove_object(obj)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    has = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    w = from_vertices(weights, case.F)
    figures = measure(case.V, case.F, uv)
    table.add(
        model=case.name,
        method=f"Minimum Stretch {factor:g}",
        share=share(w, has),
        folds=figures.folds,
        overlap=figures.overlap,
        time=seconds,
    )
