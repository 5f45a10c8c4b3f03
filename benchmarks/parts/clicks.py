"""One click: what Unwrap makes of a model with nothing else set, beside a plain unwrap along the seams it has found.

Models stand along Y, as published ones do. Seams are those between islands and within them, over the side of a square
with the area of the model; times are processor seconds of one run, which is what the ratio is good for.
"""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np

from benchmarks.cases import polygon_model
from benchmarks.part import MODELS, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from omt_uv.pipelines.layout import Layout, UnwrapJob
from omt_uv.pipelines.reading import Y_UP
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import DEFAULT_MAX_SHEAR, Settings
from omt_uv.solver.analysis.feature_edges import value_jumps
from omt_uv.solver.maps.distortion import distortion, face_distortion
from omt_uv.solver.mesh.geometry import edge_lengths, face_areas
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.progress import drain

DEFAULT_MODELS = ("lion", "optcuts_bimba_i", "face", "homer", "spot", "max_planck", "stanford_bunny", "suzanne", "cow",
                  "camel_b", "david", "bunny_small")  # fmt: skip
STEEP = 3.0  # shear that is seen on any checker
STEEP_GOAL = 0.01  # share of the surface that may have more
AREA_GOAL = 0.01
SAME_UV = 1e-6  # of the layout: corners nearer than this are joined
TIME_GOAL = 2.0  # times a plain unwrap
COLUMNS = {"model": 16, "faces": 7, "islands": 7, "seam": 6, "shear": 6, "> 3": 7, "area_l1": 8, "folds": 5,
           "overlap": 8, "seconds": 7, "x plain": 7, "missed goals": 28}  # fmt: skip


def one_click(surface: Surface, **settings):
    """The layout of a surface, and its processor seconds."""
    chosen = Settings(**{"max_shear": DEFAULT_MAX_SHEAR} | settings)
    return timed(lambda: drain(lay_out([UnwrapJob(surface, axes=Y_UP)], chosen)))


def uv_of(surface: Surface, layout: Layout) -> np.ndarray:
    """UVs (c,2) of the corners of the only surface of a layout."""
    uv = np.zeros((len(surface.corner_vertex), 2))
    uv[layout.corners[0]] = layout.uv[0]
    return uv


def clicks_table(args) -> Table:
    """One row for every model."""
    table = Table("One click", COLUMNS)
    for name in args.models or [m for m in DEFAULT_MODELS if meshes.model_path(m)]:
        surface = polygon_model(name)
        layout, seconds = one_click(surface)
        uv = uv_of(surface, layout)
        F, mapped = surface.corner_vertex[surface.triangles], uv[surface.triangles]
        cut = value_jumps(F, surface.triangles, uv, SAME_UV * np.ptp(uv, axis=0).max())
        _, plain = one_click(replace(surface, seams=cut), max_shear=0.0, seams="existing")
        figures = distortion(surface.positions, F, mapped, polygons=surface.triangle_face)
        area = face_areas(surface.positions, F)
        steep = float(area[face_distortion(surface.positions, F, mapped)[1] > STEEP].sum() / area.sum())
        row = {
            "model": name,
            "faces": len(surface.face_start) - 1,
            "islands": len(layout.maps[0].charts),
            "seam": f"{edge_lengths(surface.positions, cut).sum() / np.sqrt(area.sum()):.2f}",
            "shear": f"{figures.angle_mean:.3f}",
            "> 3": f"{steep:.2%}",
            "area_l1": f"{figures.area_l1:.4f}",
            "folds": figures.folds,
            "overlap": f"{figures.overlap:.1e}",
            "seconds": f"{seconds:.2f}",
            "x plain": f"{seconds / plain:.1f}",
        }
        goals = missed(
            shear=figures.angle_mean > DEFAULT_MAX_SHEAR,
            steep=steep > STEEP_GOAL,
            areas=figures.area_l1 > AREA_GOAL,
            folds=figures.folds > 0,
            overlap=bool(figures.overlap),
            time=seconds > TIME_GOAL * plain,
        )
        table.add(**row, **goals)
    return table


PARTS = (
    Part("clicks", "what Unwrap makes of a model with nothing else set", clicks_table, (MODELS,), by_default=False),
)
