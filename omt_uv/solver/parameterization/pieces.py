"""Take charts apart: around flat sides, where they lie in their own way, into what shears too much, and in pieces that
leave most of a texture empty, as long bands and bodies with limbs do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..cutting.cuts import Cuts
from ..cutting.disk_charts import DiskCharts
from ..maps.development import unrolled
from ..mesh.charts import Chart, part_of_chart, sound_disks
from ..mesh.geometry import face_areas
from ..mesh.topology import pair_keys
from ..progress import Steps
from ..seams.options import COMPACT
from .chart_indices import identity, is_marked, outline
from .chart_map import ChartMap, local_shear, measured_map
from .convex_maps import with_figures
from .shear_search import MOST_STEEP, NEARLY, STEEP, Round, ShearSearch, joined, pressing_shear

# What misses the bound by less stays in one piece at first: it has so many times the square of log(shear).
CROWDED = 1.35
# After a second search, what lies on itself comes apart where that leaves this share of what is missing at most.
ROOM = 0.5
# Nothing comes apart for less than this share of the bound.
HARDLY = 0.01
# So many times what is steep beyond that share is slit, and this share of a chart more every time that was no help.
SLIT = 1.5
MORE_SLIT = 0.001
# What misses the bound by little after a second search is slit where it shears more than this.
SHEARED = 2.0
# What is steep alone is slit so many times before it may come apart.
SLIT_AT_FIRST = 2
# Charts with more vertices are not cut shorter before they come in pieces, which takes as long as all else; of others
# seams become shorter by it, since what was cut of a whole is not taken back in its pieces.
LARGE = 10_000


def come_apart(
    search: ShearSearch,
    last: Round,
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
        stays = whole or mean <= last.bound or last.is_cut_further(rounds)
        edges = np.zeros((0, 2), np.int64) if stays else flat_sides(last.charts[k])
        if len(edges):
            flat.append(k)
        elif crossing is not None and not whole and _may_cross(last, k, late, rounds):
            # From a sheared map on it is a long way to where what is flat lies on itself.
            uv = unrolled(last.charts[k].vertices, last.charts[k].triangles)
            uv = (yield from crossing(last.charts[k], last.maps[k])) if uv is None else uv
            edges = _uncrossed(search, last, k, uv, late)
            crossed |= len(edges) > 0
        if not len(edges) and mean <= (1 + NEARLY * late) * last.bound:
            # No other cut is needed, but one into what shears that much.
            edges = _slit(search, last, k, rounds)
        found |= {k: edges} if len(edges) else {}
    return found, flat, crossed


def _may_cross(last: Round, k: int, late: bool, rounds: int) -> bool:
    """Whether chart k misses the bound by so much that it may lie in its own way, or was slit in vain."""
    missed = last.mean[k] > (1 + HARDLY) * last.bound
    much = np.log(last.mean[k]) >= np.sqrt(CROWDED) * np.log(last.bound)
    return rounds > SLIT_AT_FIRST or bool(missed and (late or much))


def _uncrossed(search: ShearSearch, last: Round, k: int, uv: np.ndarray, late: bool) -> np.ndarray:
    """Edges (e,2) that part chart k between what lies on itself in a map uv (n,2) that may, where that is what it
    misses the bound for."""
    from ..seams.parting import parted

    chart, mean = last.charts[k], last.mean[k]
    shear, area = local_shear(chart, replace(last.maps[k], uv=uv), search.target is None)
    both = float(area @ shear / area.sum()), float(area[shear > STEEP].sum() / area.sum())
    mild = mean <= last.bound
    missed, without = (last.pressing[k], pressing_shear(*both, last.bound)) if mild else (mean, both[0])
    if without > last.bound + late * ROOM * (missed - last.bound):
        return np.zeros((0, 2), np.int64)
    return parted(chart, uv, search.costs().vertex_cost[chart.vertex_ids], search.images)


def _slit(search: ShearSearch, last: Round, k: int, rounds: int) -> np.ndarray:
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


def in_pieces(
    search: ShearSearch,
    prepared: DiskCharts,
    maps: list[ChartMap],
    map_charts: Callable[[list[Chart]], Steps[list[ChartMap]]],
) -> Steps[tuple[DiskCharts, list[ChartMap]]]:
    """Charts and maps, those cut in pieces that leave most of a texture empty: long bands, as those of a gear or a
    cable, and bodies with limbs. Charts that were not cut at all, and those with marked seams, stay whole."""
    whole = _whole_area(search)
    cuts = prepared.found_cuts
    new_charts, new_maps, edges = list[Chart](), list[ChartMap](), [cuts.edges]
    for chart, chart_map in zip(prepared.charts, maps, strict=True):
        found, between = ([chart], [chart_map]), cuts.edges[:0]
        if _is_searched(search, chart, chart_map, cuts, whole):
            found, between = yield from _pieces(search, chart, chart_map, whole, map_charts)
        new_charts += found[0]
        new_maps += found[1]
        edges.append(between)
    return replace(prepared, charts=new_charts, cuts=joined(search, cuts, np.concatenate(edges))), new_maps


def may_come_in_pieces(search: ShearSearch, last: Round) -> bool:
    """Whether `in_pieces` looks for pieces of any large chart of a round."""
    from ..seams.limbs import may_come_apart

    whole, up = _whole_area(search), _up(search)
    return any(
        len(chart.vertices) > LARGE
        and _is_searched(search, chart, chart_map, last.cuts, whole)
        and may_come_apart(chart, chart_map.uv, up, whole)
        for chart, chart_map in zip(last.charts, last.maps, strict=True)
    )


def _is_searched(search: ShearSearch, chart: Chart, chart_map: ChartMap, cuts: Cuts, whole: float) -> bool:
    """Whether a chart of surfaces of area `whole` is large in its map, and cut by no hand."""
    # Most are compact, and of thousands nothing else is asked.
    if not np.hypot(*np.ptp(chart_map.uv, axis=0)) > COMPACT * np.sqrt(whole) > 0:
        return False
    was_cut = np.isin(outline(chart), pair_keys(*cuts.edges.T)).any()
    return bool(was_cut) and not is_marked(search.surface, chart)


def _whole_area(search: ShearSearch) -> float:
    """The area of all that goes into a texture with what is searched."""
    surface = search.surface
    chosen = surface.triangles if search.faces is None else surface.triangles[search.faces[surface.triangle_face]]
    return float(face_areas(surface.positions, surface.corner_vertex[chosen]).sum()) + search.shear.beside


def _up(search: ShearSearch) -> tuple[float, float, float] | None:
    """Which way a surface stands, if that is known."""
    axes = search.shear.preferences.axes
    return None if axes is None else axes.up


def is_worth_bounding(search: ShearSearch, prepared: DiskCharts, maps: list[ChartMap]) -> bool:
    """Whether maps of pieces are to be bounded again: where any misses the bound by more than a little, or none does,
    and shorter cuts may do. For a head that misses it by a hundredth horns would come off."""
    pressing = Round.of(search, prepared.charts, maps, prepared.found_cuts, search.memory).pressing
    most = float(pressing.max(initial=0.0)) / search.shear.bound
    return most <= 1 or most > 1 + NEARLY


def _pieces(
    search: ShearSearch, chart: Chart, chart_map: ChartMap, whole: float, map_charts
) -> Steps[tuple[tuple[list[Chart], list[ChartMap]], np.ndarray]]:
    """A chart of surfaces of area `whole` and its map cut in pieces, and the edges (k,2) in between; whole where it is
    neither long nor sprawls, or the pieces are no disks."""
    from ..seams.limbs import may_come_apart, pieces_of_chart

    up = _up(search)
    if not may_come_apart(chart, chart_map.uv, up, whole):
        return ([chart], [chart_map]), np.zeros((0, 2), np.int64)
    cost = search.costs().vertex_cost[chart.vertex_ids]
    piece, between = pieces_of_chart(chart, chart_map.uv, cost, up, whole, search.images)
    parts, maps = list[Chart](), list[ChartMap]()
    for k in range(int(piece.max()) + 1 if len(between) else 0):
        part, used = part_of_chart(chart, piece == k)
        parts.append(part)
        maps.append(with_figures(chart_map, chart_map.uv[used], measured_map(part, chart_map.uv[used], None)))
    if not parts or not sound_disks(parts).all():
        return ([chart], [chart_map]), between[:0]
    # What hangs on nothing any more can do with less shear.
    again = yield from map_charts(parts, maps)
    return (parts, again if _shears_less(parts, again, maps) else maps), between


def _shears_less(charts: list[Chart], maps: list[ChartMap], before: list[ChartMap]) -> bool:
    """Whether all charts have maps that shear less in the mean than those before, and fold no more faces."""
    if any(one.failure is not None or one.folds > other.folds for one, other in zip(maps, before, strict=True)):
        return False
    area = np.array([face_areas(chart.vertices, chart.triangles).sum() for chart in charts])
    return bool(
        area @ np.array([one.angle_mean - other.angle_mean for one, other in zip(maps, before, strict=True)]) < 0
    )
