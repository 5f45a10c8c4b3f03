"""Bound the shear of maps: search the seams first, map once, and search on where a map misses the bound."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..cutting.cuts import Cuts
from ..cutting.disk_charts import DiskCharts
from ..errors import ENDED_EARLY, MORE_SEAMS
from ..mesh.charts import Chart
from ..mesh.geometry import edge_lengths
from ..mesh.topology import boundary_edges, pair_keys
from ..progress import EarlyEnd, Steps, part_of, unless_ended
from ..seams.options import SPREAD_BY_SHEAR
from .chart_indices import but_within, edge_set, identity, is_marked, outline
from .chart_map import ChartMap, local_shear
from .mirrored_charts import mapped_anew
from .options import ShearBound
from .shear_search import ShearSearch

if TYPE_CHECKING:
    from ..seams.coarse_cut import Found

# Maps that are made at most.
MOST_ROUNDS = 5
# What a search that is made again aims below the bound, so that it need not be the last but one; later ones less.
MARGIN = 0.95
# What misses the bound by less stays in one piece at first: it has so many times the square of log(shear).
CROWDED = 1.35
# After a second search, what lies on itself comes apart where that leaves this share of what is missing at most.
ROOM = 0.5
# Nothing comes apart for less than this share of the bound.
HARDLY = 0.01
# What shears more than this is seen on any checker, and charts with more of it than that share are cut further.
STEEP = 3.0
MOST_STEEP = 0.01
# So many times what is steep beyond that share is slit, and this share of a chart more every time that was no help.
SLIT = 1.5
MORE_SLIT = 0.001
# What is steep alone is slit so many times before it may come apart.
SLIT_AT_FIRST = 2
# What misses the bound by less after a second search is slit where it shears more than that.
NEARLY = 0.03
SHEARED = 2.0
# Where a second search and later ones take off less than this share of what is missing, no seams are left that pay.
LITTLE = 0.1
# A chart with less than this share of the square of log(shear) that the bound allows may do with a shorter cut, which
# is mapped where all are shorter by this share at least.
SLACK = 0.85
WORTHWHILE = 0.03
# Where that misses the bound, one that uses up less of what is allowed may not: powers of it.
HOPES = (1.0, 0.5)
# Of what came apart parts with this share of the area are searched anew.
LARGE_PART = 0.03
# Charts of less than this share of the area count for nothing.
LEAST_AREA = 1e-4
# A mean excess of the shear up to this is not worse than none: what was parted is cut further.
NO_EXCESS = 0.005
# What has no map is asked for this share of what cuts have left.
UNKNOWN = 0.5
# Where the time goes, roughly: seams take this share of every round.
SEARCHING = 0.25
# Where charts lie on themselves that may, before that.
PARTING = 0.3


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


def bound_shear(
    search: ShearSearch,
    first: DiskCharts,
    maps: list[ChartMap],
    map_charts: Callable[[list[Chart]], Steps[list[ChartMap]]],
    crossing: Callable[[Chart, ChartMap], Steps[np.ndarray]] | None = None,
) -> Steps[BoundedShear]:
    """Cut charts anew whose maps shear more than a bound, and map them again, until all keep it or the worst stays.

    first, maps : charts whose seams were searched for the bound, and their maps; map_charts : a solver for charts;
    crossing : refines a map so that it may lie on itself; charts that then keep the bound are parted where they do.
    Progress offers an early end: with the maps of the last round. Errors: see `disk_charts.disk_charts`, `map_charts`.
    """
    early = EarlyEnd()
    best = last = _Round.of(search, first.charts, maps, first.found_cuts, search.memory)
    spread, promised = search.first_spread(), np.full(search.count, np.inf)
    tried = {edge_set(last.cuts.edges)}
    rehearsed, crossed, worse = dict[str, Any](), False, set[tuple[bytes, bytes]]()
    for rounds in range(1, MOST_ROUNDS):
        if last.excess > max(best.excess, NO_EXCESS):
            # What coarse maps tell does not hold here, or it is no use to part what lies on itself.
            last, rehearsed = best, {"rehearse": None}
            crossing = None if crossed else crossing
            promised[:] = np.inf
        if not last.searched:
            break
        is_stuck, best = rounds > 1 and last is not best and last.is_hardly_better(best), last
        begin = 1 - 0.5 ** (rounds - 1)
        width = (1 - begin) / 2
        parting = _apart(search, last, crossing, rounds, worse)
        parts = yield from unless_ended(part_of(parting, begin, width * PARTING), early)
        if parts is None or (is_stuck and not parts[0]):
            break
        apart, flat, crossed = parts
        missed = [k for k in last.searched if k not in apart]
        share, promised = _shares(last, missed, promised, MARGIN ** (1 / rounds))
        spread = spread * share**SPREAD_BY_SHEAR
        begin, width = begin + width * PARTING, width * (1 - PARTING)
        kept = but_within(last.cuts.edges, [last.charts[k] for k in (*missed, *flat)])
        kept = np.concatenate([kept, *apart.values()])
        # One other draw may be shorter than a longer cut, or worse; what is added to shears less, but for luck.
        changes = {"share": share, "adding": rounds > 1} | rehearsed
        asked = _Asked(missed, kept, spread, changes, lambda edges: edge_set(edges) not in tried)
        new = yield from part_of(_cut_anew(search, last, asked, map_charts, early), begin, width)
        if new is None:
            break
        if new is last:
            # It has not kept what it promised, and so more is asked for.
            continue
        tried.add(edge_set(new.cuts.edges))
        last, worse = last.with_what_is_better(search, new, worse)
    else:
        rounds = MOST_ROUNDS
    best = last if last.excess <= best.excess else best
    if not best.excess and not early.is_asked:
        begin = 1 - 0.5 ** (rounds - 1)
        half = (1 - begin) / 2
        best = yield from part_of(_taken_back(search, best, map_charts, early), begin, half)
        best = yield from part_of(_parts_cut_anew(search, best, map_charts, early), begin + half, half)
    return best.result(search.shear, first.warnings, ENDED_EARLY if early.is_asked else MORE_SEAMS)


@dataclass(frozen=True)
class _Asked:
    """Numbers of charts to be cut anew for a spread (f,), the edges (k,2) that stay cut all the same, what changes in
    the search, and whether edges (k,2) that it comes to are worth a map."""

    charts: list[int]
    kept: np.ndarray
    spread: np.ndarray
    changes: dict[str, Any]
    is_worth: Callable[[np.ndarray], bool]


def _cut_anew(search: ShearSearch, last: _Round, asked: _Asked, map_charts, early: EarlyEnd) -> Steps[_Round | None]:
    """The next round; the last one where what was found is not worth a map, and None where the end was asked for."""
    memory = dict(last.memory)
    chosen = [last.charts[k] for k in asked.charts]
    cutting = search.again(asked.kept, chosen, asked.spread, asked.changes | {"memory": memory})
    again = yield from unless_ended(part_of(cutting, 0.0, SEARCHING), early)
    if again is None:
        return None
    edges = np.concatenate([asked.kept, again.found_cuts.edges])
    if not asked.is_worth(edges):
        return last
    mapping = mapped_anew(again.charts, list(zip(last.charts, last.maps, strict=True)), map_charts)
    mapped = yield from unless_ended(part_of(mapping, SEARCHING, 1 - SEARCHING), early)
    if mapped is None:
        return None
    return _Round.of(search, again.charts, mapped, _joined(search, last.cuts, edges), memory)


def _taken_back(search: ShearSearch, last: _Round, map_charts, early: EarlyEnd) -> Steps[_Round]:
    """A round within the bound with shorter cuts, where rehearsals had asked for more than maps needed, if these keep
    the bound, too; as it is otherwise."""
    longer = [k for k in range(len(last.charts)) if _has_slack(last, k)]
    if not longer:
        return last
    kept = but_within(last.cuts.edges, [last.charts[k] for k in longer])

    def is_worth(edges: np.ndarray) -> bool:
        return _joined(search, last.cuts, edges).length <= (1 - WORTHWHILE) * last.cuts.length

    for k, hope in enumerate(HOPES):
        share = np.ones(search.count)
        for chart in longer:
            share[last.charts[chart].faces] = _share_allowed(last, chart) ** hope
        spread = search.first_spread() * share**SPREAD_BY_SHEAR
        asked = _Asked(longer, kept, spread, {"share": share, "adding": True}, is_worth)
        cutting = _cut_anew(search, last, asked, map_charts, early)
        new = yield from part_of(cutting, k / len(HOPES), 1 / len(HOPES))
        if new is None or new is last:
            break
        if not new.searched:
            return new
    return last


def _parts_cut_anew(search: ShearSearch, last: _Round, map_charts, early: EarlyEnd) -> Steps[_Round]:
    """A round within the bound whose parts have cuts of their own, where these are shorter than what was cut of the
    whole before it came apart, and keep the bound, too."""
    large = last.area >= LARGE_PART * last.area.sum()
    parts = [
        k
        for k in np.flatnonzero(large & last.has_room).tolist()
        if not last.found_for(k) and (search.shear.further or not is_marked(search.surface, last.charts[k]))
    ]
    if len(last.charts) < 2 or not parts:
        return last
    kept = but_within(last.cuts.edges, [last.charts[k] for k in parts])
    asked = _Asked(parts, kept, search.first_spread(), {}, lambda edges: len(edges) > 0)
    new = yield from _cut_anew(search, last, asked, map_charts, early)
    if new is None or new is last:
        return last
    of = last.chart_of(search, new)
    missed = np.bincount(of, new.pressing > new.bound, len(last.charts)) > 0
    # The outline of a part is there before and after.
    length = np.array([_outline_length(chart) for chart in last.charts])
    shorter = np.bincount(of, [_outline_length(chart) for chart in new.charts], len(length)) < length
    stay = missed | ~shorter
    return last if stay.all() else last.merged(search, new, of, stay)


def _outline_length(chart: Chart) -> float:
    return float(edge_lengths(chart.vertices, boundary_edges(chart.triangles)).sum())


def _share_allowed(last: _Round, k: int) -> float:
    """How many times the square of log(shear) of chart k may be."""
    return float(MARGIN * np.log(last.bound) ** 2 / np.log(last.pressing[k]) ** 2)


def _has_slack(last: _Round, k: int) -> bool:
    """Whether chart k, as it was rehearsed, shears so much less than the bound that a shorter cut may do."""
    return bool(last.has_room[k]) and any(one.rehearsed is not None for one in last.found_for(k))


@dataclass(frozen=True)
class _Round:
    """Charts, their maps and cuts, what the search for these has found, their areas (k,) and mean shear (k,), the same
    but above the bound where too much is steep (k,), and the numbers of those that miss it and may be cut for that."""

    charts: list[Chart]
    maps: list[ChartMap]
    cuts: Cuts
    memory: dict
    area: np.ndarray
    mean: np.ndarray
    pressing: np.ndarray
    bound: float
    searched: list[int]

    @staticmethod
    def of(search: ShearSearch, charts: list[Chart], maps: list[ChartMap], cuts: Cuts, memory: dict) -> _Round:
        shear = [local_shear(chart, one, search.target is None) for chart, one in zip(charts, maps, strict=True)]
        mean = np.array([area @ local / area.sum() for local, area in shear])
        area, bound = np.array([area.sum() for _, area in shear]), search.shear.bound
        # Slivers between sides have a shear, and nobody sees it.
        mean = np.where(area > LEAST_AREA * area.sum(), mean, 1.0)
        steep = np.array([area[local > STEEP].sum() / area.sum() for local, area in shear])
        pressing = np.array([_pressing(*pair, bound) for pair in zip(mean, steep, strict=True)])
        missed = np.flatnonzero(pressing > bound)
        # What has no map at all is cut further without being asked: otherwise there would be nothing to look at.
        asked = [search.shear.further or one.failure is not None for one in maps]
        searched = [int(k) for k in missed if asked[k] or not is_marked(search.surface, charts[k])]
        return _Round(charts, maps, cuts, memory, area, mean, pressing, bound, searched)

    @property
    def excess(self) -> float:
        """What is searched misses the bound by, as a mean over the surface; 0 for nothing."""
        return float(self.missing.sum() / self.area.sum())

    def with_what_is_better(
        self, search: ShearSearch, new: _Round, worse: set[tuple[bytes, bytes]]
    ) -> tuple[_Round, set[tuple[bytes, bytes]]]:
        """The new round made of this one, but for charts that became worse while others became better, which are as
        they are here; and the identities `worse` with those of these."""
        of = self.chart_of(search, new)
        now = np.bincount(of, new.missing, len(self.charts))
        stay = now > self.missing + NO_EXCESS * self.area
        if not stay.any() or (stay | (now >= self.missing))[self.searched].all():
            return new, worse
        merged = self.merged(search, new, of, stay)
        return merged, worse | {identity(chart) for chart in itertools.compress(self.charts, stay)}

    def _region(self, search: ShearSearch) -> np.ndarray:
        """The chart (f,) that polygons of the surface are in, -1 for none."""
        region = np.full(search.count, -1)
        for k, chart in enumerate(self.charts):
            region[chart.faces] = k
        return region

    def chart_of(self, search: ShearSearch, new: _Round) -> np.ndarray:
        """The chart (k,) of this round that those of a new one are parts of."""
        region = self._region(search)
        return np.array([region[chart.faces[0]] for chart in new.charts])

    def merged(self, search: ShearSearch, new: _Round, of: np.ndarray, stay: np.ndarray) -> _Round:
        """A new round, but for the charts of this one that stay (k,) bool as they are; of: see `chart_of`."""
        charts = [*itertools.compress(self.charts, stay), *itertools.compress(new.charts, ~stay[of])]
        maps = [*itertools.compress(self.maps, stay), *itertools.compress(new.maps, ~stay[of])]
        edges = np.unique(np.concatenate([self.cuts.edges, new.cuts.edges]), axis=0)
        edges = edges[np.isin(pair_keys(*edges.T), np.concatenate([outline(chart) for chart in charts]))]
        # What was found for parts that are as they were is forgotten.
        region = self._region(search)
        memory = {name: found for name, found in self.memory.items() if stay[region[found.polygons[0]]]}
        memory |= {name: found for name, found in new.memory.items() if not stay[region[found.polygons[0]]]}
        return _Round.of(search, charts, maps, _joined(search, self.cuts, edges), memory)

    @property
    def has_room(self) -> np.ndarray:
        """Charts (k,) bool that shear so much less than the bound that less of a cut may do."""
        squares = np.log(self.pressing) ** 2
        return (squares > 0) & (squares < SLACK * np.log(self.bound) ** 2)

    def found_for(self, k: int) -> list[Found]:
        """What searches have found for chart k as a whole."""
        faces = np.unique(self.charts[k].faces)
        return [one for one in self.memory.values() if np.array_equal(np.unique(one.polygons), faces)]

    @property
    def missing(self) -> np.ndarray:
        """By how much each chart (k,) misses the bound, times its area; 0 where it is not searched."""
        missing = np.zeros(len(self.charts))
        missing[self.searched] = (self.area * (self.pressing - self.bound))[self.searched]
        return missing

    def is_hardly_better(self, before: _Round) -> bool:
        """Whether hardly more of it keeps the bound than before, and much does not."""
        return self.excess > max((1 - LITTLE) * before.excess, NEARLY * self.bound)

    def result(self, shear: ShearBound, warnings: tuple[str, ...], why: str) -> BoundedShear:
        """Its charts and maps, with warnings of how they were made and of those that miss the bound; why they do."""
        by_hand = ~np.isin(np.arange(len(self.charts)), self.searched)
        missed = tuple(shear.missed(self.mean, self.area, by_hand, why))
        return BoundedShear(DiskCharts(self.charts, self.cuts, warnings), self.maps, missed)


def _pressing(mean: float, steep: float, bound: float) -> float:
    """A mean shear, or one above the bound where too large a share is steep."""
    return max(mean, bound * (1 + steep)) if steep > MOST_STEEP and mean > 1 else mean


def _shares(last: _Round, missed: list[int], promised: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Shares (f,) of what cuts have left that are asked of the next, and squares (f,) of log(shear) that these promise.

    promised (f,) : by the last search
    """
    share, promised = np.ones(len(promised)), promised.copy()
    for k in missed:
        faces, reached = last.charts[k].faces, np.log(last.pressing[k]) ** 2
        if last.maps[k].failure is not None:
            # How far it is from a map nobody knows.
            share[faces] = UNKNOWN
            continue
        # What the last search has promised and its map has not kept is asked for on top.
        kept_part = min(float(promised[faces].min()) / reached, 1.0)
        share[faces] = margin * kept_part * np.log(last.bound) ** 2 / reached
        promised[faces] = share[faces] * reached
    return share, promised


def _apart(
    search: ShearSearch,
    last: _Round,
    crossing: Callable[[Chart, ChartMap], Steps[np.ndarray]] | None,
    rounds: int,
    worse: set[tuple[bytes, bytes]],
) -> Steps[tuple[dict[int, np.ndarray], list[int], bool]]:
    """Edges (e,2), by the number of a chart, that part it around its flat sides, or where it lies in its own way, or
    slit it; the numbers of those with flat sides, which need no other cuts; and whether any lies in its own way.

    worse : the identities of charts whose parts were worse than they are
    """
    found: dict[int, np.ndarray] = {}
    flat, crossed = list[int](), False
    late = rounds > 1 or any(found.gave_up for found in last.memory.values())
    # What has no map is cut further, and nothing else helps.
    chosen = [k for k in last.searched if last.maps[k].failure is None]
    if not chosen:
        return found, flat, crossed
    from ..seams.parting import flat_sides  # Hardly any chart misses its bound.

    for k in chosen:
        mean, whole = last.mean[k], identity(last.charts[k]) in worse
        edges = np.zeros((0, 2), np.int64) if whole or mean <= last.bound else flat_sides(last.charts[k])
        if len(edges):
            flat.append(k)
        elif crossing is not None and not whole and _may_cross(last, k, late, rounds):
            uv = yield from crossing(last.charts[k], last.maps[k])
            edges = _uncrossed(search, last, k, uv, late)
            crossed |= len(edges) > 0
        if not len(edges) and mean <= (1 + NEARLY * late) * last.bound:
            # No other cut is needed, but one into what shears that much.
            edges = _slit(search, last, k, rounds)
        found |= {k: edges} if len(edges) else {}
    return found, flat, crossed


def _may_cross(last: _Round, k: int, late: bool, rounds: int) -> bool:
    """Whether chart k misses the bound by so much that it may lie in its own way, or was slit in vain."""
    missed = last.mean[k] > (1 + HARDLY) * last.bound
    much = np.log(last.mean[k]) >= np.sqrt(CROWDED) * np.log(last.bound)
    return rounds > SLIT_AT_FIRST or bool(missed and (late or much))


def _uncrossed(search: ShearSearch, last: _Round, k: int, uv: np.ndarray, late: bool) -> np.ndarray:
    """Edges (e,2) that part chart k between what lies on itself in a map uv (n,2) that may, where that is what it
    misses the bound for."""
    from ..seams.parting import parted

    chart, mean = last.charts[k], last.mean[k]
    shear, area = local_shear(chart, replace(last.maps[k], uv=uv), search.target is None)
    both = float(area @ shear / area.sum()), float(area[shear > STEEP].sum() / area.sum())
    mild = mean <= last.bound
    missed, without = (last.pressing[k], _pressing(*both, last.bound)) if mild else (mean, both[0])
    if without > last.bound + late * ROOM * (missed - last.bound):
        return np.zeros((0, 2), np.int64)
    return parted(chart, uv, search.costs().vertex_cost[chart.vertex_ids], search.images)


def _slit(search: ShearSearch, last: _Round, k: int, rounds: int) -> np.ndarray:
    """Edges (e,2) from the seams around chart k into what is steep, or, where its mean misses the bound, sheared; more
    than the last time."""
    from ..seams.parting import slits

    chart = last.charts[k]
    shear, area = local_shear(chart, last.maps[k], search.target is None)
    missed = max(last.mean[k] / last.bound - 1, 0.0)
    steep = shear > (STEEP if missed == 0 else SHEARED)
    excess = float(area[steep].sum() / area.sum() - MOST_STEEP) if missed == 0 else missed
    costs, here = search.costs(), chart.vertex_ids
    least, barred = (SLIT * excess + MORE_SLIT * (rounds - 1)) * area.sum(), costs.in_face[here]
    return slits(chart, steep, least, costs.vertex_cost[here], barred, search.images, rounds)


def _joined(search: ShearSearch, cuts: Cuts, edges: np.ndarray) -> Cuts:
    """The same cuts, but along the edges (e,2)."""
    return replace(cuts, edges=edges, length=float(edge_lengths(search.surface.positions, edges).sum()))
