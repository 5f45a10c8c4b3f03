"""Measure the peak memory of the unwrap of about 100,000 faces, each in a process of its own.

usage: python -m benchmarks.parts.memory PRESET     what the processes run; prints MiB
"""

from __future__ import annotations

import subprocess
import sys

from benchmarks import ROOT
from benchmarks.part import PRESET, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import peak_mib
from omt_uv.solver.parameterization.options import UnwrapOptions

PEAK_GOAL = 2048  # MiB
SIDE = 224  # squares along a side: 100,352 faces


def memory_table(args) -> Table:
    """Peak memory by preset."""
    table = Table("Peak memory of the unwrap of about 100,000 faces", {"method": 16, "peak MiB": 9, "missed goals": 20})
    for preset in args.presets:
        command = [sys.executable, "-m", __name__, preset]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
        peak = int(done.stdout.split()[-1])
        table.add(method=f"{preset} free", **{"peak MiB": peak}, **missed(memory=peak > PEAK_GOAL))
    return table


def print_peak(preset) -> None:
    """Unwrap and print the peak of this process in MiB."""
    import meshes

    from omt_uv.solver.mesh.surface import triangle_surface
    from omt_uv.solver.parameterization.unwrap import unwrap
    from omt_uv.solver.progress import drain

    V, F = meshes.bumpy(SIDE, SIDE, height=0.3)
    drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(quality=preset)))
    print(peak_mib())


PARTS = (Part("memory", "peak memory of the unwrap of 100,000 faces", memory_table, (PRESET,)),)

if __name__ == "__main__":
    print_peak(sys.argv[1])
