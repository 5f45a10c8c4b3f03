"""Time and memory of meshes whose shape or number is hard on solvers, next to Blender's Angle Based.

usage: python -m benchmarks.parts.hard ours|rival NAME     what the processes run; prints seconds and MiB
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import hard_meshes
import numpy as np

from benchmarks import ROOT
from benchmarks.part import Option, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import peak_mib, timed

# Goals: so many times the seconds of Angle Based and so many more, and so many MiB.
TIMES = 10
MORE = 5.0
PEAK_GOAL = 1024
# Seconds of wall clock after which a process is ended.
LONGEST = 900
# Objects of the call with many, and quads along their sides.
OBJECTS = 500
SIDE = 4

HARD: dict[str, Callable[[], tuple[np.ndarray, np.ndarray]]] = {
    "strip 16,000": lambda: hard_meshes.strip(16_000),
    "strip 50,000": lambda: hard_meshes.strip(50_000),
    "fan 20,000": lambda: hard_meshes.fan(20_000),
    "fan 1,000,000": lambda: hard_meshes.fan(1_000_000),
    "pieces 20,000": lambda: hard_meshes.pieces(20_000),
    "objects 500": lambda: hard_meshes.terrain(SIDE),
    "269 holes": lambda: hard_meshes.percolation(64, 0.12),
    "slivers 100,000": lambda: hard_meshes.sliver_sphere(100_000),
    "terrain 1000": lambda: hard_meshes.terrain(1000),
    "sponge 3": lambda: hard_meshes.sponge(3),
    "voxels": hard_meshes.voxel_blob,
    "klein bottle": hard_meshes.klein_bottle,
}
MESHES = Option("hard", tuple(HARD), "default all", {"nargs": "+", "metavar": "MESH", "choices": tuple(HARD)})


def hard_table(args) -> Table:
    """Seconds of both, and our share of what is allowed."""
    columns = {"mesh": 16, "seconds": 8, "angle based": 11, "of allowed": 10, "peak MiB": 9, "missed goals": 20}
    table = Table(f"Hard meshes: {TIMES} times Angle Based and {MORE:.0f} s, {PEAK_GOAL} MiB", columns)
    for name in args.hard:
        rival, ours = _measured("rival", name), _measured("ours", name)
        allowed = TIMES * rival[0] + MORE
        table.add(
            mesh=name,
            seconds=ours[0],
            **{"angle based": rival[0], "of allowed": ours[0] / allowed, "peak MiB": ours[1]},
            **missed(time=ours[0] > allowed, memory=ours[1] > PEAK_GOAL),
        )
    return table


def _measured(who: str, name: str) -> tuple[float, float]:
    """Processor seconds and peak MiB of a process; infinite where it came to no end."""
    command = [sys.executable, "-m", __name__, who, name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, timeout=LONGEST)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
        return np.inf, np.inf
    seconds, peak = done.stdout.split()[-2:]
    return float(seconds), float(peak)


def print_ours(name: str) -> None:
    """Unwrap and pack one of the meshes, and print the seconds of that and the peak of this process."""
    from omt_uv.pipelines.layout import UnwrapJob
    from omt_uv.pipelines.unwrap import lay_out
    from omt_uv.settings import Settings
    from omt_uv.solver.progress import drain

    surface = hard_meshes.surface(*HARD[name]())
    jobs = [UnwrapJob(surface)] * (OBJECTS if name.startswith("objects") else 1)
    _, seconds = timed(lambda: drain(lay_out(jobs, Settings())))
    print(seconds, peak_mib())


def print_rival(name: str) -> None:
    """The same of Blender's Angle Based."""
    import bpy

    from benchmarks import rivals

    V, polygons = HARD[name]()
    first = rivals.make_object(V, polygons)
    for _ in range(OBJECTS - 1 if name.startswith("objects") else 0):
        other = first.copy()
        other.data = first.data.copy()
        bpy.context.collection.objects.link(other)
        other.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    _, seconds = timed(lambda: bpy.ops.uv.unwrap(method="ANGLE_BASED", fill_holes=True, margin=0.0))
    print(seconds, peak_mib())


PARTS = (Part("hard", "hard meshes: time next to Angle Based, peak memory", hard_table, (MESHES,), by_default=False),)

if __name__ == "__main__":
    {"ours": print_ours, "rival": print_rival}[sys.argv[1]](sys.argv[2])
