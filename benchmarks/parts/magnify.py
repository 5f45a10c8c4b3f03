"""Magnify a painted region in an unwrap, beside Blender's Minimum Stretch with the same vertex group.

The region is a geodesic ball of 5 % of the surface about a random vertex, with a soft border.
"""

from __future__ import annotations

import time

import bpy

from benchmarks.cases import load_case
from benchmarks.part import BOUNDARY, MODELS, Part
from benchmarks.regions import areas, ball, figures, missed_by
from benchmarks.rivals import make_object, read_uv, remove_object
from benchmarks.tables import Table
from benchmarks.timing import fastest_of
from omt_uv.solver.analysis.density import Target, from_vertices, region_share
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions
from omt_uv.solver.progress import drain

DEFAULT_MODELS = ("lion", "max_planck", "face")
FACTORS = (0.25, 2.0, 4.0, 16.0)
RIVAL_FACTORS = (1.0, 4.0, 16.0)
REPEATS = 2


def magnify_table(args) -> Table:
    """One row for every model and factor, of the rival and of ours by boundary."""
    table = Table(
        "Share of a region against the target share; area errors against the density; ratio = time / plain unwrap",
        {"model": 15, "method": 24, "before": 8, "target": 8, "share": 8, "error": 10, "area_l1": 9, "region": 9}
        | {"context": 9, "shear": 7, "folds": 5, "overlap": 8, "time": 8, "ratio": 7, "missed goals": 20},
    )
    for name in args.models or DEFAULT_MODELS:
        case = load_case(name)
        weights = ball(case.V, case.F)
        for factor in RIVAL_FACTORS:
            _rival(table, case, weights, factor)
        (chart,) = strict_charts(triangle_surface(case.V, case.F, case.seams))
        for boundary in args.boundaries:
            _, plain = fastest_of(REPEATS, lambda b=boundary, c=chart: drain(map_chart(c, options=MapOptions(b))))
            for factor in FACTORS:
                _ours(table, case.name, chart, weights[chart.vertex_ids], factor, boundary, plain)
    return table


def _ours(table, name, chart, weights, factor, boundary, plain):
    F = chart.triangles
    area, w = face_areas(chart.vertices, F), from_vertices(weights, F)
    found = exact_density(w, area, factor)
    target = Target(found.density * (area.sum() / (area @ found.density)), w)
    result, seconds = fastest_of(REPEATS, lambda: drain(map_chart(chart, options=MapOptions(boundary), target=target)))
    has = figures(chart.vertices, F, result.uv[F], found.density, w)
    off = has.share / found.target_share - 1
    table.add(
        model=name,
        method=f"ours {factor:g} x {boundary}",
        before=found.share_before,
        target=found.target_share,
        error=off,
        **vars(has),
        shear=result.angle_mean,
        time=seconds,
        ratio=seconds / plain,
        **missed_by(has, off, seconds / plain),
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
    area, w = areas(case.V[case.F]), from_vertices(weights, case.F)
    # It is told a weight and no share, so there is no density to hold it against.
    has = figures(case.V, case.F, uv, 1 + 0 * w, w)
    table.add(
        model=case.name,
        method=f"Minimum Stretch {factor:g}",
        before=region_share(w, area),
        share=has.share,
        folds=has.folds,
        overlap=has.overlap,
        time=seconds,
    )


PARTS = (
    Part("magnify", "the share that a painted region gets, and Minimum Stretch with the same vertex group",
         magnify_table, (MODELS, BOUNDARY)),
)  # fmt: skip
