"""Bound the shear of maps: search the seams first, map once, and search on where a map misses the bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..cutting.disk_charts import DiskCharts
from ..errors import ENDED_EARLY, MORE_SEAMS
from ..mesh.charts import Chart
from ..progress import EarlyEnd, Steps, part_of, unless_ended
from ..revolution.axis import has_axis
from ..seams.options import COMPACT, SPREAD_BY_SHEAR
from .chart_indices import but_within, edge_set, is_marked
from .chart_map import ChartMap
from .mirrored_charts import mapped_anew
from .pieces import come_apart, may_come_in_pieces
from .shear_search import (
    MARGIN,
    NEARLY,
    NO_EDGES,
    NO_EXCESS,
    UNSHEARED,
    Round,
    ShearSearch,
    joined,
)

# Maps that are made at most.
MOST_ROUNDS = 5
# After so many rounds one that is hardly better than the one before is the last.
TRIED = 2
# A shorter cut is mapped where all are shorter by this share at least.
WORTHWHILE = 0.03
# Where that misses the bound, one that uses up less of what is allowed may not: powers of it.
HOPES = (1.0, 0.5)
# What misses the bound by less may keep it with areas that are no more exact than is promised.
SPARED = 0.05
# Of what came apart parts with this share of the area are searched anew, unless they lie flat: a shorter cut would go
# across what does along its edges.
LARGE_PART = 0.03
# They keep what has at most this share of the length: what was cut of the whole goes through, along a tube, and cuts of
# its own end in slits.
SHORTER_PART = 0.9
# Of charts with more vertices cuts are straight, but for what the search has no eye for.
IN_STEPS = 10000
# Straighter and shorter ones leave at most so many times the log(shear) of those before, where that was no more than
# this: sides that lie flat are to stay so.
AS_SHEARED = 1.2
NEARLY_FLAT = 1.1
# Charts that shear more come apart around flat sides, where that leaves no more than this share of log(shear).
SHEARED_SIDES = 1.05
LEFT = 0.5
# Where the time goes, roughly: seams take this share of every round.
SEARCHING = 0.25
# Where charts lie on themselves that may, before that.
PARTING = 0.3
# What misses the bound whatever is cut comes apart in two so many times.
MOST_HALVINGS = 3
# At first only what misses its areas by more, far more than is promised.
STUCK = 0.1
# What has a larger excess at first comes apart along all creases at once, if they are those of a hard body, such as a
# helical gear: further searches cut it in strips. Animals have a third of it at most.
FAR = 0.3
# Charts that are joined again, at the end.
JOINING = 0.05


@dataclass(frozen=True)
class Asked:
    """Numbers of charts to be cut anew for a spread (f,), the edges (k,2) that stay cut all the same, what changes in
    the search, whether edges (k,2) that it comes to are worth a map, and the slits (s,2) that are made again."""

    charts: list[int]
    kept: np.ndarray
    spread: np.ndarray
    changes: dict[str, Any]
    is_worth: Callable[[np.ndarray], bool]
    slits: np.ndarray = field(default_factory=lambda: NO_EDGES)

    @staticmethod
    def of(
        last: Round,
        missed: list[int],
        apart: dict[int, np.ndarray],
        flat: list[int],
        spread: np.ndarray,
        changes: dict[str, Any],
        tried: set[bytes],
    ) -> Asked:
        """What is asked of charts of a round that missed the bound, and of what is left of those that come apart around
        flat sides; worth a map is what was not tried."""
        chosen = [*missed, *flat]
        kept = [but_within(last.kept(missed), [last.charts[k] for k in flat]), *apart.values()]
        return Asked(chosen, np.concatenate(kept), spread, changes, lambda edges: edge_set(edges) not in tried)


@dataclass(frozen=True)
class BoundedShear:
    """Charts cut until their maps shear less than a bound.

    Attributes
    ----------
    prepared : the charts, and all cuts
    maps : of the charts
    warnings : which of them miss it, and what helps
    ended_early : somebody has asked for the end
    is_short : no shorter cuts are left to be looked for
    """

    prepared: DiskCharts
    maps: list[ChartMap]
    warnings: tuple[str, ...]
    ended_early: bool = False
    is_short: bool = True


def bound_shear(
    search: ShearSearch,
    first: DiskCharts,
    maps: list[ChartMap],
    map_charts: Callable[[list[Chart]], Steps[list[ChartMap]]],
    crossing: Callable[[Chart, ChartMap], Steps[np.ndarray]] | None = None,
    map_sparing: Callable[[list[Chart]], Steps[list[ChartMap]]] | None = None,
    of_pieces: bool = False,
    may_part: bool = False,
) -> Steps[BoundedShear]:
    """Cut charts anew whose maps shear more than a bound, and map them again, until all keep it or the worst stays.

    first, maps : charts whose seams were searched for the bound, and their maps; map_charts : a solver for charts;
    crossing : refines a map so that it may lie on itself; charts that then keep the bound are parted where they do.
    map_sparing : a solver that shears less, for areas no more exact than is promised; of_pieces : charts are pieces of
    a whole that was searched; may_part : charts are asked for pieces after this, and those that may come in some, which
    have seams of their own, are not cut shorter before. Progress offers an early end: with the maps of the last round.
    Errors: see `map_charts`.
    """
    early, free = EarlyEnd(), crossing is not None
    begun = yield from part_of(_first_round(search, first, maps, map_charts, free, early), 0.0, 0.0)
    begun = begun.settled_where_searched(search, all_of_them=of_pieces)
    rounds = _further_rounds(search, begun, map_charts, crossing, map_sparing, early, may_part)
    found, is_short = yield from part_of(rounds, 0.0, 1 - JOINING)
    if not early.is_asked:
        found = yield from part_of(_joined_again(search, begun, found, map_charts, early), 1 - JOINING, JOINING)
    return _result(found, search, first.warnings, early, is_short)


def _further_rounds(
    search: ShearSearch, begun: Round, map_charts, crossing, map_sparing, early: EarlyEnd, may_part: bool
) -> Steps[tuple[Round, bool]]:
    """The best of the rounds after a first one, see `bound_shear`, made shorter where it keeps the bound, and whether
    it is: not before it comes in pieces."""
    begun = yield from part_of(_in_halves(search, begun, map_charts, early, stuck=True), 0.0, 0.0)
    if begun.excess > FAR:
        begun = yield from part_of(_along_all_creases(search, begun, map_charts, early), 0.0, 0.0)
    best = last = begun
    spread, promised, crossed = search.first_spread(), np.full(search.count, np.inf), False
    tried, worse, rehearsed = {edge_set(last.cuts.edges)}, set[tuple[bytes, bytes]](), dict[str, Any]()
    for rounds in range(1, MOST_ROUNDS):
        if last.excess > max(best.excess, NO_EXCESS):
            # What coarse maps tell does not hold here, or it is no use to part what lies on itself.
            last, rehearsed = best, {"rehearse": None}
            crossing = None if crossed else crossing
            promised[:] = np.inf
        begin, width = 1 - 0.5 ** (rounds - 1), 0.5**rounds
        if not last.searched:
            break
        if (last.mean <= (1 + NEARLY) * last.bound).all():
            # What is steep alone, as single triangles of a coarse mesh are, need not be slit, and what misses the bound
            # by little not be searched.
            spared = yield from part_of(_with_areas_spared(search, last, map_sparing, early), begin, 0.0)
            if not spared.searched:
                return spared, True
        is_stuck, best = rounds > TRIED and last is not best and last.is_hardly_better(best), last
        parting = part_of(come_apart(search, last, crossing, rounds, worse), begin, width * PARTING)
        parts = yield from unless_ended(parting, early)
        if parts is None or (is_stuck and not parts[0]):
            break
        apart, flat, crossed = parts
        if not ((missed := last.to_be_searched(apart)) or apart):
            break
        share, promised = last.shares(missed, promised, MARGIN ** (1 / rounds))
        spread = spread * share**SPREAD_BY_SHEAR
        changes = {"share": share} | last.changes(rounds) | rehearsed
        asked = Asked.of(last, missed, apart, flat, spread, changes, tried)
        anew = _cut_anew(search, last, asked, map_charts, early)
        new = yield from part_of(anew, begin + width * PARTING, width * (1 - PARTING))
        if new is None:
            break
        if new is not last:  # Else more is asked for.
            tried.add(edge_set(new.cuts.edges))
            last, worse = last.with_what_is_better(search, new.with_slits(apart), worse)
    else:
        begin = 1 - 0.5 ** (MOST_ROUNDS - 1)
    best = last if last.excess <= best.excess else best
    if early.is_asked:
        return best, True
    if may_part and not best.excess and may_come_in_pieces(search, best):
        return best, False
    return (yield from part_of(_made_shorter(search, best, map_charts, map_sparing, early), begin, 1 - begin)), True


def _joined_again(search: ShearSearch, begun: Round, last: Round, map_charts, early: EarlyEnd) -> Steps[Round]:
    """A round with charts joined that came apart after the first round, see `rejoining.rejoined`."""
    if len(last.charts) <= len(begun.charts):
        return last
    from .rejoining import rejoined

    def cut(last: Round, kept: np.ndarray, most: float) -> Steps[Round | None]:
        asked = Asked(
            [], kept, search.first_spread(), {}, lambda edges: joined(search, last.cuts, edges).length <= most
        )
        return (yield from _cut_anew(search, last, asked, map_charts, early))

    return (yield from rejoined(search, begun, last, cut))


def _first_round(
    search: ShearSearch, prepared: DiskCharts, maps: list[ChartMap], map_charts, free: bool, early: EarlyEnd
) -> Steps[Round]:
    """Charts and maps as they are; if boundaries are free, those come apart around large flat sides between sharp edges
    where that takes most of what they are sheared away: a blade shows it although its chart keeps the bound."""
    first = Round.of(search, prepared.charts, maps, prepared.found_cuts, search.memory)
    kept_free = search.cutting.get("avoid") is not None
    if not free or kept_free or search.target is not None:  # A density asked for shears what is flat.
        return first
    from ..seams.parting import flat_sides

    may = [search.shear.further or not is_marked(search.surface, chart) for chart in first.charts]
    sheared = (first.mean > SHEARED_SIDES) & (first.area > LARGE_PART * first.area.sum()) & may
    sides = {int(k): flat_sides(first.charts[k], sharp=True) for k in np.flatnonzero(sheared)}
    sides = {k: edges for k, edges in sides.items() if len(edges)}
    if not sides:
        return first
    asked = Asked.of(first, [], sides, list(sides), search.first_spread(), {}, set())
    new = yield from _cut_anew(search, first, asked, map_charts, early)
    if new is None:
        return first
    of, count = first.chart_of(search, new), len(first.charts)
    left = np.bincount(of, new.area * np.log(new.mean), count) > LEFT * first.area * np.log(first.mean)
    # What misses the bound in any case is cut further, in parts that need little of it.
    stay = left | ((np.bincount(of, new.missing, count) > first.missing) & (first.missing == 0))
    return first if stay.all() else first.merged(search, new, of, stay)


def _cut_anew(search: ShearSearch, last: Round, asked: Asked, map_charts, early: EarlyEnd) -> Steps[Round | None]:
    """The next round; the last one where what was found is not worth a map, and None where the end was asked for."""
    memory = dict(last.memory)
    chosen = [last.charts[k] for k in asked.charts]
    cutting = search.again(asked.kept, chosen, asked.spread, asked.changes | {"memory": memory}, asked.slits)
    again = yield from unless_ended(part_of(cutting, 0.0, SEARCHING), early)
    if again is None:
        return None
    edges = np.concatenate([asked.kept, again.found_cuts.edges])
    if not asked.is_worth(edges):
        last.tell_stuck(memory)
        return last
    mapping = mapped_anew(again.charts, list(zip(last.charts, last.maps, strict=True)), map_charts)
    mapped = yield from unless_ended(part_of(mapping, SEARCHING, 1 - SEARCHING), early)
    if mapped is None:
        return None
    cuts = joined(search, last.cuts, edges)
    return Round.of(search, again.charts, mapped, cuts, memory, last.settled, last.slits)


def _along_all_creases(search: ShearSearch, last: Round, map_charts, early: EarlyEnd) -> Steps[Round]:
    """A round that misses its bound, or where it misses it by less one whose charts come apart along all creases."""
    again = (last.searched, last.kept(last.searched), search.first_spread(), {"as_drawn": True})
    new = yield from _cut_anew(search, last, Asked(*again, lambda edges: True), map_charts, early)
    return last if new is None or new.excess >= last.excess else new


def _is_stuck(chart_map: ChartMap) -> bool:
    """Whether a map is far from its areas although it took all steps that it may: its boundary is in its own way, and
    longer cuts are no help."""
    return chart_map.status == "steps" and STUCK < chart_map.area_l1 < np.inf


def _in_halves(search: ShearSearch, last: Round, map_charts, early: EarlyEnd, stuck: bool = False) -> Steps[Round]:
    """A round whose charts that miss the bound by much, or those of them whose maps are stuck, come apart in two, again
    where that was of help: nothing else was. Where something is to be kept free of cuts they stay whole."""
    from ..seams.parting import halves

    for _ in range(MOST_HALVINGS):
        missed = [k for k in last.searched if last.mean[k] > (1 + NEARLY) * last.bound]
        missed = [k for k in missed if not stuck or _is_stuck(last.maps[k])]
        if not missed or search.cutting.get("avoid") is not None:
            break
        edges = [halves(last.charts[k], search.costs().vertex_cost) for k in missed]
        kept = np.concatenate([last.kept(missed), *edges])
        asked = Asked(missed, kept, search.first_spread(), {}, lambda edges: True)
        new = yield from _cut_anew(search, last, asked, map_charts, early)
        if new is None or new.excess >= last.excess or new.is_hardly_better(last):
            break
        last = new
    return last


def _made_shorter(search: ShearSearch, last: Round, map_charts, map_sparing, early: EarlyEnd) -> Steps[Round]:
    """The last round with areas spared where it misses the bound, and with shorter cuts where it does not."""
    if last.excess > NEARLY * last.bound:
        last = yield from part_of(_along_all_creases(search, last, map_charts, early), 0.0, 0.0)
        last = yield from part_of(_in_halves(search, last, map_charts, early), 0.0, 0.0)
    if last.excess:
        return (yield from _with_areas_spared(search, last, map_sparing, early))
    last = yield from part_of(_taken_back(search, last, map_charts, early), 0.0, 0.4)
    last = yield from part_of(_parts_cut_anew(search, last, map_charts, early), 0.4, 0.3)
    return (yield from part_of(_straightened(search, last, map_charts, early), 0.7, 0.3))


def _with_areas_spared(search: ShearSearch, last: Round, map_sparing, early: EarlyEnd) -> Steps[Round]:
    """A round with other maps of the charts that miss the bound by little, where these do so by less: on coarse meshes
    with limbs the last half of a hundredth of the areas shears more than a further seam takes away."""
    if map_sparing is None or not (last.pressing[last.searched] <= (1 + SPARED) * last.bound).all():
        return last
    chosen = [last.charts[k] for k in last.searched]
    starts = [None if last.maps[k].folds else last.maps[k] for k in last.searched]
    mapped = yield from unless_ended(map_sparing(chosen, starts), early)
    if not mapped:
        return last
    spared = dict(zip(last.searched, mapped, strict=True))
    maps = [spared.get(k, one) for k, one in enumerate(last.maps)]
    new = Round.of(search, last.charts, maps, last.cuts, last.memory, last.settled, last.slits)
    if new.excess >= last.excess:
        return last
    return new if new.excess else (yield from _straightened(search, new, map_sparing, early))


def _taken_back(search: ShearSearch, last: Round, map_charts, early: EarlyEnd) -> Steps[Round]:
    """A round within the bound with shorter cuts, where searches had asked for more than maps needed, if these keep
    the bound, too; as it is otherwise."""
    longer = search.with_images(last.charts, [k for k in range(len(last.charts)) if last.has_slack(k)])
    if not longer:
        return last
    kept = last.kept(longer)

    def is_worth(edges: np.ndarray) -> bool:
        return joined(search, last.cuts, edges).length <= (1 - WORTHWHILE) * last.cuts.length

    for k, hope in enumerate(HOPES):
        share = np.ones(search.count)
        for chart in longer:
            share[last.charts[chart].faces] = last.share_allowed(chart) ** hope
        spread = search.first_spread() * share**SPREAD_BY_SHEAR
        asked = Asked(longer, kept, spread, {"share": share, "adding": True}, is_worth, last.slits_within(longer))
        cutting = _cut_anew(search, last, asked, map_charts, early)
        new = yield from part_of(cutting, k / len(HOPES), 1 / len(HOPES))
        if new is None or new is last:
            break
        if not new.searched:
            return new
    return last


def _parts_cut_anew(search: ShearSearch, last: Round, map_charts, early: EarlyEnd) -> Steps[Round]:
    """A round within the bound whose parts have cuts of their own, where these are shorter than what was cut of the
    whole before it came apart, and keep the bound, too."""
    large = (last.area >= LARGE_PART * last.area.sum()) & (last.mean > UNSHEARED)
    parts = [
        k
        for k in np.flatnonzero(large & last.has_room).tolist()
        if not (last.found_for(k) or search.is_thinned(last.charts[k]) or _turns(last.charts[k]))
        and (search.shear.further or not is_marked(search.surface, last.charts[k]))
    ]
    if len(last.charts) < 2 or not parts:
        return last
    kept = but_within(last.cuts.edges, [last.charts[k] for k in parts])
    asked = Asked(parts, kept, search.first_spread(), {}, lambda edges: edge_set(edges) != edge_set(last.cuts.edges))
    new = yield from _cut_anew(search, last, asked, map_charts, early)
    if new is None or new is last:
        return last
    of, count = last.chart_of(search, new), len(last.charts)
    missed = np.bincount(of, new.pressing > new.bound, count) > 0
    sprawls = np.bincount(of, new.extent > np.maximum(last.extent[of], COMPACT * np.sqrt(last.area.sum())), count) > 0
    # The outline of a part is there before and after.
    longer = np.bincount(of, new.outline_length, count) > SHORTER_PART * last.outline_length
    stay = missed | sprawls | longer | ~_as_flat(last, new, of)
    return last if stay.all() else last.merged(search, new, of, stay)


def _turns(chart: Chart) -> bool:
    """Whether a chart is of what was turned, and cut along rings: shorter cuts of such pieces would be petals."""
    return has_axis(chart.vertices, chart.triangles, chart.faces)


def _straightened(search: ShearSearch, last: Round, map_charts, early: EarlyEnd) -> Steps[Round]:
    """A round within the bound with cuts that turn less, where their charts keep it, too: among the sides of quads many
    ways are as short as each other, and most of them go in steps."""
    small = [k for k, chart in enumerate(last.charts) if len(chart.vertices) <= IN_STEPS and last.found_for(k)]
    chosen = search.with_images(last.charts, small)
    if not chosen:
        return last
    changes = {"share": np.ones(search.count), "straighter": True, "stays_whole": True}
    before, slits = edge_set(last.cuts.edges), last.slits_within(chosen)
    asked = Asked(
        chosen, last.kept(chosen), search.first_spread(), changes, lambda edges: edge_set(edges) != before, slits
    )
    new = yield from _cut_anew(search, last, asked, map_charts, early)
    if new is None or new is last:
        return last
    from ..seams.growth import EVEN

    of, count = last.chart_of(search, new), len(last.charts)
    # Another cut may come apart, along folds, or miss the bound; and of two alike rounding does not choose.
    good = (np.bincount(of, minlength=count) == 1) & (np.bincount(of, new.pressing > new.bound, count) == 0)
    good &= _as_flat(last, new, of)
    stay = ~(good & (np.bincount(of, new.outline_price, count) < (1 - EVEN) * last.outline_price))
    return last if stay.all() else last.merged(search, new, of, stay)


def _as_flat(last: Round, new: Round, of: np.ndarray) -> np.ndarray:
    """Charts (k,) bool of a round that, cut otherwise in a new one, whose charts came of them (m,), do not do without
    what keeps flat sides flat."""
    sheared = np.bincount(of, new.area * np.log(new.mean), len(last.charts))
    return (sheared <= AS_SHEARED * last.area * np.log(last.mean)) | (last.mean > NEARLY_FLAT)


def _result(
    last: Round, search: ShearSearch, warnings: tuple[str, ...], early: EarlyEnd, is_short: bool
) -> BoundedShear:
    """The charts and maps of a round, with warnings of how they were made and of those that miss the bound."""
    by_hand, why = ~np.isin(np.arange(len(last.charts)), last.searched), ENDED_EARLY if early.is_asked else MORE_SEAMS
    mean = last.mean ** np.where(last.mean > last.bound, search.lenience_of(last.charts), 1.0)
    missed = tuple(search.shear.missed(mean, last.area, by_hand, why))
    # Another call for the same search need not do in vain what this one did.
    search.memory.update(last.memory)
    prepared = DiskCharts(last.charts, last.cuts, warnings)
    return BoundedShear(prepared, last.maps, missed, early.is_asked, is_short)
