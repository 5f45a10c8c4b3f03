"""Keep convex polygons convex in the maps of a surface, where that costs no area, and none folded as they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..analysis.density import Target
from ..errors import MeshError, plural
from ..maps.distortion import Distortion
from ..maps.similarity import fit_similarity
from ..mesh.charts import Chart
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.surface import Surface
from ..mesh.topology import boundary_loops
from ..progress import Steps
from ..refinement.continuation_rules import QUALITIES
from .chart_indices import ChartPins, chart_target
from .chart_map import FOLDED, ChartMap, in_unit_box, measured_map, refined_again
from .options import MapOptions
from .polygons.polygon_corners import Forced
from .polygons.polygon_disk import cut_as_mapped

# The area error of a map may grow by this factor, or to so much more than its goal, for polygons that are convex.
AREA_KEPT = 1.1
# Mean shear may grow by this factor for that: a map refined from where they are open has hardly less. Where it grows by
# more, that is tried.
SHEAR_KEPT = 1.06
# Mean shear above 1, and area error, of what is no more than rounded.
ISOMETRIC = 1e-7
# How warnings of polygons that fold if they are cut otherwise than they are drawn end.
OTHERWISE = "in the map if cut along another diagonal"
# How often polygons that fold are mapped by their triangles, with those that fold then.
ROUNDS = 3
# Share of its polygon's area of a triangle that has one on the surface.
SOLID = 1e-12


def with_convex_polygons(
    surface: Surface,
    charts: list[Chart],
    maps: list[ChartMap],
    pins: Sequence[ChartPins | None],
    options: MapOptions,
    target: Target | None = None,
    drawn: Surface | None = None,
) -> Steps[list[ChartMap]]:
    """The maps with polygons that are convex on the surface convex in them, too, as far as may be: `keep_convex`.

    Corners are opened as far as areas can be spared. Charts without pins in which some stay folded, or that are sheared
    by it, are opened there whatever it costs, and refined from then on: quads that are convex stay so. A map that would
    lose its areas stays as it is.
    pins : of every chart; options and target : those of the maps; drawn : the surface with the triangles of who draws
    it
    """
    drawn = surface if drawn is None else drawn
    if not (np.diff(surface.face_start) > 3).any() or all(map(_is_isometry, maps)):
        return maps
    from .polygons.convexity import reflex_triangles

    targets = [chart_target(target, surface, c) for c in charts]
    task = _Opening(drawn, charts, pins, options, targets, {})
    folded = reflex_triangles(drawn, charts, [m.uv for m in maps])
    new = task.kept(maps, np.arange(len(maps)))
    # Exact areas spare little, those that a balance leaves off much, and on a circle vertices stay: a refinement makes
    # more of these.
    plain = options.boundary == "free" and options.balance == 0 and options.quality != "exact"
    enough = SHEAR_KEPT if plain else 0.0
    for k in np.flatnonzero(folded):
        if new[k].angle_mean > enough * maps[k].angle_mean or task.folded(k, new[k]):
            opened = yield from task.opened(k, maps[k], folded[k])
            if opened is not None:
                either = [new[k], *task.kept([opened], np.array([k]))]
                figures = [(task.folded(k, one), one.angle_mean) for one in either]
                new[k] = either[figures.index(min(figures))] if enough else either[1]
        new[k] = with_dents_told(drawn, charts[k], new[k])
    return new


@dataclass(frozen=True)
class _Opening:
    """Charts whose corners are opened: the surface with the triangles of who draws it; pins and targets of every
    chart, the options of its map, and what was forced open, see `keep_convex`."""

    drawn: Surface
    charts: list[Chart]
    pins: Sequence[ChartPins | None]
    options: MapOptions
    targets: Sequence[Target | None]
    forced: Forced

    def density(self, k: int) -> np.ndarray | None:
        """The density (m,) that chart k asks for."""
        target = self.targets[k]
        return None if target is None else target.density

    def folded(self, k: int, chart_map: ChartMap) -> int:
        """How many corners of chart k are folded in a map."""
        from .polygons.convexity import reflex_triangles

        return int(reflex_triangles(self.drawn, [self.charts[k]], [chart_map.uv])[0])

    def kept(self, maps: Sequence[ChartMap], which: np.ndarray) -> list[ChartMap]:
        """Maps of some charts (c,) with corners opened as far as areas can be spared."""
        from .polygons.convexity import keep_convex

        charts = [cut_as_mapped(self.charts[k], m.uv) for k, m in zip(which, maps, strict=True)]
        fixed = [_fixed(c, self.pins[k], self.options.boundary) for k, c in zip(which, charts, strict=True)]
        density, goal = [self.density(k) for k in which], QUALITIES[self.options.quality].area_error
        uvs, weights = [m.uv for m in maps], [m.area_weight for m in maps]
        spare = [AREA_KEPT * max(m.area_l1, goal) - m.area_l1 for m in maps]
        new = list(maps)
        found = keep_convex(self.drawn, charts, uvs, fixed, density, weights, spare, self.forced)
        for place, uv in found.items():
            chart, old = self.charts[which[place]], maps[place]
            figures = measured_map(chart, uv, density[place])
            if _keeps(figures, old, goal):
                uv = uv if fixed[place].any() else _as_before(uv, old.uv, chart.triangles)
                new[place] = with_figures(old, uv, figures)
        return new

    def opened(self, k: int, old: ChartMap, folded: int) -> Steps[ChartMap | None]:
        """The map of a chart in which so many corners are folded, refined again from where they are open whatever it
        costs; None where that has no more of them open."""
        from .polygons.convexity import keep_convex

        # Corners of squares and rectangles, and drafts, stay as they were chosen.
        boundary = self.options.boundary
        if self.pins[k] is not None or self.options.quality == "draft" or boundary not in ("free", "disk"):
            return None
        chart, density = self.charts[k], self.density(k)
        given = [cut_as_mapped(chart, old.uv)], [old.uv], [_fixed(chart, None, boundary)], [density], [old.area_weight]
        start = keep_convex(self.drawn, *given, None, self.forced).get(0)
        if start is None:
            return None
        try:
            uv = yield from refined_again(chart, start, self.options, self.targets[k])
        except MeshError:
            # The map that there is has no error.
            return None
        uv = _as_before(uv, old.uv, chart.triangles) if boundary == "free" else uv
        found = with_figures(old, uv, measured_map(chart, uv, density))
        kept = _keeps(found, old, QUALITIES[self.options.quality].area_error)
        return found if kept and self.folded(k, found) < folded else None


def with_dents_told(drawn: Surface, chart: Chart, chart_map: ChartMap) -> ChartMap:
    """The map with a warning of convex polygons that fold in it if they are cut otherwise than they are drawn."""
    from .polygons.convexity import dented_faces

    count = len(dented_faces(drawn, chart, chart_map.uv))
    others = tuple(text for text in chart_map.warnings if not text.endswith(OTHERWISE))
    told = (f"{plural(count, '1 face folds', '{} faces fold')} {OTHERWISE}",) if count else ()
    return replace(chart_map, warnings=(*others, *told))


def with_drawn_triangles(
    surface: Surface,
    charts: Sequence[Chart],
    maps: list[ChartMap],
    pins: Sequence[ChartPins | None],
    options: MapOptions,
    target: Target | None = None,
) -> Steps[list[ChartMap]]:
    """The maps, those without pins refined again in which polygons fold as they are drawn, if fewer do then.

    A polygon of many sides is mapped as a fan, and where no map makes it convex its fan alone is sound. So it is
    mapped by the triangles that it is drawn with, which no step folds, from where it is open as far as may be.
    surface and charts : with the triangles of who draws them
    """
    new = list(maps)
    for k, chart in enumerate(charts):
        if not maps[k].folds or pins[k] is not None:
            continue
        aim, found, alone = chart_target(target, surface, chart), maps[k].uv, np.zeros(len(chart.faces), bool)
        for _ in range(ROUNDS):
            dented = _dented(chart, found) & ~alone
            if not dented.any():
                break
            alone |= dented
            try:
                found = yield from _by_triangles(surface, chart, maps[k], alone, options, aim)
            except MeshError:
                # The map that there is has no error.
                break
            figures = measured_map(chart, found, None if aim is None else aim.density)
            if figures.folds < new[k].folds and _keeps(figures, maps[k], QUALITIES[options.quality].area_error):
                new[k] = with_dents_told(surface, chart, with_figures(maps[k], found, figures))
    return new


def _dented(chart: Chart, uv: np.ndarray) -> np.ndarray:
    """Triangles (m,) bool of polygons that have an area in a map (n,2), and so have their triangles on the surface,
    though some of these fold."""
    _, owner = np.unique(chart.faces, return_inverse=True)
    area, solid = signed_areas(uv, chart.triangles), face_areas(chart.vertices, chart.triangles)
    area *= np.sign(area.sum())
    flat = solid <= SOLID * np.bincount(owner, solid)[owner]
    folded = np.bincount(owner, area <= 0) > 0
    return (folded & (np.bincount(owner, area) > 0) & (np.bincount(owner, flat) == 0))[owner]


def _by_triangles(
    surface: Surface, chart: Chart, old: ChartMap, alone: np.ndarray, options: MapOptions, target: Target | None
) -> Steps[np.ndarray]:
    """The map (n,2) of a chart refined again with some of its triangles (m,) bool as polygons of their own."""
    from .polygons.convexity import keep_convex

    fixed, density = _fixed(chart, None, options.boundary), None if target is None else target.density
    given = [cut_as_mapped(chart, old.uv)], [old.uv], [fixed], [density], [old.area_weight], None
    start = keep_convex(surface, *given).get(0, old.uv)
    own = chart.faces.max(initial=0) + 1 + np.arange(len(alone))
    uv = yield from refined_again(replace(chart, faces=np.where(alone, own, chart.faces)), start, options, target)
    return _as_before(uv, old.uv, chart.triangles) if options.boundary == "free" else uv


def _keeps(figures: Distortion | ChartMap, old: ChartMap, goal: float) -> bool:
    """Whether a map with these figures folds no more than another, and has its areas, or those that are the goal."""
    return figures.folds <= old.folds and figures.area_l1 <= AREA_KEPT * max(old.area_l1, goal)


def _is_isometry(chart_map: ChartMap) -> bool:
    """Whether polygons are in the map as they are on the surface, so that those convex there are convex in it."""
    return chart_map.angle_mean - 1 <= ISOMETRIC and chart_map.area_l1 <= ISOMETRIC and not chart_map.folds


def with_figures(old: ChartMap, uv: np.ndarray, figures: Distortion) -> ChartMap:
    """A map with other UVs and their figures."""
    names = ("area_l1", "area_sd", "angle_mean", "folds")
    warnings = _folds_told(old.warnings, figures.folds)
    return replace(old, uv=uv, warnings=warnings, **{name: getattr(figures, name) for name in names})


def _folds_told(warnings: tuple[str, ...], folds: int) -> tuple[str, ...]:
    """Warnings of a map, of as many folds as it has."""
    others = tuple(text for text in warnings if not text.endswith(FOLDED))
    return (*others, f"{folds} {FOLDED}") if folds else others


def with_folds_counted(chart: Chart, chart_map: ChartMap) -> ChartMap:
    """The map with the folds of the triangles that the chart has now."""
    area = signed_areas(chart_map.uv, chart.triangles)
    # Pins may turn a chart over as a whole.
    folds = len(np.unique(chart.faces[area * np.sign(area.sum()) <= 0]))
    if folds == chart_map.folds:
        return chart_map
    return replace(chart_map, folds=folds, warnings=_folds_told(chart_map.warnings, folds))


def _fixed(chart: Chart, pins: ChartPins | None, boundary: str) -> np.ndarray:
    """Vertices (n,) bool of a chart that stay where the refinement left them: pins, and those on a disk or a square."""
    fixed = np.zeros(len(chart.vertices), bool)
    if pins is not None:
        fixed[pins.vertices] = True
    if boundary != "free":
        fixed[boundary_loops(chart.disk)[0]] = True
    return fixed


def _as_before(uv: np.ndarray, given: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A map (n,2) moved, turned and scaled to the place, direction and area of another one of the same triangles."""
    uv, unit = in_unit_box(uv)
    given = given / unit
    scale = np.sqrt(signed_areas(given, triangles).sum() / signed_areas(uv, triangles).sum())
    w = scale * (uv @ [1, 1j])
    w = fit_similarity(w, given @ [1, 1j], rigid=True)(w)
    return np.column_stack([w.real, w.imag]) * unit
