"""Search seams for a bound of the shear: where, at what cost, what maps of coarse surfaces tell, and what a round of
maps has come to."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.density import Target, means_of_polygons
from ..analysis.facing import SceneAxes
from ..analysis.seam_costs import SeamCosts, seam_costs
from ..analysis.straight_paths import closed_price
from ..analysis.symmetry_plane import MirrorImages
from ..cutting.component import TurnedCopies
from ..cutting.cuts import Cuts
from ..cutting.disk_charts import DiskCharts, disk_charts
from ..mesh.charts import Chart
from ..mesh.geometry import edge_lengths
from ..mesh.surface import Surface
from ..mesh.topology import boundary_edges, boundary_loops, pair_keys
from ..progress import Steps, part_of
from .chart_indices import all_within, chart_of_polygons, identity, is_marked, mirror_twins, outline, with_entangled
from .chart_map import ChartMap, local_shear
from .options import ShearBound

if TYPE_CHECKING:
    from ..seams.coarse_cut import Found
    from ..seams.search import SeamSearch

# The spread of seams that goes with a mean shear s, times the square of log(s): of heads, animals and figures it is
# between 0.2 and 0.35, of limbs with fingers less.
SPREAD_OF_SHEAR = 0.19
# Below this bound, what the triangles of a coarse surface shear by themselves counts more than what is cut.
LEAST_REHEARSED = 1.2
# What shears more than this is seen on any checker, and charts with more of it than that share are cut further.
STEEP = 3.0
MOST_STEEP = 0.01
# Charts of less than this share of the area count for nothing.
LEAST_AREA = 1e-4
# A mean excess of the shear up to this is not worse than none: what was parted is cut further.
NO_EXCESS = 0.005
UNSHEARED = 1.001  # What shears no more lies flat.
NEARLY = 0.03  # What misses the bound by less misses it by little.
# Where a second search and later ones take off less than this share of what is missing, no seams are left that pay.
LITTLE = 0.1
# A chart with less than this share of the square of log(shear) that the bound allows may do with a shorter cut.
SLACK = 0.85
# The square of log(shear) goes with this power of the share that is steep, or less: tails grow faster than means.
SHEAR_BY_STEEP = 0.6
# What a search that is made again aims below the bound, so that it need not be the last but one; later ones less.
MARGIN = 0.95
# What has no map is asked for this share of what cuts have left.
UNKNOWN = 0.5
# Of a surface in one piece the largest chart has this share of the area, but for crumbs.
ONE_PIECE = 0.97
NO_EDGES = np.zeros((0, 2), np.int64)  # what is slit where nothing is


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
    seams_of : gives all seams (k,2) of one, with vertices (n,) in [0,1] to keep free of them; None where large parts
        are not to be thinned, see `thinned.ThinnedSearch`
    """

    surface: Surface
    faces: np.ndarray | None
    shear: ShearBound
    target: Target | None
    cutting: dict
    map_surface: Callable[[Surface, list[Chart], Target | None], Steps[list[ChartMap]]] | None = None
    seams_of: Callable[[Surface, np.ndarray], Steps[np.ndarray]] | None = None

    def first_spread(self) -> np.ndarray:
        """The spread (f,) to begin with, see `SeamSearch`; small parts have a map first, which takes no time."""
        return SPREAD_OF_SHEAR * (self.lenience**2 * np.log(self.shear.bound)) ** 2

    def search(self, spread: np.ndarray) -> SeamSearch:
        """The search for a spread (f,)."""
        from .thinned import ThinnedSearch

        return ThinnedSearch(
            spread,
            self.surface,
            self.costs,
            density=self._density,
            further=self.shear.further,
            memory=self.memory,
            models=self.models,
            asked=float(np.log(self.shear.bound) ** 2),
            rehearse=self.rehearsed if self.shear.bound >= LEAST_REHEARSED else None,
            rehearsed=self.rehearsals,
            borders=self.borders,
            seams_of=self.seams_of,
            thinned=self.thinned,
            pockets=lambda: self.pockets,
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

    def again(
        self, kept: np.ndarray, missed: list[Chart], spread: np.ndarray, changes: dict, slits: np.ndarray = NO_EDGES
    ) -> Steps[DiskCharts]:
        """Charts that missed the bound cut anew, for a spread (f,) or, where the same parts were searched before, by
        what changes in the search; the edges that others were cut along (k,2) stay, and these are slit (s,2) as before.
        Of two charts that are each other's mirror image one is searched."""
        target, twin = np.full(self.count, np.inf), mirror_twins(missed, self.images)
        for k, chart in enumerate(missed):
            target[chart.faces] = spread[chart.faces] if twin[k] < 0 else np.inf
        search = replace(self.search(target), further=True, **changes)
        found = yield from part_of(self._cut(kept, search), 0.0, 0.9)
        if (twin < 0).all() and not len(slits):
            return found
        known = np.concatenate([found.found_cuts.edges, slits])
        originals = [missed[k].vertex_ids for k in twin[twin >= 0]]
        if originals and self.images is not None:
            inner = known[np.any([np.isin(known, ids).all(axis=1) for ids in originals], axis=0)]
            known = np.concatenate([known, self.images.exact[inner]])
        known = known[np.sort(np.unique(pair_keys(*known.T), return_index=True)[1])]
        none = replace(search, spread=np.full(self.count, np.inf))
        found = yield from part_of(self._cut(np.concatenate([kept, known]), none), 0.9, 0.1)
        cuts = found.found_cuts
        return replace(found, cuts=replace(cuts, edges=np.concatenate([known, cuts.edges])))

    def _cut(self, kept: np.ndarray, search: SeamSearch) -> Steps[DiskCharts]:
        """Charts with edges (k,2) that stay cut, and those that a search finds."""
        # Nobody has marked what pockets came off along.
        own = np.isin(pair_keys(*kept.T), pair_keys(*self.__dict__.get("pockets", NO_EDGES).T))
        surface = replace(self.surface, seams=np.concatenate([self.surface.seams, kept[~own]]))
        return disk_charts(surface, self.faces, search=replace(search, pocketed=kept[own]), **self.cutting)

    def with_images(self, charts: list[Chart], chosen: list[int]) -> list[int]:
        """The numbers of the chosen charts, with those of their mirror images: of two, the first is searched for both,
        and neither where that one is not chosen."""
        if not chosen:
            return []
        twin = mirror_twins(charts, self.images)
        one = {k for k in chosen if twin[k] < 0}
        return [k for k in range(len(charts)) if k in one or int(twin[k]) in one]

    def costs(self) -> SeamCosts:
        """What cutting the edges of the surface costs."""
        return self._costs

    @cached_property
    def memory(self) -> dict:
        """What a first search has found."""
        return {}

    @cached_property
    def models(self) -> dict:
        """Of the coarse surface of what a search has found last."""
        return {}

    @cached_property
    def rehearsals(self) -> dict[bytes, float | None]:
        """What small surfaces were found to shear: later searches come to the same ones."""
        return {}

    @cached_property
    def borders(self) -> tuple[TurnedCopies, TurnedCopies]:
        """Where parts come apart along hard edges: later searches come to the same ones."""
        return TurnedCopies(), TurnedCopies()

    @cached_property
    def pockets(self) -> np.ndarray:
        """The edges (k,2) around pockets of faces, which come apart before any search."""
        from .pockets import pocket_borders

        return pocket_borders(self.surface, self.faces, self.costs())

    @cached_property
    def thinned(self) -> list[np.ndarray]:
        """Polygons (k,) of parts whose seams were found on thinned surfaces, with all that was tried of maps."""
        return []

    @cached_property
    def lenience(self) -> np.ndarray:
        """See `ShearBound.lenience`."""
        return self.shear.lenience(self.surface, self.faces)

    def lenience_of(self, charts: list[Chart]) -> np.ndarray:
        """The same (k,) of charts."""
        return self.lenience[[chart.faces[0] for chart in charts]]

    def is_thinned(self, chart: Chart) -> bool:
        """Whether the seams of a chart were found on a thinned surface."""
        return any(np.isin(chart.faces[0], polygons) for polygons in self.thinned)

    @cached_property
    def images(self) -> MirrorImages | None:
        """The mirror images of the vertices of the surface; None without a mirror."""
        plane, triangles = self.costs().plane, self.surface.corner_vertex[self.surface.triangles]
        return None if plane is None else plane.images(self.surface.positions, triangles)

    @cached_property
    def _costs(self) -> SeamCosts:
        return seam_costs(self.surface, self.shear.preferences, self.faces)

    @property
    def axes(self) -> SceneAxes | None:
        """How the surface stands in the scene; as was told where no seam was searched."""
        return self._costs.axes if "_costs" in self.__dict__ else self.shear.preferences.axes

    @cached_property
    def _density(self) -> np.ndarray | None:
        if self.target is None:
            return None
        return means_of_polygons(self.target.density, self.surface.triangle_face, self.count)

    @property
    def count(self) -> int:
        """Polygons of the surface."""
        return len(self.surface.face_start) - 1


@dataclass(frozen=True)
class Round:
    """Charts, their maps and cuts, what the search for these has found, their areas (k,) and mean shear (k,), of parts
    that may shear more a root of it, the share (k,) that is steep, the mean but above the bound where too much is (k,),
    the numbers of those that miss it and may be cut for that, the keys (s,) of edges that stay cut when these are cut
    anew, and those (s,) of slits into what was steep."""

    charts: list[Chart]
    maps: list[ChartMap]
    cuts: Cuts
    memory: dict
    area: np.ndarray
    mean: np.ndarray
    steep: np.ndarray
    pressing: np.ndarray
    bound: float
    searched: list[int]
    settled: np.ndarray = field(default_factory=lambda: NO_EDGES[:, 0])
    slits: np.ndarray = field(default_factory=lambda: NO_EDGES[:, 0])

    @staticmethod
    def of(
        search: ShearSearch,
        charts: list[Chart],
        maps: list[ChartMap],
        cuts: Cuts,
        memory: dict,
        settled: np.ndarray = NO_EDGES[:, 0],
        slits: np.ndarray = NO_EDGES[:, 0],
    ) -> Round:
        shear = [local_shear(chart, one, search.target is None) for chart, one in zip(charts, maps, strict=True)]
        mean = np.array([area @ local / area.sum() for local, area in shear])
        area, bound = np.array([area.sum() for _, area in shear]), search.shear.bound
        # Slivers between sides have a shear, and nobody sees it.
        mean = np.where(area > LEAST_AREA * area.sum(), mean, 1.0) ** (1 / search.lenience_of(charts))
        steep = np.array([area[local > STEEP].sum() / area.sum() for local, area in shear])
        pressing = np.array([pressing_shear(*pair, bound) for pair in zip(mean, steep, strict=True)])
        missed = np.flatnonzero(pressing > bound)
        # What has no map at all is cut further without being asked: otherwise there would be nothing to look at.
        asked = [search.shear.further or one.failure is not None for one in maps]
        searched = [int(k) for k in missed if asked[k] or not is_marked(search.surface, charts[k])]
        return Round(charts, maps, cuts, memory, area, mean, steep, pressing, bound, searched, settled, slits)

    def kept(self, chosen: list[int]) -> np.ndarray:
        """The edges (e,2) that stay cut when charts of these numbers are cut anew."""
        keys, inner = pair_keys(*self.cuts.edges.T), all_within([self.charts[k] for k in chosen])
        return self.cuts.edges[~np.isin(keys, inner) | np.isin(keys, self.settled)]

    def with_slits(self, found: dict[int, np.ndarray]) -> Round:
        """The same that knows its slits among these edges (e,2)."""
        return replace(self, slits=np.union1d(self.slits, pair_keys(*np.concatenate([NO_EDGES, *found.values()]).T)))

    def slits_within(self, chosen: list[int]) -> np.ndarray:
        """The slits (e,2) within charts of these numbers."""
        keys = pair_keys(*self.cuts.edges.T)
        return self.cuts.edges[np.isin(keys, all_within([self.charts[k] for k in chosen])) & np.isin(keys, self.slits)]

    @property
    def excess(self) -> float:
        """What is searched misses the bound by, as a mean over the surface; 0 for nothing."""
        return float(self.missing.sum() / self.area.sum())

    def with_what_is_better(
        self, search: ShearSearch, new: Round, worse: set[tuple[bytes, bytes]]
    ) -> tuple[Round, set[tuple[bytes, bytes]]]:
        """The new round made of this one, but for charts that became worse while others became better, which are as
        they are here; and the identities `worse` with those of these."""
        of = self.chart_of(search, new)
        now = np.bincount(of, new.missing, len(self.charts))
        stay = now > self.missing + NO_EXCESS * self.area
        if not stay.any() or (stay | (now >= self.missing))[self.searched].all():
            return new, worse
        merged = self.merged(search, new, of, stay)
        return merged, worse | {identity(chart) for chart in itertools.compress(self.charts, stay)}

    def chart_of(self, search: ShearSearch, new: Round) -> np.ndarray:
        """The chart (k,) of this round that those of a new one are parts of."""
        region = chart_of_polygons(self.charts, search.count)
        return np.array([region[chart.faces[0]] for chart in new.charts])

    def merged(self, search: ShearSearch, new: Round, of: np.ndarray, stay: np.ndarray) -> Round:
        """A new round, but for the charts of this one that stay (k,) bool as they are, and those entangled with them;
        of: see `chart_of`."""
        region = chart_of_polygons(self.charts, search.count)
        stay = with_entangled(region, stay, new.charts)
        charts = [*itertools.compress(self.charts, stay), *itertools.compress(new.charts, ~stay[of])]
        maps = [*itertools.compress(self.maps, stay), *itertools.compress(new.maps, ~stay[of])]
        edges = np.unique(np.concatenate([self.cuts.edges, new.cuts.edges]), axis=0)
        edges = edges[np.isin(pair_keys(*edges.T), np.concatenate([outline(chart) for chart in charts]))]
        # What was found for parts that are as they were is forgotten.
        memory = {name: found for name, found in self.memory.items() if stay[region[found.polygons[0]]]}
        memory |= {name: found for name, found in new.memory.items() if not stay[region[found.polygons[0]]]}
        cuts = joined(search, self.cuts, edges)
        return Round.of(search, charts, maps, cuts, memory, self.settled, new.slits)

    @property
    def has_room(self) -> np.ndarray:
        """Charts (k,) bool that shear so much less than the bound that less of a cut may do."""
        return (self.pressing > 1) & (SLACK * self.room > 1)

    @property
    def room(self) -> np.ndarray:
        """How many times the square of log(shear) of each chart (k,) may be, before it or what is steep is too much."""
        of_mean = np.log(self.bound) ** 2 / np.maximum(np.log(self.pressing) ** 2, 1e-300)
        return np.minimum(of_mean, (MOST_STEEP / np.maximum(self.steep, 1e-300)) ** SHEAR_BY_STEEP)

    def found_for(self, k: int) -> list[Found]:
        """What searches have found for chart k as a whole."""
        faces = np.unique(self.charts[k].faces)
        return [one for one in self.memory.values() if np.array_equal(np.unique(one.polygons), faces)]

    def tell_stuck(self, memory: dict) -> None:
        """Remember for what a search whose seams were tried before found no more: asked for more it finds the same."""
        stuck = {name for name, found in memory.items() if found.is_stuck}
        self.memory.update({name: replace(one, is_stuck=True) for name, one in self.memory.items() if name in stuck})

    def to_be_searched(self, apart: dict[int, np.ndarray]) -> list[int]:
        """Charts to be searched again: not what comes apart, nor where a search has hardly got on, since such searches
        are long and the next one would get no farther."""
        stuck = [k for k in self.searched if any(one.is_stuck for one in self.found_for(k))]
        return [k for k in self.searched if k not in apart and k not in stuck]

    def shares(self, missed: list[int], promised: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
        """Shares (f,) of what cuts have left that are asked of the next, and squares (f,) of log(shear) that these
        promise; promised (f,) : by the last search"""
        share, promised = np.ones(len(promised)), promised.copy()
        for k in missed:
            faces, reached = self.charts[k].faces, np.log(self.pressing[k]) ** 2
            if self.maps[k].failure is not None:
                # How far it is from a map nobody knows.
                share[faces] = UNKNOWN
                continue
            # What the last search has promised and its map has not kept is asked for on top.
            kept_part = min(float(promised[faces].min()) / reached, 1.0)
            share[faces] = margin * kept_part * np.log(self.bound) ** 2 / reached
            promised[faces] = share[faces] * reached
        return share, promised

    @property
    def outline_length(self) -> np.ndarray:
        """The length (k,) of what is around each chart, both sides of a seam within it."""
        outlines = [edge_lengths(chart.vertices, boundary_edges(chart.triangles)) for chart in self.charts]
        return np.array([float(lengths.sum()) for lengths in outlines])

    @property
    def extent(self) -> np.ndarray:
        """How far each map (k,) extends."""
        return np.array([np.hypot(*np.ptp(one.uv, axis=0)) for one in self.maps])

    @property
    def outline_price(self) -> np.ndarray:
        """The same (k,) with a price on turns, see `straight_paths.closed_price`."""
        return np.array(
            [sum(closed_price(c.vertices, loop) for loop in boundary_loops(c.triangles)) for c in self.charts]
        )

    def settled_where_searched(self, search: ShearSearch, all_of_them: bool) -> Round:
        """The same, where charts that miss the bound, all of them or those of thinned surfaces, keep what was cut of
        them and are cut further: a search of one by itself would begin anew, and predicts it no better than one of the
        whole."""
        chosen = [self.charts[k] for k in self.searched]
        return replace(self, settled=all_within([one for one in chosen if all_of_them or search.is_thinned(one)]))

    def changes(self, rounds: int) -> dict[str, Any]:
        """What a search that is made again differs in, by the number of the round."""
        # Another draw may be worse, what is added is not.
        return {"adding": rounds > 1, "stays_whole": self.is_cut_further(rounds)}

    def is_cut_further(self, rounds: int) -> bool:
        """Whether pieces are cut further before they may come apart: limbs of a soft body can be hard by themselves."""
        return rounds == 1 and len(self.settled) > 0

    def share_allowed(self, k: int) -> float:
        """How many times the square of log(shear) of chart k may be, less a margin."""
        return float(MARGIN * self.room[k])

    def has_slack(self, k: int) -> bool:
        """Whether chart k, whose seams were searched, shears so much less than the bound that shorter ones may do."""
        return bool(self.has_room[k]) and bool(self.found_for(k))

    @property
    def missing(self) -> np.ndarray:
        """By how much each chart (k,) misses the bound, times its area; 0 where it is not searched."""
        missing = np.zeros(len(self.charts))
        missing[self.searched] = (self.area * (self.pressing - self.bound))[self.searched]
        return missing

    def is_hardly_better(self, before: Round) -> bool:
        """Whether hardly more of it keeps the bound than before, and much does not."""
        missing, then = (float(each.area[each.searched].sum()) for each in (self, before))
        is_as_much = self.excess > (1 - LITTLE) * before.excess and missing > (1 - LITTLE) * then
        return is_as_much and self.excess > NEARLY * self.bound


def pressing_shear(mean: float, steep: float, bound: float) -> float:
    """A mean shear, or one above the bound where too large a share is steep."""
    return max(mean, bound * (1 + steep)) if steep > MOST_STEEP and mean > 1 else mean


def joined(search: ShearSearch, cuts: Cuts, edges: np.ndarray) -> Cuts:
    """The same cuts, but along the edges (e,2)."""
    return replace(cuts, edges=edges, length=float(edge_lengths(search.surface.positions, edges).sum()))
