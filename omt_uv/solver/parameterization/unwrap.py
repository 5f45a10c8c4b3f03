"""Unwrap a surface: polygon mesh -> charts -> maps of these (see `chart_map`) -> texture coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.density import Target
from ..cutting.disk_charts import cut_to_disks
from ..cutting.hole_filling import MANY
from ..errors import MeshError
from ..mesh.charts import Chart
from ..mesh.surface import Surface
from ..progress import Progress, Steps, part_of
from ..refinement.continuation_rules import QUALITIES
from .chart_indices import chart_target, located
from .chart_map import ChartMap, map_chart
from .chart_pins import ChartPins, CornerPins, clear_of_pins, pins_of_chart
from .convex_maps import with_convex_polygons
from .mirrored_charts import as_given, mirror_partners, mirrored_map, with_mirrored_quads
from .options import UnwrapOptions
from .shear_bound import bound_shear
from .small_charts import is_small, map_together


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
    options: UnwrapOptions | None = None,
    pins: CornerPins | None = None,
    target: Target | None = None,
    avoid: np.ndarray | None = None,
) -> Steps[SurfaceMap]:
    """Map the polygons `faces` (f,) bool of a surface, all by default, so that areas are kept.

    Parameters
    ----------
    pins : corners that keep their places, with a free boundary
    target : density (m,) of the triangles of the surface, and a region; every triangle its own area by default
    avoid : (n,) in [0,1], vertices to keep free of cuts; cuts avoid pinned vertices, too

    Raises
    ------
    MeshError : see `disk_charts.cut_to_disks` and `chart_map.map_chart`; element indices are those of the surface
    """
    yield Progress("Charts", 0.0)
    task = _Task(surface, options or UnwrapOptions(), pins, target)
    avoid = clear_of_pins(surface, pins, avoid)
    seams, fill_holes, bound = task.options.seams, task.options.fill_holes, task.options.max_shear
    if bound:
        found = yield from bound_shear(
            surface, faces, task.map_one, bound, seams=seams, fill_holes=fill_holes, avoid=avoid
        )
        charts, maps, cuts, warnings = found.prepared.charts, found.maps, found.cuts, found.warnings
        chart_pins = [pins_of_chart(pins, chart) for chart in charts]
    else:
        prepared = cut_to_disks(surface, faces, seams=seams, fill_holes=fill_holes, sieve=MANY, avoid=avoid)
        charts, warnings = prepared.charts, prepared.warnings
        chart_pins = [pins_of_chart(pins, chart) for chart in charts]
        maps = yield from task.map_symmetric(charts, chart_pins)
        cuts = np.zeros((0, 2), np.int64) if prepared.cuts is None else prepared.cuts.edges
    maps = with_convex_polygons(surface, charts, maps, chart_pins, task.options, target)
    return SurfaceMap(charts, maps, cuts, warnings)


@dataclass(frozen=True)
class _Task:
    """What all charts of a surface have in common."""

    surface: Surface
    options: UnwrapOptions
    pins: CornerPins | None
    target: Target | None

    def map_one(self, chart: Chart) -> Steps[ChartMap]:
        """The map of one chart; errors have the element indices of the surface."""
        pins = pins_of_chart(self.pins, chart)
        target = chart_target(self.target, self.surface, chart)
        try:
            return (yield from map_chart(chart, options=self.options, target=target, pins=pins))
        except MeshError as error:
            raise located(error, chart) from error

    def map_symmetric(self, charts: list[Chart], pins: list[ChartPins | None]) -> Steps[list[ChartMap]]:
        """Maps of all charts, symmetric ones also where their mirror images are cut along other diagonals."""
        joined = charts if any(p is not None for p in pins) else with_mirrored_quads(self.surface, charts)
        maps = yield from self.map_all(joined, pins)
        changed = [k for k, (a, b) in enumerate(zip(charts, joined, strict=True)) if (a.faces != b.faces).any()]
        goal = QUALITIES[self.options.quality].area_error if self.options.balance == 0 else np.inf
        for k in changed:
            target = chart_target(self.target, self.surface, charts[k])
            found = as_given(charts[k], maps[k], None if target is None else target.density, goal)
            if found is None:
                return (yield from self.map_all(charts, pins))
            maps[k] = found
        return maps

    def map_all(self, charts: list[Chart], pins: list[ChartPins | None]) -> Steps[list[ChartMap]]:
        """Maps of all charts, small ones without pins together, one for two that are each other's mirror image."""
        total = sum(len(c.triangles) for c in charts)
        free = self.options.boundary == "free"
        every = [chart_target(self.target, self.surface, chart) for chart in charts]
        pairs = {} if any(p is not None for p in pins) else mirror_partners(charts, every)
        alike = [k for k, c in enumerate(charts) if free and pins[k] is None and is_small(c) and k not in pairs]
        done = sum(len(charts[k].triangles) for k in alike) / total
        targets = [every[k] for k in alike]
        found = yield from part_of(map_together([charts[k] for k in alike], targets, self.options), 0.0, done)
        ready = dict(zip(alike, found, strict=True))
        maps: list[ChartMap] = []
        for k, chart in enumerate(charts):
            if k in pairs:
                maps.append(mirrored_map(maps[pairs[k][0]], pairs[k][1]))
                continue
            chart_map = ready.get(k)
            if chart_map is None:
                share = 0.0 if k in ready else len(chart.triangles) / total
                chart_map = yield from part_of(self.map_one(chart), done, share)
                done += share
            maps.append(chart_map)
        return maps
