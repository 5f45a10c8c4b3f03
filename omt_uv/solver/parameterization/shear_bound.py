"""Bound the shear of maps, by slits from the boundaries of charts to where they shear most."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..cutting.disk_charts import DiskCharts, cut_to_disks
from ..cutting.hole_filling import MANY
from ..cutting.shear_slit import slit
from ..maps.distortion import face_distortion
from ..mesh.charts import Chart
from ..mesh.polygon_areas import polygon_areas
from ..mesh.surface import Surface
from ..progress import Steps
from .chart_map import ChartMap

# Rounds of slits, one slit a chart in each.
MOST_ROUNDS = 12


@dataclass(frozen=True)
class BoundedShear:
    """Charts slit until their maps shear less than a bound.

    Attributes
    ----------
    prepared : the charts, and the cuts that were made before the first slit
    maps : of the charts
    slits (k,2) : edges that were added to the cuts
    history : length of all cuts and slits, and mean shear of the whole surface, before the first round and after each
    bound : of the mean shear s1/s2 of a chart
    reached : every chart keeps the bound; otherwise this is the round of the least shear
    """

    prepared: DiskCharts
    maps: list[ChartMap]
    slits: np.ndarray
    history: tuple[tuple[float, float], ...]
    bound: float
    reached: bool

    @property
    def cuts(self) -> np.ndarray:
        """Edges (k,2) of all cuts and slits."""
        return self.slits if self.prepared.cuts is None else np.concatenate([self.prepared.cuts.edges, self.slits])

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was repaired, and whether the bound is not kept."""
        if self.reached:
            return self.prepared.warnings
        (length, shear), first = self.history[-1], self.history[0]
        missed = (
            f"The mean shear went from {first[1]:.3g} to {shear:.3g} with {length - first[0]:.3g} more of seam, "
            f"not below {self.bound:.3g}; the least that was found is kept"
        )
        return (*self.prepared.warnings, missed)


def bound_shear(
    surface: Surface,
    faces: np.ndarray | None,
    map_one: Callable[[Chart], Steps[ChartMap]],
    bound: float,
    *,
    seams: str = "auto",
    fill_holes: bool = False,
    avoid: np.ndarray | None = None,
    rounds: int = MOST_ROUNDS,
) -> Steps[BoundedShear]:
    """Map all charts, and slit those whose mean shear s1/s2 is above `bound` > 1, until none is or `rounds` are over.

    Parameters and errors are those of `disk_charts.cut_to_disks`, and errors of `map_one`, a solver for one chart.
    """
    if not bound > 1:
        raise ValueError(f"no map shears less than 1; the bound must be greater, not {bound}")
    first = prepared = cut_to_disks(surface, faces, seams=seams, fill_holes=fill_holes, sieve=MANY, avoid=avoid)
    cuts = np.zeros((0, 2), np.int64) if first.cuts is None else first.cuts.edges
    slits = np.zeros((0, 2), dtype=np.int64)
    maps: list[ChartMap] = []
    charts: list[Chart] = []
    history: list[tuple[float, float]] = []
    best = None
    while True:
        maps = yield from _mapped(prepared.charts, charts, maps, map_one)
        charts = prepared.charts
        shear = [_shear(c, m) for c, m in zip(charts, maps, strict=True)]
        mean = np.array([_mean(c, s) for c, s in zip(charts, shear, strict=True)])
        length = _length(surface, slits) + (first.cuts.length if first.cuts else 0.0)
        history.append((length, _overall(charts, mean)))
        worst = np.flatnonzero(mean > bound)
        if best is None or len(worst) == 0 or history[-1][1] < min(h[1] for h in history[:-1]):
            best = charts, maps, slits, len(worst) == 0
        new = [slit(surface, charts[k], shear[k], avoid) for k in worst] if len(history) <= rounds else []
        if not sum(map(len, new)):
            break
        slits = np.concatenate([slits, *new])
        slit_surface = replace(surface, seams=np.concatenate([surface.seams, cuts, slits]))
        prepared = cut_to_disks(slit_surface, faces, seams=seams, fill_holes=fill_holes, sieve=MANY, avoid=avoid)
    charts, maps, slits, reached = best
    prepared = DiskCharts(charts, first.cuts, first.warnings)
    return BoundedShear(prepared=prepared, maps=maps, slits=slits, history=tuple(history), bound=bound, reached=reached)


def _mapped(charts, old_charts, old_maps, map_one) -> Steps[list[ChartMap]]:
    """Maps of the charts; those that are as they were keep theirs. Slits never change the number of charts."""
    maps = []
    for k, chart in enumerate(charts):
        same = k < len(old_charts) and _same(chart, old_charts[k])
        maps.append(old_maps[k] if same else (yield from map_one(chart)))
    return maps


def _same(chart: Chart, other: Chart) -> bool:
    return np.array_equal(chart.corners, other.corners) and np.array_equal(chart.disk, other.disk)


def _shear(chart: Chart, chart_map: ChartMap) -> np.ndarray:
    return face_distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles], chart.faces)[1]


def _mean(chart: Chart, shear: np.ndarray) -> float:
    area = polygon_areas(chart.vertices, chart.triangles, chart.faces)
    return float(area @ shear / area.sum())


def _overall(charts: list[Chart], mean: np.ndarray) -> float:
    area = np.array([polygon_areas(c.vertices, c.triangles, c.faces).sum() for c in charts])
    return float(area @ mean / area.sum())


def _length(surface: Surface, edges: np.ndarray) -> float:
    p = surface.positions
    return float(np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1).sum())
