"""Magnification of existing UVs: 2 x twice against 4 x once, in shares and in places, and the time beside an unwrap."""

from __future__ import annotations

import numpy as np
from cases import Table, load_case
from magnify import FACTORS, MODELS, fastest, missed
from regions import areas, ball, figures

from omt_uv.solver.analysis.density import from_vertices, region_share
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.editing.magnify import magnify_region
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_map import unwrap_chart
from omt_uv.solver.progress import drain


def cascade_part(args):
    table = Table(
        "Existing UVs magnified in their own outline; twice = 2 x twice against 4 x once; ratio = time / plain unwrap",
        {"model": 15, "method": 24, "asked": 8, "share": 8, "error": 10, "area_l1": 9, "region": 9, "context": 9}
        | {"folds": 5, "overlap": 8, "twice share": 11, "twice place": 11, "time": 8, "ratio": 7, "missed goals": 20},
    )
    for name in args.models or MODELS:
        case = load_case(name)
        (chart,) = strict_charts(triangle_surface(case.V, case.F, case.seams))
        w = from_vertices(ball(case.V, case.F)[chart.vertex_ids], chart.triangles)
        for boundary in args.boundaries:
            plain, seconds = fastest(lambda b=boundary, c=chart: drain(unwrap_chart(c, boundary=b)))
            for factor in FACTORS:
                _lens(table, f"{case.name}", boundary, plain.uv, chart.triangles, w, factor, seconds)
    return table


def _lens(table, name, boundary, uv, F, w, factor, plain):
    found = exact_density(w, areas(uv[F]), factor)
    once, seconds = fastest(lambda: drain(magnify_region(uv, F, w, factor)))
    flat = np.column_stack([uv, 0 * uv[:, 0]])
    has = figures(flat, F, once.uv[F], found.density, w)
    twice = _twice(uv, F, w, once.uv) if factor == 4 else {}
    off = has.share / found.target_share - 1
    table.add(
        model=name,
        method=f"UVs {factor:g} x {boundary}",
        asked=found.target_share,
        error=off,
        **vars(has),
        **twice,
        time=seconds,
        ratio=seconds / plain,
        **{"missed goals": missed(has, off, seconds / plain, max(map(abs, twice.values()), default=0))},
    )


def _twice(uv, F, w, once):
    """Difference of 2 x twice from 4 x once: share, relative, and greatest distance over the width."""
    half = drain(magnify_region(uv, F, w, 2.0)).uv
    twice = drain(magnify_region(half, F, w, 2.0)).uv
    shares = [region_share(w, areas(x[F])) for x in (twice, once)]
    moved = np.linalg.norm(twice - once, axis=1).max() / np.ptp(once, axis=0).max()
    return {"twice share": shares[0] / shares[1] - 1, "twice place": float(moved)}
