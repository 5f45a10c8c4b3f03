"""Benchmarks: figures as ratios within one run, since machines differ and are shared.

All times are seconds of processor time, medians of --runs, but for the profile (one run, wall clock). Parts:

transport   optimal transport to random sites of the disk against one convex hull of the same lifted points
unwrap      area, shear, folds, overlap and time: Blender's unwraps and ours on the same chart
lion        conformal map and transport alone against Minimum Stretch with 50 iterations
profile     where our time goes, stage by stage
memory      peak memory of the unwrap of 100,000 faces
counts      Newton steps, factorisations and nonzeros of an unwrap: the same on every machine
growth      time of the same surface, subdivided again and again, and the exponent
islands     a thousand small islands against Minimum Stretch
magnify     the share that a painted region gets, and Minimum Stretch with the same vertex group
cascade     existing UVs magnified: shares, twice against once, time
saliency    its time, and what turning and scaling change
sphere      closed surfaces to the sphere: area, shear, folds, Newton steps, and time against Minimum Stretch
remesh      triangles, distances and time beside QuadriFlow and Decimate; the four strategies of B. Gu 2018
latency     how long Blender waits for a slice of a run and for Esc, wall clock
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import scipy
from cases import ROOT, Table, available, load_case, our_uv, timed  # first: it finds the modules below
from counting import counted
from scipy.spatial import ConvexHull

from omt_uv.solver.conformal.disk_map import conformal_disk
from omt_uv.solver.errors import MeshError
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.convex_domain import Disk
from omt_uv.solver.transport.semidiscrete import transport

PRESETS = ["draft", "standard", "exact"]
BOUNDARIES = ["free", "disk", "square"]
REFERENCE = "Minimum Stretch 50"
# What a free Standard map is to be faster than.
FAST = "Minimum Stretch 10"
# What a map should reach, by (boundary is free, preset): area_l1. Draft has no goal.
AREA_GOALS = {(True, "standard"): 0.01, (True, "exact"): 0.001, (False, "standard"): 0.02, (False, "exact"): 0.005}
OVERLAP_GOAL = 1e-4
# Of an exact disk of 16,000 to 100,000 faces, in at most the time of the reference.
SD_GOAL = 1e-3
TIME_GOALS = {"standard": 1.0, "exact": 3.0}
PEAK_GOAL = 2 * 2**30
HULL_GOAL = 6.0  # at 100,000 sites
MILLION_GOAL = 15.0  # times the time at 100,000 sites


def median_of(runs, work):
    """The result of the run with the median time, and that time."""
    results = sorted((timed(work) for _ in range(runs)), key=lambda pair: pair[1])
    return results[(runs - 1) // 2]


# ---- transport ----------------------------------------------------------------------------------------------


def random_sites(count, seed=0):
    rng = np.random.default_rng(seed)
    radius, angle = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def transport_part(args):
    table = Table(
        "Transport to random sites of the disk; one hull = scipy.spatial.ConvexHull of the lifted sites",
        {
            "sites": 8,
            "Newton": 7,
            "diagrams": 9,
            "hulls": 5,
            "flips": 8,
            "cycles": 6,
            "residual": 9,
            "area error": 10,
            "hull": 8,
            "time": 8,
            "ratio": 7,
            "peak MiB": 9,
        }
        | {"missed goals": 20},
    )
    times = {}
    for count in args.sites:
        sites = random_sites(count)
        lifted = np.column_stack([sites, (sites**2).sum(1)])
        _, hull = median_of(args.runs, lambda lifted=lifted: ConvexHull(lifted))
        with counted() as tally:
            result, seconds = median_of(args.runs, lambda s=sites, n=count: drain(transport(s, np.ones(n), Disk())))
        times[count] = seconds
        table.add(
            sites=count,
            Newton=result.iterations,
            diagrams=result.diagrams,
            hulls=result.hulls,
            flips=result.flips,
            cycles=tally.cycles // args.runs,
            residual=result.residual,
            hull=hull,
            time=seconds,
            ratio=seconds / hull,
            **{
                "area error": abs(float(result.cells.area.sum()) / np.pi - 1),
                "peak MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
                "missed goals": "time" if _transport_is_slow(count, seconds, hull, times) else "",
            },
        )
    return table


def _transport_is_slow(count, seconds, hull, times):
    if count == 1_000_000 and 100_000 in times:
        return seconds > MILLION_GOAL * times[100_000]
    return count >= 100_000 and seconds > HULL_GOAL * hull


# ---- unwraps ------------------------------------------------------------------------------------------------


def unwrap_part(args):
    from rivals import METHODS

    figures = {
        "area_l1": 9,
        "area_sd": 9,
        "angle_mean": 10,
        "folds": 5,
        "overlap": 8,
        "time": 8,
        "ratio": 7,
        "to 10": 7,
    }
    table = Table(
        f"Unwraps of one chart; ratio = time / time of {REFERENCE}, to 10: of {FAST}; * is cut along a fixed seam",
        {"model": 15, "faces": 7, "method": 20} | figures | {"missed goals": 20},
    )
    for case in map(load_case, available(args.models)):
        # Medians of large meshes are asked for one by one: all methods together take minutes a run.
        runs = args.runs if len(case.F) < 20_000 or args.methods else 1
        rivals = {m: _median_rival(case, m, runs) for m in args.methods or METHODS}
        times = {m: found.processor_seconds for m, found in rivals.items()}
        reference, fast = (times.get(m, np.nan) for m in (REFERENCE, FAST))
        for method, found in rivals.items():
            _add(table, case, method, found.uv, found.processor_seconds, reference, fast)
        for boundary in args.boundaries:
            for preset in args.presets:
                name = f"ours {preset} {boundary}"
                try:
                    (uv, _), seconds = median_of(runs, lambda c=case, b=boundary, p=preset: our_uv(c, b, p))
                except MeshError as error:
                    table.add(**_head(case, name), **{"missed goals": f"{type(error).__name__}: {error.cause}"})
                    continue
                _add(table, case, name, uv, seconds, reference, fast, boundary, preset)
    return table


def _median_rival(case, method, runs):
    from rivals import unwrap as rival

    found = [rival(case.V, case.F, case.seams, method) for _ in range(runs)]
    return sorted(found, key=lambda f: f.processor_seconds)[(runs - 1) // 2]


def _head(case, method):
    return {"model": case.name, "faces": len(case.F), "method": method}


def _add(table, case, method, uv, seconds, reference, fast, boundary=None, preset=None):
    d = distortion(case.V, case.F, uv)
    ratio, faster = seconds / reference, seconds / fast
    figures = {k: getattr(d, k) for k in ("area_l1", "area_sd", "angle_mean", "folds", "overlap")}
    missed = ", ".join(_missed(case, d, ratio, faster, boundary, preset)) if preset in TIME_GOALS else ""
    table.add(**_head(case, method), **figures, time=seconds, ratio=ratio, **{"to 10": faster, "missed goals": missed})


def _missed(case, d, ratio, faster, boundary, preset):
    """The names of the goals that a map of ours does not reach."""
    free = boundary == "free"
    if d.folds:
        yield "folds"
    if d.overlap > OVERLAP_GOAL:
        yield "overlap"
    if d.area_l1 > AREA_GOALS[free, preset] and (free or case.name != "maze"):
        yield "area"
    timed_models = ("lion", "face", "stanford_bunny*", "armadillo*")
    if free and case.name in timed_models and (faster > 1 if preset == "standard" else ratio > TIME_GOALS[preset]):
        yield "time"
    if boundary == "disk" and preset == "exact" and 16_000 <= len(case.F) <= 100_000:
        if d.area_sd > SD_GOAL:
            yield "area_sd"
        if ratio > 1:
            yield "time"


# ---- stages -------------------------------------------------------------------------------------------------


def lion_part(args):
    """The first two stages alone, on the model that has most to move."""
    case = load_case(available(["lion"] if not args.models else args.models[:1])[0])
    chart = strict_charts(triangle_surface(case.V, case.F, case.seams))[0]
    mass = vertex_areas(chart.vertices, chart.triangles)

    def ours():
        conformal = drain(conformal_disk(chart.vertices, chart.triangles))
        return conformal, drain(transport(conformal.uv, mass, Disk()))

    (conformal, moved), seconds = median_of(args.runs, ours)
    reference = _median_rival(case, REFERENCE, args.runs).processor_seconds
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


def profile_part(args):
    rows = []
    for case in map(load_case, available(args.models)):
        for boundary in args.boundaries:
            for preset in args.presets:
                try:
                    start = time.perf_counter()  # the stages of a report are in wall-clock time
                    _, result = our_uv(case, boundary, preset)
                    seconds = time.perf_counter() - start
                except MeshError as error:
                    print(f"{case.name} {preset} {boundary}: {error}", file=sys.stderr)
                    continue
                rows.append((case, f"{preset} {boundary}", seconds, result.report()[0]))
    stages = list(dict.fromkeys(stage for *_, report in rows for stage in report["seconds"]))
    steps = ["newton_conformal", "newton_transport"]
    table = Table(
        "Seconds per stage (wall), Newton steps, warnings",
        {"model": 15, "method": 16, "total": 8}
        | {s: max(8, len(s)) for s in stages}
        | {s: len(s) for s in steps}
        | {"warnings": 20},
    )
    for case, method, seconds, report in rows:
        table.add(
            model=case.name,
            method=method,
            total=seconds,
            warnings="; ".join(report["warnings"]),
            **report["seconds"],
            **{s: report.get(s, "") for s in steps},
        )
    return table


def memory_part(args):
    """A child process per preset, so that its peak is its own."""
    table = Table("Peak memory of the unwrap of about 100,000 faces", {"method": 16, "peak MiB": 9, "missed goals": 20})
    for preset in args.presets:
        command = [sys.executable, __file__, "--peak", preset]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        peak = int(done.stdout.split()[-1])
        table.add(
            method=f"{preset} free",
            **{"peak MiB": peak // 2**20, "missed goals": "memory" if peak > PEAK_GOAL else ""},
        )
    return table


def print_peak(preset):
    import meshes

    V, F = meshes.bumpy(224, 224, height=0.3)
    drain(unwrap(triangle_surface(V, F), boundary="free", quality=preset))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)


def magnify(args):
    from magnify import magnify_part

    return magnify_part(args)


def cascade(args):
    from cascade import cascade_part

    return cascade_part(args)


def saliency(args):
    from saliency import saliency_part

    return saliency_part(args)


def speed(name):
    def part(args):
        import speed

        return getattr(speed, f"{name}_part")(args)

    return part


def remesh(args):
    from remesh import remesh_part

    return remesh_part(args)


def latency(args):
    from latency import latency_part

    return latency_part(args)


def sphere(args):
    from sphere import sphere_part

    return sphere_part(args)


PARTS = {
    "transport": transport_part,
    "lion": lion_part,
    "unwrap": unwrap_part,
    "profile": profile_part,
    "memory": memory_part,
    "counts": speed("counts"),
    "growth": speed("growth"),
    "islands": speed("islands"),
    "magnify": magnify,
    "cascade": cascade,
    "saliency": saliency,
    "latency": latency,
    "sphere": sphere,
    "remesh": remesh,
}


def describe_machine():
    import bpy

    return (
        f"Blender {bpy.app.version_string}, Python {platform.python_version()}, numpy {np.__version__}, "
        f"scipy {scipy.__version__}, {os.cpu_count()} cores, {platform.system()}; medians of processor seconds"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"any of {', '.join(PARTS)}; default all but profile")
    parser.add_argument("--models", nargs="+", metavar="NAME", help="default all models at hand")
    parser.add_argument("--presets", nargs="+", choices=PRESETS, default=PRESETS)
    parser.add_argument("--boundaries", nargs="+", choices=BOUNDARIES, default=BOUNDARIES)
    parser.add_argument("--methods", nargs="+", metavar="NAME", help="rivals to unwrap with; default all")
    parser.add_argument(
        "--runs", type=int, default=3, help="per figure; without --methods, meshes of 20,000 faces and more run once"
    )
    parser.add_argument("--sizes", nargs="+", type=int, metavar="N", help="for latency: heads of N * N vertices")
    parser.add_argument("--faces", type=int, default=300_000, help="for growth: the most")
    parser.add_argument("--sites", nargs="+", type=int, default=[10_000, 100_000], help="for transport")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "benchmarks", help="folder for the TSV files")
    parser.add_argument("--peak", choices=PRESETS, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.peak:
        print_peak(args.peak)
        return
    unknown = set(args.parts) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}")
    print(describe_machine())
    for part in args.parts or [p for p in PARTS if p != "profile"]:
        PARTS[part](args).write(args.out / f"{part}.tsv")


if __name__ == "__main__":
    main()
