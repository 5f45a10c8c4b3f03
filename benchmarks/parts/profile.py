"""Tell where our time goes, stage by stage, in wall-clock seconds of one run."""

from __future__ import annotations

import sys
import time

from benchmarks.cases import available, load_case, our_uv
from benchmarks.part import BOUNDARY, MODELS, PRESET, Part
from benchmarks.tables import Table
from omt_uv.solver.errors import MeshError

STEPS = ("newton_conformal", "newton_transport")


def profile_table(args) -> Table:
    """Seconds of every stage that a report names, Newton steps, and warnings."""
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
    table = Table(
        "Seconds per stage (wall), Newton steps, warnings",
        {"model": 15, "method": 16, "total": 8}
        | {s: max(8, len(s)) for s in stages}
        | {s: len(s) for s in STEPS}
        | {"warnings": 20},
    )
    for case, method, seconds, report in rows:
        table.add(
            model=case.name,
            method=method,
            total=seconds,
            warnings="; ".join(report["warnings"]),
            **report["seconds"],
            **{s: report.get(s, "") for s in STEPS},
        )
    return table


PARTS = (
    Part("profile", "where our time goes, stage by stage; only where it is named", profile_table,
         (MODELS, BOUNDARY, PRESET), by_default=False),
)  # fmt: skip
