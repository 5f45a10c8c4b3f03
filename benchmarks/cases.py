"""Load what every benchmark works on: a mesh, with the seams that make it one disk; and unwrap it by our pipeline."""

from __future__ import annotations

from dataclasses import dataclass, replace

import meshes
import numpy as np

from benchmarks.seams import cut_seams
from omt_uv.solver.mesh.surface import Surface, triangle_surface
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

CUT_MODELS = ["max_planck", "spot", "homer", "bunny", "stanford_bunny", "armadillo"]
MODELS = meshes.DISK_MODELS + CUT_MODELS
# Where no model is at hand.
STAND_INS = ["bumpy", "hemisphere", "comb", "head", "icosphere"]


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


def polygon_model(name: str) -> Surface:
    """A published model with its polygons, its positions in single precision as Blender holds them: where a search of
    seams ends can hang on their last digits."""
    surface = meshes.polygon_surface(*meshes.load_polygons(name))
    return replace(surface, positions=surface.positions.astype(np.float32).astype(float))


def available(names=None) -> list[str]:
    """The names asked for, by default all models at hand, or procedural stand-ins where there is none."""
    if names:
        return list(names)
    return [n for n in MODELS if meshes.model_path(n)] or STAND_INS


def our_uv(case: Case, boundary, quality, balance=0.0):
    """Corner UVs (m,3,2) by our pipeline, and its result."""
    surface = triangle_surface(case.V, case.F, case.seams)
    result = drain(unwrap(surface, options=UnwrapOptions(boundary, quality, balance)))
    corners, uv = result.corner_uv()
    full = np.zeros((3 * len(case.F), 2))
    full[corners] = uv
    return full.reshape(-1, 3, 2), result
