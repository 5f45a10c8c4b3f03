"""Magnify existing UVs 2 x twice and 4 x once, and compare shares, places and the time of an unwrap."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import load_case
from benchmarks.part import BOUNDARY, MODELS, Part
from benchmarks.parts.magnify import DEFAULT_MODELS, FACTORS, REPEATS
from benchmarks.regions import areas, ball, figures, missed_by
from benchmarks.tables import Table
from benchmarks.timing import fastest_of
from omt_uv.solver.analysis.density import from_vertices, region_share
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.editing.magnify import magnify_region
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions
from omt_uv.solver.progress import drain


def cascade_table(args) -> Table:
    """One row for every model, boundary and factor."""
    table = Table(
        "Existing UVs magnified in their own outline; twice = 2 x twice against 4 x once; ratio = time / plain unwrap",
        {"model": 15, "method": 24, "target": 8, "share": 8, "error": 10, "area_l1": 9, "region": 9, "context": 9}
        | {"folds": 5, "overlap": 8, "twice share": 11, "twice place": 11, "time": 8, "ratio": 7, "missed goals": 20},
    )
    for name in args.models or DEFAULT_MODELS:
        case = load_case(name)
        (chart,) = strict_charts(triangle_surface(case.V, case.F, case.seams))
        w = from_vertices(ball(case.V, case.F)[chart.vertex_ids], chart.triangles)
        for boundary in args.boundaries:
            plain, seconds = fastest_of(REPEATS, lambda b=boundary, c=chart: drain(map_chart(c, options=MapOptions(b))))
            for factor in FACTORS:
                head = {"model": case.name, "method": f"UVs {factor:g} x {boundary}"}
                _add(table, head, plain.uv, chart.triangles, w, factor, seconds)
    return table


def _add(table, head, uv, F, w, factor, plain):
    """A row; `plain` is the time of an unwrap."""
    found = exact_density(w, areas(uv[F]), factor)
    once, seconds = fastest_of(REPEATS, lambda: drain(magnify_region(uv, F, w, factor)))
    flat = np.column_stack([uv, 0 * uv[:, 0]])
    has = figures(flat, F, once.uv[F], found.density, w)
    twice = _twice(uv, F, w, once.uv) if factor == 4 else {}
    off = has.share / found.target_share - 1
    table.add(
        **head,
        target=found.target_share,
        error=off,
        **vars(has),
        **twice,
        time=seconds,
        ratio=seconds / plain,
        **missed_by(has, off, seconds / plain, max(map(abs, twice.values()), default=0)),
    )


def _twice(uv, F, w, once):
    """Difference of 2 x twice from 4 x once: share, relative, and greatest distance over the width."""
    half = drain(magnify_region(uv, F, w, 2.0)).uv
    twice = drain(magnify_region(half, F, w, 2.0)).uv
    shares = [region_share(w, areas(x[F])) for x in (twice, once)]
    moved = np.linalg.norm(twice - once, axis=1).max() / np.ptp(once, axis=0).max()
    return {"twice share": shares[0] / shares[1] - 1, "twice place": float(moved)}


PARTS = (
    Part("cascade", "existing UVs magnified: shares, twice against once, time", cascade_table, (MODELS, BOUNDARY)),
)
