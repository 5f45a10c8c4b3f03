"""Keep convex polygons convex in the maps of a surface, where that costs no area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..analysis.density import Target
from ..maps.similarity import fit_similarity
from ..mesh.charts import Chart
from ..mesh.geometry import signed_areas
from ..mesh.surface import Surface
from ..mesh.topology import boundary_loops
from ..refinement.continuation_rules import QUALITIES
from .chart_indices import chart_target
from .chart_map import FOLDED, ChartMap, in_unit_box, measured_chart
from .chart_pins import ChartPins
from .convexity import keep_convex
from .options import MapOptions
from .polygon_disk import cut_as_mapped

# The area error of a map may grow by this factor, or to so much more than its goal, for polygons that are convex.
AREA_KEPT = 1.1


def with_convex_polygons(
    surface: Surface,
    charts: list[Chart],
    maps: list[ChartMap],
    pins: Sequence[ChartPins | None],
    options: MapOptions,
    target: Target | None = None,
) -> list[ChartMap]:
    """The maps with polygons that are convex on the surface convex in them, too, as far as may be: `keep_convex`.

    pins : of every chart; options and target : those of the maps. A map that would lose its areas stays as it is.
    """
    if not (np.diff(surface.face_start) > 3).any():
        return maps
    given, charts = charts, [cut_as_mapped(c, m.uv) for c, m in zip(charts, maps, strict=True)]
    fixed = [_fixed(c, p, options.boundary) for c, p in zip(charts, pins, strict=True)]
    targets = [chart_target(target, surface, c) for c in charts]
    density = [None if t is None else t.density for t in targets]
    goal = QUALITIES[options.quality].area_error
    spare = [AREA_KEPT * max(m.area_l1, goal) - m.area_l1 for m in maps]
    new = list(maps)
    found = keep_convex(surface, charts, [m.uv for m in maps], fixed, density, [m.area_weight for m in maps], spare)
    for k, uv in found.items():
        chart, old = given[k], maps[k]
        (vertices, _), (flat, unit) = in_unit_box(chart.vertices), in_unit_box(uv)
        figures = measured_chart(vertices, chart, flat, density[k])
        if figures.area_l1 <= AREA_KEPT * max(old.area_l1, goal) and not figures.folds:
            if not fixed[k].any():
                uv = _as_before(flat, old.uv / unit, chart.triangles) * unit
            names = ("area_l1", "area_sd", "angle_mean", "folds")
            warnings = tuple(text for text in old.warnings if not text.endswith(FOLDED))
            new[k] = replace(old, uv=uv, warnings=warnings, **{name: getattr(figures, name) for name in names})
    return new


def _fixed(chart: Chart, pins: ChartPins | None, boundary: str) -> np.ndarray:
    """Vertices (n,) bool of a chart that stay where the refinement left them: pins, and those on a disk or a square."""
    fixed = np.zeros(len(chart.vertices), bool)
    if pins is not None:
        fixed[pins.vertices] = True
    if boundary != "free":
        fixed[boundary_loops(chart.disk)[0]] = True
    return fixed


def _as_before(uv: np.ndarray, given: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A map (n,2) moved, turned and scaled to the place, direction and area of another one of the same triangles."""
    scale = np.sqrt(signed_areas(given, triangles).sum() / signed_areas(uv, triangles).sum())
    w = scale * (uv @ [1, 1j])
    w = fit_similarity(w, given @ [1, 1j], rigid=True)(w)
    return np.column_stack([w.real, w.imag])
