"""Unwrap a surface: polygon mesh -> charts -> maps of these (see `chart_map`) -> texture coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ..analysis.density import Target
from ..analysis.facing import Y_UP, SceneAxes
from ..analysis.seam_costs import SeamPreferences, seam_costs
from ..canonical.markers import MapMarkers, markers_of_chart
from ..cutting.cuts import Cuts, SeamFinder
from ..cutting.cuts import cut as cut_surface
from ..cutting.disk_charts import OUTLINED, DiskCharts, disk_charts
from ..cutting.hole_filling import MANY
from ..errors import MeshError, plural, without_room
from ..mesh.charts import Chart
from ..mesh.surface import Surface, turned_surface
from ..mesh.topology import first_places
from ..progress import Progress, Steps, part_of
from ..quads.diagonals import cut_along_shorter
from ..refinement.continuation_rules import PROMISED, QUALITIES
from .chart_indices import (
    ChartPins,
    CornerPins,
    chart_target,
    clear_of_pins,
    cut_as_given,
    in_order_of_places,
    located,
    pins_of_chart,
    refuse_lost_faces,
)
from .chart_map import WITHOUT_MAP, ChartMap, no_map, refined_again
from .convex_maps import with_convex_polygons, with_drawn_triangles, with_folds_counted
from .mirrored_charts import (
    MapCharts,
    Starts,
    as_given,
    cut_alike,
    equal_chart_map,
    map_completed,
    mirror_partners,
    mirrored_map,
    remembered,
    with_images,
    with_known_maps,
    with_mirrored_quads,
)
from .options import ShearBound, UnwrapOptions
from .pieces import in_pieces, is_worth_bounding
from .shear_bound import BoundedShear, bound_shear
from .shear_search import ShearSearch
from .small_charts import is_small, map_together

# Where the time of a surface goes, roughly: cutting it, and, of the rest, the first maps; at last those of pieces.
CUTTING = 0.15
MAPPING = 0.7
PIECES = 0.05

# Charts and their maps.
_Drawn = tuple[list[Chart], list[ChartMap]]


@dataclass(frozen=True)
class SurfaceMap:
    """All charts of a surface and their maps, in one texel density.

    seams (k,2): edges that were cut for the map; warnings: what was repaired for the map; axes: how the surface stands
    in the scene, where that was found out.
    """

    charts: list[Chart]
    maps: list[ChartMap]
    seams: np.ndarray
    warnings: tuple[str, ...] = ()
    axes: SceneAxes | None = None

    def corner_uv(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of the surface (k,) that were mapped, each once, and their coordinates (k,2), charts unpacked."""
        corners = np.concatenate([c.corners.ravel() for c in self.charts])
        uv = np.concatenate([m.uv[c.triangles.ravel()] for c, m in zip(self.charts, self.maps, strict=True)])
        corners, first = first_places(corners)
        return corners, uv[first]

    def report(self) -> list[dict]:
        """One dictionary per chart, for a JSON file."""
        return [m.report(c) for c, m in zip(self.charts, self.maps, strict=True)]


@dataclass(frozen=True)
class CutCharts:
    """A surface cut into charts that are to be mapped, for `unwrap`; maps (by number) are there already.

    surface : with its quads cut along their shorter diagonals
    joined : the charts with the quads of mirror images cut alike; pairs : see `mirrored_charts.mirror_partners`
    search : that found the seams for a bound of the shear, if there is one; starts : maps of the joined charts that
        are nearly what is looked for
    """

    surface: Surface
    prepared: DiskCharts
    pins: list[ChartPins | None]
    targets: list[Target | None]
    joined: list[Chart]
    pairs: dict[int, tuple[int, np.ndarray]]
    maps: dict[int, ChartMap]
    search: ShearSearch | None = None
    starts: Starts = None

    @property
    def alike(self) -> list[int]:
        """The numbers of charts that may be solved together with others."""
        return [k for k, c in enumerate(self.joined) if self.pins[k] is None and is_small(c) and k not in self.pairs]


def unwrap(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    options: UnwrapOptions | None = None,
    pins: CornerPins | None = None,
    target: Target | None = None,
    avoid: np.ndarray | None = None,
    cut: CutCharts | None = None,
    markers: MapMarkers | None = None,
) -> Steps[SurfaceMap]:
    """Map the polygons `faces` (f,) bool of a surface, all by default, so that areas are kept.

    Quads are cut along their shorter diagonals for that, whichever they came with; the charts have the given ones.

    Parameters
    ----------
    pins : corners that keep their places, with a free boundary
    target : density (m,) of the triangles of the surface, and a region; every triangle its own area by default
    avoid : (n,) in [0,1], vertices to keep free of cuts; cuts avoid pinned vertices, too
    cut : what `cut_charts` made of all this; then it counts
    markers : vertices that fix what a map leaves open: its turn, its corners

    Raises
    ------
    MeshError : see `disk_charts.cut_to_disks` and `chart_map.map_chart`; element indices are those of the surface
    """
    yield Progress("Charts", 0.0)
    options, begin = options or UnwrapOptions(), 0.0
    if cut is None:
        begin = CUTTING
        cutting = cut_charts(surface, faces, options=options, pins=pins, target=target, avoid=avoid)
        cut = yield from part_of(cutting, 0.0, begin)
    # A draft leaves shear that Standard takes away: it shows the seams that are predicted, and no others.
    search = None if options.quality == "draft" else cut.search
    task = _Task(cut.surface, options, pins, target, markers, cut_anew=search is not None)
    prepared, width = cut.prepared, (1 - begin) * (1 if cut.search is None else MAPPING)
    maps = yield from part_of(task.map_symmetric(cut), begin, width)
    crossing = remembered(task.crossing) if pins is None and task.options.boundary == "free" else None
    said, may_part = prepared.warnings, crossing is not None and target is None
    found = BoundedShear(prepared, maps, (), ended_early=search is None)
    if search is not None:
        further = bound_shear(search, prepared, maps, task.map_charts, crossing, task.sparing, may_part=may_part)
        found = yield from part_of(further, begin + width, 1 - begin - width - PIECES)
        said = (*said, *cut_for_a_map(maps, found.maps))
    if cut.search is not None and may_part:
        found = yield from part_of(_come_in_pieces(task, cut.search, found, crossing), 1 - PIECES, PIECES)
    prepared, maps, missed = found.prepared, found.maps, found.warnings
    refuse_lost_faces(cut.prepared.charts, prepared.charts)
    charts, cuts = prepared.charts, np.zeros((0, 2), np.int64) if prepared.cuts is None else prepared.cuts.edges
    given, (charts, maps) = charts, (yield from task.finished(charts, maps, surface))
    if task.options.boundary != "free" and task.options.kind == "authalic":
        maps = yield from _with_room(task, given, maps, surface)
    return SurfaceMap(charts, maps, cuts, (*said, *missed), None if cut.search is None else cut.search.axes)


def _come_in_pieces(task: _Task, search: ShearSearch, last: BoundedShear, crossing) -> Steps[BoundedShear]:
    """Charts and those of their pieces that fill more of a texture, bounded again unless the end was asked for."""
    pieces = in_pieces(search, last.prepared, last.maps, task.map_charts)
    apart, parts = yield from part_of(pieces, 0.0, 0.5)
    several = len(parts) > len(last.maps)
    if last.ended_early or not (is_worth_bounding(search, apart, parts) if several else not last.is_short):
        return replace(last, prepared=apart, maps=parts)
    # Limbs can shear more than the mean of them and all else.
    further = bound_shear(search, apart, parts, task.map_charts, crossing, task.sparing, of_pieces=several)
    return (yield from part_of(further, 0.5, 0.5))


def cut_for_a_map(first: list[ChartMap], maps: list[ChartMap]) -> list[str]:
    """What is to be said of charts that had no map at first; their error where that is so at last, too."""
    failure = next((one.failure for one in maps if one.failure is not None), None)
    if failure is not None:
        raise failure
    count = sum(one.failure is not None for one in first)
    who = plural(count, "An island along its seams has", "{} islands along their seams have")
    return [f"{who} no map in double precision; cut further"] if count else []


def _with_room(task: _Task, charts: list[Chart], maps: list[ChartMap], given: Surface) -> Steps[list[ChartMap]]:
    """The maps, with a free boundary where faces stay folded in the shape asked for, and that folds fewer."""
    folded = [k for k, chart_map in enumerate(maps) if chart_map.folds]
    if not folded:
        return maps
    free, again = replace(task, options=replace(task.options, boundary="free")), [charts[k] for k in folded]
    try:
        found = yield from free.map_charts(again)
        _, found = yield from free.finished(again, found, given)
    except MeshError:
        # The maps that there are have no error.
        return maps
    new = list(maps)
    for k, chart_map in zip(folded, found, strict=True):
        if chart_map.folds < maps[k].folds:
            stay = plural(maps[k].folds, "1 face stays", "{} faces stay")
            text = without_room(task.options.boundary, f"{stay} folded")
            new[k] = replace(chart_map, warnings=(*chart_map.warnings, text))
    return new


def cut_charts(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    options: UnwrapOptions,
    pins: CornerPins | None = None,
    target: Target | None = None,
    avoid: np.ndarray | None = None,
) -> Steps[CutCharts]:
    """The charts of a surface, none of them mapped; see `unwrap`.

    Raises
    ------
    MeshError : see `disk_charts.cut_to_disks`
    """
    surface = cut_along_shorter(surface)
    avoid = clear_of_pins(surface, pins, avoid)
    bound = options.shear_bound()
    given: dict[str, Any] = {"fill_holes": options.fill_holes, "sieve": MANY, "avoid": avoid}
    thinning = None if options.quality == "draft" else seams_of_small(options)
    search = None if bound is None else ShearSearch(surface, faces, bound, target, given, rehearsal(options), thinning)
    finder = _faces_of(surface, faces, options) if search is None else search.search(search.first_spread())
    seams = OUTLINED if options.seams == "auto" and options.boundary != "free" else options.seams
    prepared = yield from disk_charts(surface, faces, seams=seams, search=finder, **given)
    prepared = yield from cut_alike(surface, faces, prepared, given)
    return replace(_to_be_mapped(surface, prepared, pins, target), search=search)


def _faces_of(surface: Surface, faces: np.ndarray | None, options: UnwrapOptions) -> SeamFinder | None:
    """What tells the holes in faces, where the seams there are may be those that a search has left; else None."""
    if options.seams != "existing" or options.boundary != "free":
        return None
    from ..seams.search import SeamSearch

    return SeamSearch(np.zeros(0), surface, cache(lambda: seam_costs(surface, options.preferences, faces)))


def rehearsal(options: UnwrapOptions) -> Callable[[Surface, list[Chart], Target | None], Steps[list[ChartMap]]]:
    """Maps of charts of a small surface with these options, whose areas are about right."""
    # What coarse triangles shear is above that of fine ones for exact areas, and the more the less alike they are.
    quick = replace(options, quality="relaxed")

    def maps(surface: Surface, charts: list[Chart], target: Target | None) -> Steps[list[ChartMap]]:
        return (yield from _Task(surface, quick, None, target).map_charts(charts))

    return maps


def seams_of_small(options: UnwrapOptions) -> Callable[[Surface, np.ndarray], Steps[np.ndarray]]:
    """Seams of a small surface with these options, as its own maps keep the bound with them."""

    def seams(surface: Surface, avoid: np.ndarray) -> Steps[np.ndarray]:
        return (yield from unwrap(surface, options=options, avoid=avoid if avoid.any() else None)).seams

    return seams


def predicted_cuts(
    surface: Surface, faces: np.ndarray, bound: float, axes: SceneAxes | None = None, **options: Any
) -> Cuts:
    """What `unwrap` cuts for a bound of the shear before its first map; with 0 for none, what it cuts without one.

    faces (f,) bool : polygons of the surface; axes : how it stands in the scene; options and errors: see `cuts.cut`
    """
    if axes is not None:
        surface = turned_surface(surface, axes.frame)
    if bound:
        shear = ShearBound(bound, preferences=SeamPreferences(axes=None if axes is None else Y_UP))
        search = ShearSearch(surface, faces, shear, None, {}, rehearsal(UnwrapOptions()))
        options |= {"search": search.search(search.first_spread())}
    cuts = cut_surface(surface, faces, **options)
    return cuts if options.get("fill") else with_images(surface, faces, cuts)


def _to_be_mapped(surface: Surface, prepared: DiskCharts, pins: CornerPins | None, target: Target | None) -> CutCharts:
    charts = [in_order_of_places(chart)[0] for chart in prepared.charts]
    prepared = replace(prepared, charts=charts)
    chart_pins = [pins_of_chart(pins, chart) for chart in charts]
    free = all(p is None for p in chart_pins)
    joined = with_mirrored_quads(surface, charts) if free else charts
    targets = [chart_target(target, surface, chart) for chart in joined]
    pairs = mirror_partners(joined, targets) if free else {}
    return CutCharts(
        surface=surface, prepared=prepared, pins=chart_pins, targets=targets, joined=joined, pairs=pairs, maps={}
    )


def map_small_charts(several: Sequence[CutCharts], options: UnwrapOptions) -> Steps[list[CutCharts]]:
    """Surfaces with their small charts mapped together where boundaries are free, but those that have to go alone."""
    together = options.boundary == "free" and options.kind == "authalic"
    alike = [cut.alike if together else [] for cut in several]
    where = [(i, k) for i, numbers in enumerate(alike) for k in numbers]
    charts, targets = [several[i].joined[k] for i, k in where], [several[i].targets[k] for i, k in where]
    found = yield from map_together(charts, targets, options)
    maps: list[dict[int, ChartMap]] = [{} for _ in several]
    for (i, k), chart_map in zip(where, found, strict=True):
        if chart_map is not None:
            maps[i][k] = chart_map
    return [replace(cut, maps=mine) for cut, mine in zip(several, maps, strict=True)]


@dataclass(frozen=True)
class _Task:
    """What all charts of a surface have in common; cut_anew : those without a map will be cut further."""

    surface: Surface
    options: UnwrapOptions
    pins: CornerPins | None
    target: Target | None
    markers: MapMarkers | None = None
    cut_anew: bool = False

    def map_one(self, chart: Chart, start: ChartMap | None = None) -> Steps[ChartMap]:
        """The map of one chart, from a start on where there is one; errors have the element indices of the surface."""
        pins = pins_of_chart(self.pins, chart)
        target = chart_target(self.target, self.surface, chart)
        marked = markers_of_chart(self.markers, chart)
        try:
            given: dict[str, Any] = {"options": self.options, "target": target, "pins": pins, "markers": marked}
            return (yield from map_completed(chart, start=start, **given))
        except MeshError as error:
            failure = located(error, chart)
            if self.cut_anew and pins is None and isinstance(error, WITHOUT_MAP):
                return no_map(chart, failure)
            raise failure from error

    def map_charts(self, charts: list[Chart], starts: Starts = None) -> Steps[list[ChartMap]]:
        """Maps of charts by themselves, large ones from starts on where these are given."""
        if not charts:
            return []
        cut = _to_be_mapped(self.surface, _only(charts), self.pins, self.target)
        orders = [in_order_of_places(chart)[1] for chart in charts]
        if starts is not None:
            begun = zip(starts, orders, strict=True)
            cut = replace(cut, starts=[None if s is None else replace(s, uv=s.uv[order]) for s, order in begun])
        found = yield from self.map_symmetric(cut)
        return [replace(one, uv=one.uv[np.argsort(order)]) for one, order in zip(found, orders, strict=True)]

    def finished(self, charts: list[Chart], maps: list[ChartMap], given: Surface) -> Steps[_Drawn]:
        """Charts with the triangles of the surface as it was given; maps with convex polygons, their folds counted."""
        if self.options.kind == "authalic":
            pins = [pins_of_chart(self.pins, chart) for chart in charts]
            maps = yield from with_convex_polygons(self.surface, charts, maps, pins, self.options, self.target, given)
        recut = np.zeros(len(given.face_start) - 1, bool)
        recut[given.triangle_face[(self.surface.triangles != given.triangles).any(axis=1)]] = True
        drawn = [cut_as_given(c, self.surface, given) if recut[c.faces].any() else c for c in charts]
        maps = [with_folds_counted(chart, chart_map) for chart, chart_map in zip(drawn, maps, strict=True)]
        if self.options.kind == "authalic":
            maps = yield from with_drawn_triangles(given, drawn, maps, pins, self.options, self.target)
        return drawn, maps

    def crossing(self, chart: Chart, chart_map: ChartMap) -> Steps[np.ndarray]:
        """A map (n,2) from another one on that may come to lie on itself."""
        target = chart_target(self.target, self.surface, chart)
        return (yield from refined_again(chart, chart_map.uv, self.options, target, crossing=True))

    @property
    def sparing(self) -> MapCharts | None:
        """Maps charts with areas that are as exact as Standard promises and no more; None for other qualities."""
        if self.options.quality != "standard" or self.options.balance > 0:
            return None
        return with_known_maps(replace(self, options=replace(self.options, quality="promised")).map_charts)

    def map_symmetric(self, cut: CutCharts) -> Steps[list[ChartMap]]:
        """Maps of all charts, symmetric ones also where their mirror images are cut along other diagonals."""
        charts = cut.prepared.charts
        maps = yield from self.map_all(cut)
        changed = [k for k, (a, b) in enumerate(zip(charts, cut.joined, strict=True)) if (a.faces != b.faces).any()]
        goal = QUALITIES[self.options.quality].area_error if self.options.balance == 0 else np.inf
        for k in changed:
            target = chart_target(self.target, self.surface, charts[k])
            density, missing = None if target is None else target.density, maps[k].failure is not None
            found = None if missing else as_given(charts[k], maps[k], density, goal)
            if found is None:
                targets = [chart_target(self.target, self.surface, chart) for chart in charts]
                pairs = mirror_partners(charts, targets)
                as_it_was = replace(cut, joined=charts, targets=targets, pairs=pairs, maps={})
                return (yield from self.map_all(as_it_was))
            alone = k not in cut.pairs and all(k != partner for partner, _ in cut.pairs.values())
            if alone and self.options.quality == "standard" and found.area_l1 > max(goal, PROMISED):
                found = yield from self.map_closer(charts[k], cut.joined[k], cut.targets[k], maps[k], found)
            maps[k] = found
        return maps

    def map_closer(
        self, chart: Chart, joined: Chart, target: Target | None, chart_map: ChartMap, found: ChartMap
    ) -> Steps[ChartMap]:
        """What was found for a chart from the map of it with joined quads, whose halves are farther off than these are;
        from one with quads less far off where that is better."""
        options = replace(self.options, quality="closer")
        uv = yield from refined_again(joined, chart_map.uv, options, target)
        own = chart_target(self.target, self.surface, chart)
        density = None if own is None else own.density
        closer = as_given(chart, replace(chart_map, uv=uv), density, found.area_l1)
        return found if closer is None or closer.area_l1 >= found.area_l1 else closer

    def map_all(self, cut: CutCharts) -> Steps[list[ChartMap]]:
        """Maps of all charts, small ones without pins together, one for two that are each other's mirror image."""
        # Markers tell charts apart that are alike.
        charts, pairs = cut.joined, cut.pairs if self.markers is None else {}
        total = sum(len(c.triangles) for c in charts)
        together = self.options.boundary == "free" and self.options.kind == "authalic" and self.markers is None
        done = sum(len(charts[k].triangles) for k in cut.alike) / total if together else 0.0
        if not cut.maps and self.markers is None:
            (cut,) = yield from part_of(map_small_charts([cut], self.options), 0.0, done)
        # Small ones, too, go alone where they are few; of those that do, equal but for a motion, all have one map.
        done = begun = done if cut.maps else 0.0
        left = total - sum(len(charts[k].triangles) for k in cut.maps)
        maps, alone = list[ChartMap](), list[tuple[Chart, Target | None, ChartMap]]()
        for k, chart in enumerate(charts):
            if k in pairs:
                maps.append(mirrored_map(maps[pairs[k][0]], pairs[k][1]))
                continue
            chart_map = cut.maps.get(k)
            moves = cut.pins[k] is None and self.markers is None
            if chart_map is None and moves:
                chart_map = equal_chart_map(chart, cut.targets[k], alone)
            if chart_map is None:
                share = (1 - begun) * len(chart.triangles) / left
                start = None if cut.starts is None or is_small(chart) else cut.starts[k]
                chart_map = yield from part_of(self.map_one(chart, start), done, share)
                done += share
                alone += [(chart, cut.targets[k], chart_map)] if moves else []
            maps.append(chart_map)
        return maps


def _only(charts: list[Chart]) -> DiskCharts:
    return DiskCharts(charts, None, ())
