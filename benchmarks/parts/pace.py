"""Measure how long work takes beside what else could be done: small maps, limbs, the slider, and millions of faces.

usage: python -m benchmarks.parts.pace FACES     what the process of a million faces runs; prints seconds and MiB
"""

from __future__ import annotations

import itertools
import subprocess
import sys
from typing import Any

import bpy

import meshes
import numpy as np

from benchmarks import ROOT
from benchmarks.cases import Case, available, load_case, our_uv
from benchmarks.part import BOUNDARY, MODELS, RUNS, Option, Part
from benchmarks.parts.remesh import distances, missed_bars, shape
from benchmarks.rivals import median_unwrap, remove_object
from benchmarks.tables import Table, missed
from benchmarks.timing import median_of, peak_mib, timed
from omt_uv.solver.editing.live_map import LiveMap
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import RemeshSource, remesh

FAST = "Minimum Stretch 10"
# Beside the models of other parts: what else is a disk, or one closed body that a seam makes a disk.
ALSO = ["cow", "bunny_small", "david", "rocker_arm", "fertility", "three_holes"]
ALSO += ["optcuts_bimba_i", "optcuts_bunny_i", "optcuts_face", "optcuts_lion_o", "optcuts_max_planck_i"]
LEAST_FACES = 1500
PACE_GOAL = 1.0  # times the time of FAST, each
MEDIAN_GOAL = 0.6  # and the median of all
LIMBS = Option("triangles", 100_000, "least faces of the bodies of the part limbs", {"type": int})
LIMBS_VERTICES = 5000
LIMBS_GOAL = 5.0  # times the time of the unwrap
MOST_LEVELS = 7
MILLION = Option("million", 1_000_000, "faces of the part million, at least", {"type": int})
MILLION_GOALS = {"time": 45.0, "peak MiB": 2560}
LIVE_SIDES = {100: 0.1, 224: 0.3}  # vertices along a side of the head, and seconds a step may take
LIVE_STEPS = 11  # of a twentieth of the slider each


def pace_table(args) -> Table:
    """Plain unwraps beside Minimum Stretch with ten iterations, and the median of what was asked for."""
    table = Table(
        f"Standard maps; ratio = time / time of {FAST}; * is cut along a fixed seam",
        {"model": 20, "faces": 8, "boundary": 8, "Newton": 7, "area_l1": 9, "angle_mean": 10, "folds": 5, "time": 8}
        | {"ratio": 7, "missed goals": 20},
    )
    ratios: list[float] = []
    more = [] if args.models else [name for name in ALSO if meshes.model_path(name)]
    for case in map(load_case, available(args.models) + more):
        if len(case.F) < LEAST_FACES:
            continue
        unit = median_unwrap(case, FAST, args.runs).processor_seconds
        for boundary in args.boundaries:
            (_, result), seconds = median_of(args.runs, lambda c=case, b=boundary: our_uv(c, b, "standard"))
            report, ratio = result.report()[0], seconds / unit
            ratios.append(ratio)
            figures = {k: report[k] for k in ("area_l1", "angle_mean", "folds")}
            head = {
                "model": case.name,
                "faces": len(case.F),
                "boundary": boundary,
                "Newton": report["newton_refinement"],
            }
            table.add(**head, **figures, time=seconds, ratio=ratio, **missed(time=ratio > PACE_GOAL))
    middle = float(np.median(ratios))
    table.add(model="median", ratio=middle, **missed(time=middle > MEDIAN_GOAL))
    return table


# Where limbs go, as points one after another, with the radius of each.
LIMB_BODIES: dict[str, Any] = {
    "quadruped": [
        [(-1, 0, 0, 0.25), (1, 0, 0, 0.25), (1.5, 0, 0.5, 0.15)],
        [(-1, 0, 0, 0.25), (-1.6, 0, 0.3, 0.05)],
        *([(x, 0, 0, 0.25), (x, 0.35 * s, -0.6, 0.1), (x, 0.38 * s, -1.4, 0.07)] for x in (-1, 1) for s in (-1, 1)),
    ],
    "hand": [
        [(0, 0, -0.8, 0.3), (0, 0, 0, 0.3)],
        *([(0, 0, 0, 0.3), (x, 0, 0.5, 0.12), (1.4 * x, 0, 1.1, 0.09)] for x in (-0.45, -0.15, 0.15, 0.45)),
        [(0, 0, 0, 0.3), (0.6, 0, 0, 0.12), (0.9, 0, 0.3, 0.09)],
    ],
    "tree": [
        [(0, 0, 0, 0.2), (0, 0, 1, 0.15), (0, 0, 2, 0.08)],
        *([(0, 0, 1, 0.15), (x, y, 1.5, 0.08), (1.6 * x, 1.6 * y, 2.1, 0.04)] for x, y in ((0.6, 0), (-0.5, 0.4))),
        *([(0, 0, 2, 0.08), (x, y, 2.4, 0.05), (2 * x, 2 * y, 2.9, 0.03)] for x, y in ((0.3, 0.2), (-0.3, 0.1))),
    ],
    "octopus": [
        [(0, 0, 0, 0.5), (0, 0, 0.7, 0.4)],
        *(
            [(0, 0, 0, 0.5)]
            + [
                (
                    0.7 * j * np.cos(t + 0.1 * j),
                    0.7 * j * np.sin(t + 0.1 * j),
                    -0.15 * j + 0.05 * j * j,
                    0.18 - 0.035 * j,
                )
                for j in range(1, 5)
            ]
            for t in np.arange(8) * np.pi / 4
        ),
    ],
}


def limb_body(name: str, faces: int) -> tuple[np.ndarray, np.ndarray]:
    """A body of LIMB_BODIES, V (n,3), F (m,3) of at least `faces` triangles, by Blender's Skin and Subdivision."""
    places = {point: k for k, point in enumerate(dict.fromkeys(p for limb in LIMB_BODIES[name] for p in limb))}
    edges = [(places[a], places[b]) for limb in LIMB_BODIES[name] for a, b in itertools.pairwise(limb)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([point[:3] for point in places], sorted(set(edges)), [])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    obj.modifiers.new("Skin", "SKIN")
    for skin, point in zip(mesh.skin_vertices[0].data, places, strict=True):
        skin.radius = (point[3], point[3])
    mesh.skin_vertices[0].data[0].use_root = True
    smooth = obj.modifiers.new("Subdivision", "SUBSURF")
    for smooth.levels in range(1, MOST_LEVELS):
        found = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        found.calc_loop_triangles()
        if len(found.loop_triangles) >= faces:
            break
    V, F = np.empty(3 * len(found.vertices), np.float32), np.empty(3 * len(found.loop_triangles), np.int32)
    found.vertices.foreach_get("co", V)
    found.loop_triangles.foreach_get("vertices", F)
    remove_object(obj)
    used, place = np.unique(F, return_inverse=True)
    return V.reshape(-1, 3)[used].astype(float), place.reshape(-1, 3).astype(np.int64)


def limbs_table(args) -> Table:
    """Thin bodies of Blender's Skin modifier, remeshed, beside their unwraps."""
    table = Table(
        f"Thin bodies remeshed to {LIMBS_VERTICES} vertices; ratio = time / time of the unwrap",
        {"model": 12, "faces": 8, "angle_p1": 8, "below 30 %": 10, "edge_cv": 8, "area_cv": 8, "hausdorff": 9, "rms": 9}
        | {"time": 8, "ratio": 7, "missed goals": 20},
    )
    for name in args.models or LIMB_BODIES:
        V, F = limb_body(name, args.triangles)
        result, seconds = timed(lambda V=V, F=F: drain(remesh(RemeshSource(V, F), LIMBS_VERTICES)))
        _, unit = timed(lambda V=V, F=F: drain(unwrap(triangle_surface(V, F))))
        W, G = result.vertices, result.triangles
        row = {**shape(W, G), **distances(V, F, W, G), "time": seconds, "ratio": seconds / unit}
        table.add(model=name, faces=len(F), **row, **missed(**missed_bars(row), time=seconds > LIMBS_GOAL * unit))
    return table


def live_table(args) -> Table:
    """Steps of the slider from area to angle, the UVs followed to the end each time."""
    table = Table(
        "Seconds of processor time in which UVs follow one step of the slider, and until they first do",
        {"faces": 8, "first": 8, "mean": 8, "longest": 8, "missed goals": 20},
    )
    for side, goal in LIVE_SIDES.items():
        V, F = meshes.head(side)
        _, result = our_uv(Case("head", V, F, np.zeros((0, 2), np.int64)), "free", "draft")
        chart, uv = result.charts[0], result.maps[0].uv
        live, first = timed(lambda c=chart, u=uv: LiveMap(c.vertices, c.triangles, u))
        steps = [timed(lambda b=balance, m=live: m.follow(b, seconds=0.0))[1] for balance in np.arange(LIVE_STEPS) / 20]
        late = {"live": max(steps) > goal}
        table.add(faces=len(F), first=first, mean=float(np.mean(steps)), longest=max(steps), **missed(**late))
    return table


def million_table(args) -> Table:
    """One free Standard map of a subdivided lion, or of a procedural surface, in a process of its own."""
    table = Table(
        "A million faces",
        {"faces": 8, "time": 8, "peak MiB": 9, "Newton": 7, "area_l1": 9, "angle_mean": 10, "folds": 5}
        | {"missed goals": 20},
    )
    command = [sys.executable, "-m", __name__, str(args.million)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    faces, seconds, peak, steps, l1, angle, folds = map(float, done.stdout.split()[-7:])
    row = {"faces": int(faces), "time": seconds, "peak MiB": int(peak), "Newton": int(steps), "area_l1": l1}
    late = {name: row[name] > goal for name, goal in MILLION_GOALS.items()}
    table.add(**row, angle_mean=angle, folds=int(folds), **missed(**late))
    return table


def print_million(faces: int) -> None:
    """Unwrap a surface of so many faces and print faces, seconds, MiB, Newton steps, area_l1, angle_mean and folds."""
    case = load_case(available(["lion"] if meshes.model_path("lion") else ["bumpy"])[0])
    V, F = case.V, case.F
    while len(F) < faces:
        V, F = meshes.subdivide(V, F)
    options = UnwrapOptions("free", "standard")
    result, seconds = timed(lambda: drain(unwrap(triangle_surface(V, F), options=options)))
    report = result.report()[0]
    figures = (report[k] for k in ("newton_refinement", "area_l1", "angle_mean", "folds"))
    print(len(F), seconds, peak_mib(), *figures)


PARTS = (
    Part("pace", f"plain unwraps beside {FAST}, and their median", pace_table, (MODELS, BOUNDARY, RUNS), False),
    Part("limbs", "thin bodies remeshed, beside their unwraps", limbs_table, (MODELS, LIMBS), False),
    Part("live", "steps of the slider between area and angle, in processor seconds", live_table, (), False),
    Part("million", "a million faces: time and memory", million_table, (MILLION,), False),
)

if __name__ == "__main__":
    print_million(int(sys.argv[1]))
