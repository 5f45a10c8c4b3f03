"""Show what speed rests on: counts that are the same on every machine, growth with the size of a mesh, many islands."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from meshes import bumpy, subdivide
from work import counted_work

from benchmarks import rivals
from benchmarks.cases import Case, available, load_case, our_uv
from benchmarks.part import BOUNDARY, MODELS, RUNS, Option, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import median_of, peak_mib, timed
from omt_uv.solver.maps.distortion import distortion

FACES = Option("faces", 300_000, "the most that a surface is subdivided to", {"type": int})
NEWTON_STEPS = ("newton_conformal", "newton_transport", "newton_refinement")  # of a chart's report
GROWTH_GOAL = 1.25  # exponent of time by vertices
ISLANDS = 1000
ISLANDS_GOAL = 2.0  # times the time of Minimum Stretch 10
ISLANDS_A_ROW = 40
ISLANDS_APART = 3.0  # of squares of side 1
DRAFT_GOAL = 0.4  # times the time of Standard
DRAFT_AREAS = 0.05
DRAFTED = ("lion", "face", "max_planck", "bunny")
STARTUP_GOAL = 1.5  # times the time of importing Blender
STARTUP_SIDE = 22  # squares along a side: 968 triangles


def counts_table(args) -> Table:
    """Newton steps, factorisations and nonzeros of an unwrap. Only these are asserted in tests."""
    columns = {"Newton conformal": 16, "Newton transport": 16, "Newton refinement": 17, "factorisations": 14}
    table = Table(
        "Counts of one unwrap, Standard",
        {"model": 15, "faces": 8, "boundary": 8} | columns | {"nonzeros": 10, "cycles": 7},
    )
    for case in map(load_case, available(args.models)):
        for boundary in args.boundaries:
            with counted_work() as work:
                _, result = our_uv(case, boundary, "standard")
            report = result.report()[0]
            newton = {k.replace("newton_", "Newton "): str(report[k]) for k in NEWTON_STEPS}
            table.add(model=case.name, faces=len(case.F), boundary=boundary, **newton, **vars(work))
    return table


def growth_table(args) -> Table:
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
            sizes.append(np.log(len(case.V)))
            times.append(np.log(seconds))
            exponent = float(np.polyfit(sizes, times, 1)[0]) if len(sizes) > 1 else None
            table.add(
                model=case.name,
                faces=len(case.F),
                vertices=len(case.V),
                Newton=result.report()[0]["newton_refinement"],
                **_figures(case, uv),
                time=seconds,
                exponent="" if exponent is None else exponent,
                **{"peak MiB": peak_mib()},
                **missed(growth=exponent is not None and exponent > GROWTH_GOAL),
            )
            V, F = subdivide(case.V, case.F)
            case = Case(case.name, V, F, case.seams)
    return table


def _figures(case, uv):
    d = distortion(case.V, case.F, uv, overlap=False)
    return {"area_l1": d.area_l1, "angle_mean": d.angle_mean, "folds": d.folds}


def islands(count: int) -> Case:
    """Wavy squares of 128 faces, every one different, side by side."""
    V, F = bumpy(8, 8, height=0.3)
    rng = np.random.default_rng(0)
    positions = np.tile(V, (count, 1, 1))
    waves, phase = rng.normal(0, 4, (count, 2)), 2 * np.pi * rng.random(count)
    positions[:, :, 2] += 0.15 * np.sin(positions[:, :, :2] @ waves[:, :, None] + phase[:, None, None])[:, :, 0]
    positions[:, :, 0] += ISLANDS_APART * (np.arange(count) % ISLANDS_A_ROW)[:, None]
    positions[:, :, 1] += ISLANDS_APART * (np.arange(count) // ISLANDS_A_ROW)[:, None]
    faces = F + len(V) * np.arange(count)[:, None, None]
    return Case(f"{count} islands", positions.reshape(-1, 3), faces.reshape(-1, 3), np.zeros((0, 2), np.int64))


def islands_table(args) -> Table:
    """Many small islands, without packing, against Minimum Stretch."""
    table = Table(
        "Many small islands; ratio = time / time of Minimum Stretch 10",
        {"model": 15, "faces": 8, "method": 20, "area_l1": 9, "angle_mean": 10, "folds": 5, "time": 8, "ratio": 7}
        | {"missed goals": 20},
    )
    case = islands(ISLANDS)
    found = {m: rivals.median_unwrap(case, m) for m in ("Minimum Stretch 10", "Minimum Stretch 50")}
    rows = [(m, r.uv, r.processor_seconds) for m, r in found.items()]
    (ours, _), time = timed(lambda: our_uv(case, "free", "standard"))
    for method, uv, seconds in [*rows, ("ours standard free", ours, time)]:
        ratio = seconds / rows[0][2]
        figures = _figures(case, uv) | {"time": seconds, "ratio": ratio}
        slow = method.startswith("ours") and ratio > ISLANDS_GOAL
        table.add(model=case.name, faces=len(case.F), method=method, **figures, **missed(time=slow))
    return table


def draft_table(args) -> Table:
    """Draft beside Standard: its areas, its folds, and its share of the time."""
    table = Table(
        "Draft beside Standard; ratio = time / time of Standard",
        {"model": 15, "faces": 8, "boundary": 8, "preset": 9, "area_l1": 9, "angle_mean": 10, "folds": 5, "time": 8}
        | {"ratio": 7, "missed goals": 20},
    )
    for case in map(load_case, args.models or available(DRAFTED)):
        for boundary in args.boundaries:
            unit = None
            for preset in ("standard", "draft"):
                (uv, _), seconds = median_of(args.runs, lambda c=case, b=boundary, p=preset: our_uv(c, b, p))
                figures, unit = _figures(case, uv), unit or seconds
                goals = {} if preset == "standard" else _draft_goals(figures, seconds / unit)
                head = {"model": case.name, "faces": len(case.F), "boundary": boundary, "preset": preset}
                table.add(**head, **figures, time=seconds, ratio=seconds / unit, **missed(**goals))
    return table


def _draft_goals(figures, ratio):
    """The goals of a draft by name, each with whether it is missed."""
    return {
        "time": ratio > DRAFT_GOAL,
        "areas": figures["area_l1"] > DRAFT_AREAS,
        "folds": figures["folds"] > 0,
    }


def startup_table(args) -> Table:
    """The command line on a small file, parent and child, beside importing Blender alone."""
    table = Table(
        "Processor seconds of whole processes; ratio = time / time of importing Blender",
        {"command": 30, "time": 8, "ratio": 7, "missed goals": 20},
    )
    with tempfile.TemporaryDirectory() as folder:
        source, out = Path(folder) / "in.obj", Path(folder) / "out.obj"
        V, F = bumpy(STARTUP_SIDE, STARTUP_SIDE, height=0.3)
        lines = ["v {} {} {}".format(*v) for v in V] + ["f {} {} {}".format(*(f + 1)) for f in F]
        source.write_text("\n".join(lines) + "\n")
        words = ["-m", "omt_uv", "unwrap", str(source), "-o", str(out)]
        commands = {"import bpy": ["-c", "import bpy"], "unwrap --max-shear 0": [*words, "--max-shear", "0"]}
        # The first run writes bytecode, as an installed package has it.
        _child_seconds([sys.executable, *words])
        unit = None
        for name, command in (commands | {"unwrap": words}).items():
            seconds = sorted(_child_seconds([sys.executable, *command]) for _ in range(args.runs))[args.runs // 2]
            unit = unit or seconds
            table.add(command=name, time=seconds, ratio=seconds / unit, **missed(time=seconds > STARTUP_GOAL * unit))
    return table


def _child_seconds(command: list[str]) -> float:
    """Processor seconds of a command and its children."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    subprocess.run(command, check=True, capture_output=True, env=kept)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


PARTS = (
    Part("counts", "Newton steps, factorisations and nonzeros of an unwrap: the same on every machine", counts_table,
         (MODELS, BOUNDARY)),
    Part("growth", "time of the same surface, subdivided again and again, and the exponent", growth_table,
         (MODELS, FACES)),
    Part("draft", "Draft beside Standard: areas, folds, and share of the time", draft_table, (MODELS, BOUNDARY, RUNS)),
    Part("startup", "the command line on a small file beside importing Blender", startup_table, (RUNS,)),
    Part("islands", "a thousand small islands against Minimum Stretch", islands_table),
)  # fmt: skip
