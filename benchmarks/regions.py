"""Choose a region to magnify, measure a map against its density, and judge the figures.

The figures are computed from corners alone, without the solver. Where the variable OMT_UV_JUDGE names a file with an
independent function `judge(V, F, uv)`, folds, overlap and area_l1 are its figures.
"""

from __future__ import annotations

import importlib.util
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.tables import missed
from omt_uv.solver.analysis.vertex_scores import distance
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import vertex_areas

SHARE = 0.05  # of the surface that the region covers
BORDER = 0.25  # half the width of its soft border, over its radius
# What a magnification should reach.
SHARE_GOAL = 5e-3  # relative error of the share
AREA_GOAL = 0.02  # area error of all, of the region, of the context
OVERLAP_GOAL = 1e-4  # share of the layout
TIME_GOAL = 1.3  # times the time of a plain unwrap
# Of twice by 2 against once by 4: share, and distance of corresponding points over the domain's width.
CASCADE_GOAL = 0.02


def ball(V, F, seed=1):
    """Weights (n,) of a geodesic ball with the given share of the area about a random vertex, and a soft border."""
    d = distance(V, F, np.array([np.random.default_rng(seed).choice(np.unique(F))]))
    area = vertex_areas(V, F)
    order = np.argsort(d)
    radius = d[order[np.searchsorted(np.cumsum(area[order]) / area.sum(), SHARE)]]
    t = np.clip((radius * (1 + BORDER) - d) / (2 * BORDER * radius), 0, 1)
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
    # Every face belongs to one of them, those of the soft border, too.
    region, context = (float(error[part].sum() / target[part].sum()) for part in (weights > 0.5, weights <= 0.5))
    judged: dict[str, Any]
    judge = _judge()
    if judge is None:
        d = distortion(V, F, uv, density=density)
        judged = {"area_l1": d.area_l1, "folds": d.folds, "overlap": d.overlap}
    else:
        # It knows no densities: every face alone, and as large as it is meant to be.
        apart = (V[F] * np.sqrt(density)[:, None, None]).reshape(-1, 3)
        scaled = judge(apart, np.arange(3 * len(F)).reshape(-1, 3), uv)
        d = judge(V, F, uv)
        judged = {"area_l1": scaled["area_l1"], "folds": d["folds"], "overlap": d["overlap"]}
    return Figures(share=float(weights @ has), region=region, context=context, **judged)


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


def missed_by(figures: Figures, error, ratio, cascade=0.0) -> dict[str, str]:
    """The cell "missed goals", with the relative error of the share, the time over that of a plain unwrap, and what
    twice differs by from once."""
    return missed(
        share=abs(error) > SHARE_GOAL,
        area=max(figures.area_l1, figures.region, figures.context) > AREA_GOAL,
        folds=figures.folds,
        overlap=figures.overlap > OVERLAP_GOAL,
        cascade=cascade > CASCADE_GOAL,
        time=ratio > TIME_GOAL,
    )
