"""Cut charts in pieces that leave most of a texture empty: long bands, and bodies with limbs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..cutting.disk_charts import DiskCharts
from ..mesh.charts import Chart, part_of_chart, sound_disks
from ..mesh.geometry import face_areas
from ..mesh.topology import pair_keys
from ..progress import Steps
from ..seams.options import COMPACT
from .chart_indices import is_marked, outline
from .chart_map import ChartMap, measured_map
from .convex_maps import with_figures
from .shear_search import ShearSearch, joined


def in_pieces(
    search: ShearSearch,
    prepared: DiskCharts,
    maps: list[ChartMap],
    map_charts: Callable[[list[Chart]], Steps[list[ChartMap]]],
) -> Steps[tuple[DiskCharts, list[ChartMap]]]:
    """Charts and maps, those cut in pieces that leave most of a texture empty: long bands, as those of a gear or a
    cable, and bodies with limbs. Charts that were not cut at all, and those with marked seams, stay whole."""
    surface = search.surface
    chosen = surface.triangles if search.faces is None else surface.triangles[search.faces[surface.triangle_face]]
    whole = float(face_areas(surface.positions, surface.corner_vertex[chosen]).sum())
    cuts = prepared.found_cuts
    new_charts, new_maps, edges = list[Chart](), list[ChartMap](), [cuts.edges]
    for chart, chart_map in zip(prepared.charts, maps, strict=True):
        found, between = ([chart], [chart_map]), cuts.edges[:0]
        # Most are compact, and of thousands nothing else is asked.
        if np.hypot(*np.ptp(chart_map.uv, axis=0)) > COMPACT * np.sqrt(whole) > 0 and not len(chart.patches):
            was_cut = np.isin(outline(chart), pair_keys(*cuts.edges.T)).any()
            if was_cut and not is_marked(surface, chart):
                found, between = yield from _pieces(search, chart, chart_map, whole, map_charts)
        new_charts += found[0]
        new_maps += found[1]
        edges.append(between)
    return replace(prepared, charts=new_charts, cuts=joined(search, cuts, np.concatenate(edges))), new_maps


def _pieces(
    search: ShearSearch, chart: Chart, chart_map: ChartMap, whole: float, map_charts
) -> Steps[tuple[tuple[list[Chart], list[ChartMap]], np.ndarray]]:
    """A chart of a surface of area `whole` and its map cut in pieces, and the edges (k,2) in between; whole where it is
    neither long nor sprawls, or the pieces are no disks."""
    from ..seams.limbs import may_come_apart, pieces_of_chart

    axes = search.shear.preferences.axes
    up = None if axes is None else axes.up
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
    again = yield from map_charts(parts)
    return (parts, again if _shears_less(parts, again, maps) else maps), between


def _shears_less(charts: list[Chart], maps: list[ChartMap], before: list[ChartMap]) -> bool:
    """Whether all charts have maps that shear less in the mean than those before, and fold no more faces."""
    if any(one.failure is not None or one.folds > other.folds for one, other in zip(maps, before, strict=True)):
        return False
    area = np.array([face_areas(chart.vertices, chart.triangles).sum() for chart in charts])
    return bool(
        area @ np.array([one.angle_mean - other.angle_mean for one, other in zip(maps, before, strict=True)]) < 0
    )
