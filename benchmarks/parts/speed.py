"""What speed rests on: counts that are the same on every machine, growth with the size of a mesh, and many islands."""

from __future__ import annotations

import resource

import numpy as np
from cases import Case, Table, available, load_case, our_uv, timed  # first: it finds the modules below
from counting import counted
from meshes import bumpy, subdivide

from omt_uv.solver.maps.distortion import distortion

GROWTH_GOAL, ISLANDS_GOAL, ISLANDS = 1.25, 2.0, 1000
COUNTS = ("newton_conformal", "newton_transport", "newton_refinement")


def counts_part(args) -> Table:
    """Newton steps, factorisations and nonzeros of an unwrap. Only these are asserted in tests."""
    columns = {"Newton conformal": 16, "Newton transport": 16, "Newton refinement": 17, "factorisations": 14}
    table = Table(
        "Counts of one unwrap, Standard",
        {"model": 15, "faces": 8, "boundary": 8} | columns | {"nonzeros": 10, "cycles": 7},
    )
    for case in map(load_case, available(args.models)):
        for boundary in args.boundaries:
            with counted() as tally:
                _, result = our_uv(case, boundary, "standard")
            report = result.report()[0]
            newton = {k.replace("newton_", "Newton "): str(report[k]) for k in COUNTS}
            table.add(model=case.name, faces=len(case.F), boundary=boundary, **newton, **vars(tally))
    return table


def growth_part(args) -> Table:
    """The time of a free Standard unwrap of the same surface, subdivided again and again, and its exponent."""
    columns = {"Newton": 7, "area_l1": 9, "angle_mean": 10, "folds": 5, "time": 8, "peak MiB": 9, "exponent": 8}
    table = Table(
        "Growth: time ~ vertices ^ exponent, fitted over all sizes so far; peak of the process so far",
        {"model": 15, "faces": 8, "vertices": 8} | columns | {"missed goals": 20},
    )
    for name in args.models or available(["lion", "face"]):
        case, sizes, times = load_case(name), [], []
        while len(case.F) <= args.faces:
            (uv, result), seconds = timed(lambda c=case: our_uv(c, "free", "standard"))
            d, report = distortion(case.V, case.F, uv, overlap=False), result.report()[0]
            sizes.append(np.log(len(case.V)))
            times.append(np.log(seconds))
            exponent = np.polyfit(sizes, times, 1)[0] if len(sizes) > 1 else ""
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
            missed = "growth" if len(sizes) > 1 and exponent > GROWTH_GOAL else ""
            found = {"area_l1": d.area_l1, "angle_mean": d.angle_mean, "folds": d.folds, "Newton": report[COUNTS[2]]}
            table.add(
                model=case.name,
                faces=len(case.F),
                vertices=len(case.V),
                **found,
                time=seconds,
                exponent=exponent,
                **{"peak MiB": peak, "missed goals": missed},
            )
            case = Case(case.name, *subdivide(case.V, case.F), case.seams)
    return table


def islands(count: int) -> Case:
    """Wavy squares of 128 faces, every one different, side by side."""
    V, F = bumpy(8, 8, height=0.3)
    rng = np.random.default_rng(0)
    positions = np.tile(V, (count, 1, 1))
    waves, phase = rng.normal(0, 4, (count, 2)), 2 * np.pi * rng.random(count)
    positions[:, :, 2] += 0.15 * np.sin(positions[:, :, :2] @ waves[:, :, None] + phase[:, None, None])[:, :, 0]
    positions[:, :, 0] += 3 * (np.arange(count) % 40)[:, None]
    positions[:, :, 1] += 3 * (np.arange(count) // 40)[:, None]
    faces = F + len(V) * np.arange(count)[:, None, None]
    return Case(f"{count} islands", positions.reshape(-1, 3), faces.reshape(-1, 3), np.zeros((0, 2), np.int64))


def islands_part(args) -> Table:
    """Many small islands, without packing, against Minimum Stretch."""
    from rivals import unwrap as rival

    table = Table(
        "Many small islands; ratio = time / time of Minimum Stretch 10",
        {"model": 15, "faces": 8, "method": 20, "area_l1": 9, "angle_mean": 10, "folds": 5, "time": 8, "ratio": 7}
        | {"missed goals": 20},
    )
    case = islands(ISLANDS)
    found = {m: rival(case.V, case.F, case.seams, m) for m in ("Minimum Stretch 10", "Minimum Stretch 50")}
    rows = [(m, r.uv, r.processor_seconds) for m, r in found.items()]
    (ours, _), time = timed(lambda: our_uv(case, "free", "standard"))
    for method, uv, seconds in [*rows, ("ours standard free", ours, time)]:
        d = distortion(case.V, case.F, uv, overlap=False)
        ratio = seconds / rows[0][2]
        missed = "time" if method.startswith("ours") and ratio > ISLANDS_GOAL else ""
        figures = {"area_l1": d.area_l1, "angle_mean": d.angle_mean, "folds": d.folds, "time": seconds, "ratio": ratio}
        table.add(model=case.name, faces=len(case.F), method=method, **figures, **{"missed goals": missed})
    return table
