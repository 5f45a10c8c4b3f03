"""The pipeline: polygon mesh -> charts -> maps of these (see `chart_map`) -> texture coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.density import Target
from ..cutting.disk_charts import prepare
from ..cutting.hole_filling import MANY
from ..errors import MeshError
from ..mesh.charts import Chart
from ..mesh.surface import Surface
from ..progress import Progress, Steps, part_of
from .chart_indices import chart_target, located, located_pins
from .chart_map import ChartMap, unwrap_chart
from .chart_pins import CornerPins, clear_of_pins
from .convex_maps import with_open_corners
from .small_charts import small, together


@dataclass(frozen=True)
class SurfaceMap:
    """All charts of a surface and their maps, in one texel density.

    seams (k,2): edges that were cut for the map; warnings: what was repaired for the map.
    """

    charts: list[Chart]
    maps: list[ChartMap]
    seams: np.ndarray
    warnings: tuple[str, ...] = ()

    def corner_uv(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of the surface (k,) that were mapped, each once, and their coordinates (k,2), charts unpacked."""
        corners = np.concatenate([c.corners.ravel() for c in self.charts])
        uv = np.concatenate([m.uv[c.triangles.ravel()] for c, m in zip(self.charts, self.maps, strict=True)])
        corners, first = np.unique(corners, return_index=True)
        return corners, uv[first]

    def report(self) -> list[dict]:
        """One dictionary per chart, for a JSON file."""
        return [m.report(c) for c, m in zip(self.charts, self.maps, strict=True)]


def unwrap(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    boundary: str = "free",
    quality: str = "standard",
    balance: float = 0.0,
    pins: CornerPins | None = None,
    seams: str = "auto",
    fill_holes: bool = False,
    avoid: np.ndarray | None = None,
    target: Target | None = None,
) -> Steps[SurfaceMap]:
    """Area-preserving texture coordinates of the polygons `faces` (f,) bool, all by default.

    Parameters
    ----------
    boundary : "free" for the least shear; "disk" or "square", which every chart then fills
    quality : "draft", "standard" or "exact", how small the area error of single faces becomes
    balance : from 0, exact areas, to 1, least shear
    pins : corners that keep their places, with a free boundary
    seams, fill_holes, avoid : see `preparation.prepare`; cuts avoid pinned vertices, too, and sieves are filled anyway
    target : density (m,) of the triangles of the surface, and a region; every triangle its own area by default

    Raises
    ------
    MeshError : see `preparation.prepare` and `chart_map.unwrap_chart`; element indices are those of the surface
    """
    yield Progress("Charts", 0.0)
    avoid = clear_of_pins(surface, pins, avoid)
    prepared = prepare(surface, faces, seams=seams, fill_holes=fill_holes, sieve=MANY, avoid=avoid)
    charts = prepared.charts
    held = [located_pins(pins, chart) for chart in charts]
    maps: list[ChartMap] = []
    total = sum(len(c.triangles) for c in charts)
    alike = [k for k, c in enumerate(charts) if boundary == "free" and held[k] is None and small(c)]
    done = sum(len(charts[k].triangles) for k in alike) / total
    targets = [chart_target(target, surface, charts[k]) for k in alike]
    found = yield from part_of(together([charts[k] for k in alike], targets, quality, balance), 0.0, done)
    ready = dict(zip(alike, found, strict=True))
    for k, (chart, fixed) in enumerate(zip(charts, held, strict=True)):
        mapped = ready.get(k)
        if mapped is not None:
            maps.append(mapped)
            continue
        share = 0.0 if k in ready else len(chart.triangles) / total
        options: dict = {"boundary": boundary, "quality": quality, "balance": balance, "pins": fixed}
        steps = unwrap_chart(chart, **options, **chart_target(target, surface, chart))
        try:
            maps.append((yield from part_of(steps, done, share)))
        except MeshError as error:
            raise located(error, chart) from error
        done += share
    maps = with_open_corners(surface, charts, maps, held, boundary, quality, target)
    cuts = np.zeros((0, 2), np.int64) if prepared.cuts is None else prepared.cuts.edges
    return SurfaceMap(charts, maps, cuts, prepared.warnings)
