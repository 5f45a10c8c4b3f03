"""Divide every model at hand into equal cells: how exact, in how many pieces, how even, how long beside the first."""

from __future__ import annotations

import meshes
import numpy as np

from benchmarks.part import MODELS, Option, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from omt_uv.solver.partition.cut_mesh import cut_along_cells
from omt_uv.solver.partition.division import DivisionOptions, divide
from omt_uv.solver.partition.polar_coordinates import WindowMesh
from omt_uv.solver.partition.spacing import site_distances
from omt_uv.solver.progress import drain

CELLS = Option("cells", 200, "how many, or as many as there are parts", {"type": int})
RELAX = Option("relax", 5, "steps to the means of cells", {"type": int})
ERROR_GOAL = 1e-3
STEPS_GOAL = 20
SPACING_GOAL = 0.75
SECONDS_GOAL = 30.0
ENDINGS = (".obj", ".off")


def partition_table(args) -> Table:
    """Areas off, cells in several pieces, Newton steps in the end and of all, nearest pairs over the mean, seconds, and
    time for a face over that of the first model."""
    columns = {"model": 22, "faces": 7, "parts": 6, "cells": 6, "error": 9, "torn": 5, "Newton": 7, "all": 5}
    table = Table("Equal cells", columns | {"nearest": 8, "seconds": 8, "time": 6, "missed goals": 24})
    usual = 0.0
    for name in args.models or _models():
        V, F = meshes.load_model(name) if meshes.model_path(name) else getattr(meshes, name)()
        mesh = WindowMesh(V, F)
        count = len(np.unique(mesh.part[mesh.triangles]))
        cells = max(args.cells, count)
        options = DivisionOptions(relax=args.relax)
        division, seconds = timed(lambda a=V, b=F, c=cells, o=options: drain(divide(a, b, c, options=o)))
        usual = usual or seconds / len(F)
        torn = len(cut_along_cells(V, F, division).torn())
        near = site_distances(mesh, division)
        near = near[np.isfinite(near)]
        row = {"faces": len(F), "parts": count, "cells": cells, "error": division.residual, "torn": torn}
        row |= {"Newton": division.iterations, "all": division.steps, "nearest": float(near.min() / near.mean())}
        goals = {
            "error": division.residual > ERROR_GOAL,
            "steps": division.iterations > STEPS_GOAL,
            "torn": torn > 0,
            # Whole cells of small parts are smaller, and lie nearer.
            "nearest": count == 1 and args.relax >= RELAX.default and row["nearest"] < SPACING_GOAL,
            "seconds": seconds > SECONDS_GOAL,
        }
        table.add(model=name, seconds=seconds, time=seconds / len(F) / usual, **row, **missed(**goals))
    return table


def _models() -> list[str]:
    """All models of the folder, the smallest files first; a procedural one without any."""
    folder = meshes.models_folder()
    paths = [p for p in folder.iterdir() if p.suffix in ENDINGS] if folder.is_dir() else []
    return [p.stem for p in sorted(paths, key=lambda p: p.stat().st_size)] or ["icosphere"]


PARTS = (
    Part("partition", "equal cells on all models: error, pieces, Newton steps, spacing, time for a face",
         partition_table, (MODELS, CELLS, RELAX), by_default=False),
)  # fmt: skip
