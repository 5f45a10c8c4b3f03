"""Search seams for a bound of the shear: where, at what cost, and what maps of coarse surfaces tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.density import Target, means_of_polygons
from ..analysis.seam_costs import SeamCosts, seam_costs
from ..analysis.symmetry_plane import MirrorImages
from ..cutting.disk_charts import DiskCharts, disk_charts
from ..mesh.charts import Chart
from ..mesh.surface import Surface
from ..progress import Steps, part_of
from .chart_map import ChartMap, local_shear
from .options import ShearBound

if TYPE_CHECKING:
    from ..seams.search import SeamSearch

# The spread of seams that goes with a mean shear s, times the square of log(s): of heads, animals and figures it is
# between 0.2 and 0.35, of limbs with fingers less.
SPREAD_OF_SHEAR = 0.19
# Below this bound, what the triangles of a coarse surface shear by themselves counts more than what is cut.
LEAST_REHEARSED = 1.2
# Of a surface in one piece the largest chart has this share of the area, but for crumbs.
ONE_PIECE = 0.97


@dataclass(frozen=True)
class ShearSearch:
    """Where and how seams are searched so that maps keep a bound of the shear.

    Attributes
    ----------
    surface, faces : polygons (f,) bool of a surface
    shear : the bound
    target : see `chart_map.map_chart`
    cutting : further arguments of `disk_charts.disk_charts`
    map_surface : gives the maps of the charts of a small surface, for a target of its own
    """

    surface: Surface
    faces: np.ndarray | None
    shear: ShearBound
    target: Target | None
    cutting: dict
    map_surface: Callable[[Surface, list[Chart], Target | None], Steps[list[ChartMap]]] | None = None

    def first_spread(self) -> np.ndarray:
        """The spread (f,) to begin with, see `SeamSearch`."""
        return np.full(self.count, SPREAD_OF_SHEAR * np.log(self.shear.bound) ** 2)

    def search(self, spread: np.ndarray) -> SeamSearch:
        """The search for a spread (f,)."""
        from ..seams.search import SeamSearch

        return SeamSearch(
            spread,
            self.surface,
            self.costs,
            density=self._density,
            further=self.shear.further,
            memory=self.memory,
            asked=float(np.log(self.shear.bound) ** 2),
            rehearse=self.rehearsed if self.shear.bound >= LEAST_REHEARSED else None,
        )

    def rehearsed(self, surface: Surface, log_density: np.ndarray | None) -> Steps[float | None]:
        """The square of the logarithm of what maps of a small surface shear; log_density (n,) : half the logarithm of
        the density at its vertices. None where it comes apart, since then it is another surface."""
        if self.map_surface is None:
            return None
        target = None
        if log_density is not None:
            target = Target(np.exp(2 * log_density[surface.corner_vertex[surface.triangles]].mean(axis=1)))
        prepared = yield from disk_charts(surface, extremities=0)
        maps = yield from self.map_surface(surface, prepared.charts, target)
        shear = [local_shear(chart, one, target is None) for chart, one in zip(prepared.charts, maps, strict=True)]
        size = np.array([area.sum() for _, area in shear])
        if size.max() < ONE_PIECE * size.sum():
            return None
        return float(np.log(sum(area @ local for local, area in shear) / size.sum()) ** 2)

    def again(self, kept: np.ndarray, missed: list[Chart], spread: np.ndarray, changes: dict) -> Steps[DiskCharts]:
        """Charts that missed the bound cut anew, for a spread (f,) or, where the same parts were searched before, by
        what changes in the search; the edges that others were cut along (k,2) stay. Of two charts that are each other's
        mirror image one is searched."""
        target, twin = np.full(self.count, np.inf), self._twins(missed)
        for k, chart in enumerate(missed):
            target[chart.faces] = spread[chart.faces] if twin[k] < 0 else np.inf
        search = replace(self.search(target), further=True, **changes)
        found = yield from part_of(self._cut(kept, search), 0.0, 0.9)
        if (twin < 0).all():
            return found
        known = found.found_cuts.edges
        originals = [missed[k].vertex_ids for k in twin[twin >= 0]]
        inner = known[np.any([np.isin(known, ids).all(axis=1) for ids in originals], axis=0)]
        known = np.concatenate([known, self.images.exact[inner]]) if self.images is not None else known
        none = replace(search, spread=np.full(self.count, np.inf))
        found = yield from part_of(self._cut(np.concatenate([kept, known]), none), 0.9, 0.1)
        cuts = found.found_cuts
        return replace(found, cuts=replace(cuts, edges=np.concatenate([known, cuts.edges])))

    def _cut(self, kept: np.ndarray, search: SeamSearch) -> Steps[DiskCharts]:
        """Charts with edges (k,2) that stay cut, and those that a search finds."""
        surface = replace(self.surface, seams=np.concatenate([self.surface.seams, kept]))
        return disk_charts(surface, self.faces, search=search, **self.cutting)

    def _twins(self, charts: list[Chart]) -> np.ndarray:
        """The number (k,) of the chart before each of which it is the mirror image, vertex by vertex; -1 for none."""
        twin = np.full(len(charts), -1)
        if self.images is None or not self.images.are_exact or len(charts) < 2:
            return twin
        sets = [np.unique(chart.vertex_ids) for chart in charts]
        number = {vertices.tobytes(): k for k, vertices in enumerate(sets)}
        for k, vertices in enumerate(sets):
            other = number.get(np.sort(self.images.exact[vertices]).tobytes(), k)
            if other < k and twin[other] < 0:
                twin[k] = other
        return twin

    def costs(self) -> SeamCosts:
        """What cutting the edges of the surface costs."""
        return self._costs

    @cached_property
    def memory(self) -> dict:
        """What a first search has found."""
        return {}

    @cached_property
    def images(self) -> MirrorImages | None:
        """The mirror images of the vertices of the surface; None without a mirror."""
        plane = self.costs().plane
        if plane is None:
            return None
        return plane.images(self.surface.positions, self.surface.corner_vertex[self.surface.triangles])

    @cached_property
    def _costs(self) -> SeamCosts:
        return seam_costs(self.surface, self.shear.preferences, self.faces)

    @cached_property
    def _density(self) -> np.ndarray | None:
        if self.target is None:
            return None
        return means_of_polygons(self.target.density, self.surface.triangle_face, self.count)

    @property
    def count(self) -> int:
        """Polygons of the surface."""
        return len(self.surface.face_start) - 1
