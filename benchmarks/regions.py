"""What the benchmarks of magnification share: a region to magnify, and figures of a map against a density.

The figures are computed from corners alone, without the solver. Where the variable OMT_UV_JUDGE names a file with an
independent function `judge(V, F, uv)`, folds, overlap and area_l1 are its figures.
"""

from __future__ import annotations

import importlib.util
import os
from dataclasses import dataclass

import numpy as np

from omt_uv.solver.analysis.vertex_scores import distance
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import vertex_areas

SHARE, RIM = 0.05, 0.25


def ball(V, F, seed=1):
    """Weights (n,) of a geodesic ball with the given share of the area about a random vertex, and a soft rim."""
    d = distance(V, F, np.array([np.random.default_rng(seed).choice(np.unique(F))]))
    area = vertex_areas(V, F)
    order = np.argsort(d)
    radius = d[order[np.searchsorted(np.cumsum(area[order]) / area.sum(), SHARE)]]
    t = np.clip((radius * (1 + RIM) - d) / (2 * RIM * radius), 0, 1)
    return t * t * (3 - 2 * t)


def areas(triangles):
    """Areas (m,) of triangles (m,3,2) or (m,3,3), unsigned."""
    sides = triangles[:, 1:] - triangles[:, :1]
    gram = np.einsum("mik,mjk->mij", sides, sides)
    return 0.5 * np.sqrt(np.maximum(gram[:, 0, 0] * gram[:, 1, 1] - gram[:, 0, 1] ** 2, 0))


@dataclass(frozen=True)
class Figures:
    """share of the region; area_l1 of all faces against the density, and that of the faces of the region and of the
    others alone, each relative to their own target; folds; overlap."""

    share: float
    area_l1: float
    region: float
    context: float
    folds: int
    overlap: float


def figures(V, F, uv, density, weights) -> Figures:
    """Figures of corner UVs (m,3,2) of a surface against a density (m,), and of a region with weights (m,)."""
    has, target = areas(uv), areas(V[F]) * density
    has, target = has / has.sum(), target / target.sum()
    error = np.abs(has - target)
    # Every face belongs to one of them, those of the soft rim, too.
    region, context = (float(error[part].sum() / target[part].sum()) for part in (weights > 0.5, weights <= 0.5))
    judge = _judge()
    if judge is None:
        told = distortion(V, F, uv, density=density)
        return Figures(float(weights @ has), told.area_l1, region, context, told.folds, told.overlap)
    told = judge(V, F, uv)
    # It knows no densities: every face alone, and as large as it is meant to be.
    apart = (V[F] * np.sqrt(density)[:, None, None]).reshape(-1, 3)
    scaled = judge(apart, np.arange(3 * len(F)).reshape(-1, 3), uv)
    return Figures(float(weights @ has), scaled["area_l1"], region, context, told["folds"], told["overlap"])


def _judge():
    path = os.environ.get("OMT_UV_JUDGE")
    if not path:
        return None
    spec = importlib.util.spec_from_file_location("judge_uv", path)
    if spec is None or spec.loader is None:
        raise SystemExit(f"OMT_UV_JUDGE: {path} is no module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.judge
