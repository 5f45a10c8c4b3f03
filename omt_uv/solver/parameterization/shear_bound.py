"""Bound the shear of maps: search the seams first, map once, and search on where a map misses the bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis.density import Target
from ..analysis.seam_costs import SeamCosts, seam_costs
from ..cutting.cuts import Cuts, cut
from ..cutting.disk_charts import DiskCharts, disk_charts
from ..errors import CUT_FURTHER, ENDED_EARLY, MORE_SEAMS
from ..maps.distortion import face_distortion
from ..mesh.charts import Chart
from ..mesh.polygon_areas import polygon_areas
from ..mesh.surface import Surface, is_seam
from ..mesh.topology import boundary_edges, pair_keys
from ..progress import EarlyEnd, Steps, part_of, unless_ended
from ..seams.search import SeamSearch
from .chart_map import ChartMap
from .options import ShearBound

# Maps that are made at most.
MOST_ROUNDS = 4
# The spread of seams that goes with a mean shear s, times the square of log(s): of heads, animals and figures it is
# between 0.2 and 0.35, of limbs with fingers less.
SPREAD_OF_SHEAR = 0.19
# What a search that is made again aims below the bound, so that it need not be the last but one.
MARGIN = 0.95
# Shear of what has no area to speak of.
VANISHED = 50.0
# Where the time goes, roughly: seams take this share of every round.
SEARCHING = 0.25


@dataclass(frozen=True)
class BoundedShear:
    """Charts cut until their maps shear less than a bound.

    Attributes
    ----------
    prepared : the charts, and all cuts
    maps : of the charts
    warnings : which of them miss it, and what helps
    """

    prepared: DiskCharts
    maps: list[ChartMap]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class ShearSearch:
    """Where and how seams are searched so that maps keep a bound of the shear.

    Attributes
    ----------
    surface, faces : polygons (f,) bool of a surface
    shear : the bound
    target : see `chart_map.map_chart`
    cutting : further arguments of `disk_charts.disk_charts`
    """

    surface: Surface
    faces: np.ndarray | None
    shear: ShearBound
    target: Target | None
    cutting: dict

    def first_spread(self) -> np.ndarray:
        """The spread (f,) to begin with, see `SeamSearch`."""
        return np.full(self._count, SPREAD_OF_SHEAR * np.log(self.shear.bound) ** 2)

    def search(self, spread: np.ndarray) -> SeamSearch:
        """The search for a spread (f,)."""
        further, memory = self.shear.further, self._memory
        return SeamSearch(spread, self.surface, self.costs, density=self._density, further=further, memory=memory)

    def again(self, kept: np.ndarray, missed: list[Chart], spread: np.ndarray, share: np.ndarray) -> Steps[DiskCharts]:
        """Charts that missed the bound cut anew, for a spread (f,) or, where the same parts were searched before, by
        the share (f,) of what was left; the edges that others were cut along (k,2) stay."""
        target = np.full(self._count, np.inf)
        for chart in missed:
            target[chart.faces] = spread[chart.faces]
        search = replace(self.search(target), further=True, share=share)
        surface = replace(self.surface, seams=np.concatenate([self.surface.seams, kept]))
        return disk_charts(surface, self.faces, search=search, **self.cutting)

    def costs(self) -> SeamCosts:
        """What cutting the edges of the surface costs."""
        return self._costs

    @cached_property
    def _memory(self) -> dict:
        return {}

    @cached_property
    def _costs(self) -> SeamCosts:
        return seam_costs(self.surface, self.shear.preferences, self.faces)

    @cached_property
    def _density(self) -> np.ndarray | None:
        return _polygon_density(self.surface, self.target)

    @property
    def _count(self) -> int:
        return len(self.surface.face_start) - 1


def predicted_cuts(surface: Surface, faces: np.ndarray, bound: float, **options: Any) -> Cuts:
    """What `unwrap` cuts for a bound of the shear before its first map; with 0 for none, only what `cuts.cut` does.

    faces (f,) bool : polygons of the surface; options and errors are those of `cuts.cut`
    """
    if not bound:
        return cut(surface, faces, **options)
    search = ShearSearch(surface, faces, ShearBound(bound), None, {})
    return cut(surface, faces, search=search.search(search.first_spread()), **options)


def bound_shear(
    search: ShearSearch,
    first: DiskCharts,
    maps: list[ChartMap],
    map_charts: Callable[[list[Chart]], Steps[list[ChartMap]]],
) -> Steps[BoundedShear]:
    """Cut charts anew whose maps shear more than a bound, and map them again, until all keep it or no round betters the worst.

    first, maps : charts whose seams were searched for the bound, and their maps; map_charts : a solver for charts.
    Progress offers an early end: with the maps of the last round. Errors are those of `disk_charts.disk_charts` and of
    `map_charts`.
    """
    prepared, bound, early = first, search.shear.bound, EarlyEnd()
    cuts, spread = _cuts(first), search.first_spread()
    promised = np.full(len(spread), np.inf)
    rounds, before, best = 0, np.inf, None
    while True:
        charts = prepared.charts
        shear = [_shear(c, m, search.target is None) for c, m in zip(charts, maps, strict=True)]
        mean = np.array([area @ local / area.sum() for local, area in shear])
        rounds += 1
        missed = np.flatnonzero(mean > bound)
        searched = [k for k in missed if search.shear.further or not _is_marked(search.surface, charts[k])]
        worst = float(np.log(mean[searched]).max()) if searched else 0.0
        if worst > before:
            charts, maps, cuts, mean, searched = best
            break
        before, best = worst, (charts, maps, cuts, mean, searched)
        if rounds == MOST_ROUNDS or not searched:
            break
        share = np.ones(len(spread))
        for k in searched:
            reached = np.log(mean[k]) ** 2
            # What the last search has promised and its map has not kept is asked for on top.
            kept_part = min(float(promised[charts[k].faces].min()) / reached, 1.0)
            part = MARGIN * kept_part * (np.log(bound) ** 2 / reached) ** 1.5
            promised[charts[k].faces] = part * reached
            spread[charts[k].faces] *= part
            share[charts[k].faces] = part
        begin = 1 - 0.5 ** (rounds - 1)
        width = (1 - begin) / 2
        missing = [charts[k] for k in searched]
        outlines = np.concatenate([_outline(chart) for chart in missing])
        kept = cuts.edges[~np.isin(pair_keys(*cuts.edges.T), outlines)]
        searching = part_of(search.again(kept, missing, spread, share), begin, width * SEARCHING)
        again = yield from unless_ended(searching, early)
        if again is None:
            break
        edges = np.concatenate([kept, _cuts(again).edges])
        if len(edges) == len(cuts.edges) and np.isin(pair_keys(*edges.T), pair_keys(*cuts.edges.T)).all():
            break
        mapping = _mapped(again.charts, charts, maps, map_charts)
        further = part_of(mapping, begin + width * SEARCHING, width * (1 - SEARCHING))
        mapped = yield from unless_ended(further, early)
        if mapped is None:
            break
        prepared, maps = again, mapped
        cuts = replace(cuts, edges=edges, length=_length(search.surface, edges))
    prepared = DiskCharts(charts, cuts, first.warnings)
    missed = np.flatnonzero(mean > bound)
    by_hand = np.array([k not in searched for k in missed], dtype=bool)
    warnings = tuple(_warnings(mean[missed], by_hand, bound, ENDED_EARLY if early.is_asked else MORE_SEAMS))
    return BoundedShear(prepared, maps, warnings)


def _cuts(prepared: DiskCharts) -> Cuts:
    """The cuts of charts that were searched."""
    if prepared.cuts is None:
        raise ValueError("charts along existing seams alone have no cuts to add to")
    return prepared.cuts


def _warnings(mean: np.ndarray, by_hand: np.ndarray, bound: float, why: str) -> Iterator[str]:
    """Warnings of charts (k,) that shear more than a bound, those with seams marked by hand apart; why others do."""
    for chosen, what in ((by_hand, f"its seams were marked by hand. {CUT_FURTHER}"), (~by_hand, why)):
        if chosen.any():
            who = "An island shears" if chosen.sum() == 1 else f"{chosen.sum()} islands shear"
            what = what if chosen.sum() == 1 else what.replace("its seams", "their seams")
            yield f"{who} {mean[chosen].max():.3g} in the mean, above {bound:.3g}: {what}"


def _outline(chart: Chart) -> np.ndarray:
    """Keys (e,) of the edges around a chart."""
    return pair_keys(*chart.vertex_ids[boundary_edges(chart.triangles)].T)


def _length(surface: Surface, edges: np.ndarray) -> float:
    """Length of edges (k,2)."""
    return float(np.linalg.norm(surface.positions[edges[:, 0]] - surface.positions[edges[:, 1]], axis=1).sum())


def _is_marked(surface: Surface, chart: Chart) -> bool:
    """Whether seams of the surface bound a chart."""
    return bool(is_seam(surface, _outline(chart)).any())


def _polygon_density(surface: Surface, target: Target | None) -> np.ndarray | None:
    """Mean density (f,) of the triangles of every polygon."""
    if target is None:
        return None
    count = len(surface.face_start) - 1
    size = np.maximum(np.bincount(surface.triangle_face, minlength=count), 1)
    return np.bincount(surface.triangle_face, target.density, count) / size


def _mapped(charts, old_charts, old_maps, map_charts) -> Steps[list[ChartMap]]:
    """Maps of the charts; those that are as they were keep theirs."""
    known = {_name(chart): chart_map for chart, chart_map in zip(old_charts, old_maps, strict=True)}
    new = yield from map_charts([chart for chart in charts if _name(chart) not in known])
    rest = iter(new)
    return [known[_name(chart)] if _name(chart) in known else next(rest) for chart in charts]


def _name(chart: Chart) -> tuple[bytes, bytes]:
    """Equal for charts of the same corners that are joined in the same way."""
    return chart.corners.tobytes(), chart.disk.tobytes()


def _shear(chart: Chart, chart_map: ChartMap, kept: bool) -> tuple[np.ndarray, np.ndarray]:
    """The shear s1/s2 (m,) of triangles, and the areas (m,) of these.

    kept : areas are to be kept; then it is the shear that has the symmetric Dirichlet energy of their polygons
    """
    octaves, shear = face_distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles], chart.faces)
    if kept:
        ratio = 2.0 ** np.clip(octaves, -20, 20)
        energy = (ratio + 1 / ratio) * (shear + 1 / shear) / 4
        # Quads that fold or vanish, also along the other diagonal, are mended at last: no seam helps against them.
        shear = np.minimum(energy + np.sqrt(energy**2 - 1), VANISHED)
    return shear, polygon_areas(chart.vertices, chart.triangles, chart.faces)
