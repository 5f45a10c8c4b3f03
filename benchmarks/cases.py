"""What every benchmark shares: where the modules and models are, the cases, and tables."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # processor time is only comparable when one thread does the work
ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

import meshes
import numpy as np
from seams import cut_seams

from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

CUT_MODELS = ["max_planck", "spot", "homer", "bunny", "stanford_bunny", "armadillo"]
MODELS = meshes.DISK_MODELS + CUT_MODELS


@dataclass(frozen=True)
class Case:
    """A mesh and the seams that make it one disk; `name` ends in * where it was cut."""

    name: str
    V: np.ndarray
    F: np.ndarray
    seams: np.ndarray


def load_case(name: str) -> Case:
    """A published model by name, or a procedural mesh where no model has that name."""
    if meshes.model_path(name) is None and not hasattr(meshes, name):
        raise SystemExit(f"no model {name} in {meshes.models_folder()}: set OMT_UV_MODELS")
    V, F = meshes.load_model(name) if meshes.model_path(name) else getattr(meshes, name)()
    seams = cut_seams(V, F)
    return Case(name + "*" * bool(len(seams)), V, F, seams)


def available(names=None) -> list[str]:
    """The names asked for, by default all models at hand, or procedural stand-ins where there are none."""
    if names:
        return list(names)
    return [n for n in MODELS if meshes.model_path(n)] or ["bumpy", "hemisphere", "comb", "head", "icosphere"]


def timed(work):
    """The result of `work()` and its processor seconds."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def our_uv(case: Case, boundary, quality, balance=0.0):
    """Corner UVs (m,3,2) by our pipeline, and its result."""
    surface = triangle_surface(case.V, case.F, case.seams)
    result = drain(unwrap(surface, boundary=boundary, quality=quality, balance=balance))
    corners, uv = result.corner_uv()
    full = np.zeros((3 * len(case.F), 2))
    full[corners] = uv
    return full.reshape(-1, 3, 2), result


class Table:
    """Rows printed as they come, and written as TSV at the end."""

    def __init__(self, title: str, columns: dict[str, int]):
        self.columns, self.rows = columns, []
        print(f"\n{title}\n" + self._line(columns), flush=True)

    def add(self, **row):
        self.rows.append([_text(row.get(c, "")) for c in self.columns])
        print(self._line(self.rows[-1]), flush=True)

    def _line(self, cells):
        return "  ".join(
            cell.ljust(w) if w > 14 else cell.rjust(w) for cell, w in zip(cells, self.columns.values(), strict=True)
        ).rstrip()

    def write(self, path: Path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join("\t".join(r) for r in [list(self.columns), *self.rows]) + "\n")
        print(f"written to {path}")


def _text(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)
