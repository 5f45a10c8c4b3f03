"""Time optimal transport against one convex hull of the same lifted points, and the first two stages of an unwrap."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull
from work import counted_work

from benchmarks.cases import available, load_case
from benchmarks.part import MODELS, RUNS, Option, Part
from benchmarks.rivals import REFERENCE, median_unwrap
from benchmarks.tables import Table, missed
from benchmarks.timing import median_of, peak_mib
from omt_uv.solver.conformal.disk_map import conformal_disk
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.convex_domain import Disk
from omt_uv.solver.transport.semidiscrete import transport

SITES = Option("sites", (10_000, 100_000), "how many", {"nargs": "+", "type": int, "metavar": "N"})
HULL_GOAL = 6.0  # times the time of a hull, from 100,000 sites on
MILLION_GOAL = 15.0  # times the time at 100,000 sites


def random_sites(count, seed=0):
    """Sites (count,2), uniform in the unit disk."""
    rng = np.random.default_rng(seed)
    radius, angle = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def transport_table(args) -> Table:
    """Random sites of the disk, every one with the same area."""
    table = Table(
        "Transport to random sites of the disk; one hull = scipy.spatial.ConvexHull of the lifted sites",
        {"sites": 8, "Newton": 7, "diagrams": 9, "hulls": 5, "flips": 8, "cycles": 6, "residual": 9, "area error": 10}
        | {"hull": 8, "time": 8, "ratio": 7, "peak MiB": 9, "missed goals": 20},
    )
    times = {}
    for count in args.sites:
        sites = random_sites(count)
        lifted = np.column_stack([sites, (sites**2).sum(1)])
        _, hull = median_of(args.runs, lambda lifted=lifted: ConvexHull(lifted))
        with counted_work() as work:
            result, seconds = median_of(args.runs, lambda s=sites, n=count: drain(transport(s, np.ones(n), Disk())))
        times[count] = seconds
        table.add(
            sites=count,
            Newton=result.iterations,
            diagrams=result.diagrams,
            hulls=result.hulls,
            flips=result.flips,
            cycles=work.cycles // args.runs,
            residual=result.residual,
            hull=hull,
            time=seconds,
            ratio=seconds / hull,
            **{"area error": abs(float(result.cells.area.sum()) / np.pi - 1), "peak MiB": peak_mib()},
            **missed(time=_is_slow(count, seconds, hull, times)),
        )
    return table


def _is_slow(count, seconds, hull, times):
    if count == 1_000_000 and 100_000 in times:
        return seconds > MILLION_GOAL * times[100_000]
    return count >= 100_000 and seconds > HULL_GOAL * hull


def first_stages_table(args) -> Table:
    """The first two stages alone, by default on the model that has most to move."""
    case = load_case(available(["lion"] if not args.models else args.models[:1])[0])
    chart = strict_charts(triangle_surface(case.V, case.F, case.seams))[0]
    mass = vertex_areas(chart.vertices, chart.triangles)

    def ours():
        conformal = drain(conformal_disk(chart.vertices, chart.triangles))
        return conformal, drain(transport(conformal.uv, mass, Disk()))

    (conformal, moved), seconds = median_of(args.runs, ours)
    reference = median_unwrap(case, REFERENCE, args.runs).processor_seconds
    table = Table(
        f"Conformal map and transport of {case.name} against {REFERENCE}",
        {"Newton conformal": 16, "Newton transport": 16, "residual": 9, "time": 8, REFERENCE: 18, "ratio": 7},
    )
    table.add(
        time=seconds,
        ratio=seconds / reference,
        residual=moved.residual,
        **{"Newton conformal": conformal.iterations, "Newton transport": moved.iterations, REFERENCE: reference},
    )
    return table


PARTS = (
    Part("transport", "optimal transport to random sites against one convex hull", transport_table, (SITES, RUNS)),
    Part("first_stages", f"conformal map and transport alone against {REFERENCE}", first_stages_table, (MODELS, RUNS)),
)
