"""Refine UV islands of several surfaces where they lie; the one path of the operator and of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..settings import RefineSettings
from ..solver.editing.refine_island import refine_island
from ..solver.editing.refine_together import GivenIsland, refine_together
from ..solver.editing.uv_islands import Island, uv_islands
from ..solver.errors import EmptyMeshError, FoldedUVError, MeshError, PinError
from ..solver.maps.distortion import distortion
from ..solver.maps.similarity import fit_similarity
from ..solver.mesh.charts import Chart
from ..solver.mesh.geometry import face_areas, signed_areas
from ..solver.mesh.polygon_areas import polygon_areas
from ..solver.mesh.surface import Surface
from ..solver.mesh.topology import boundary_edges
from ..solver.parameterization.chart_indices import ChartPins, CornerPins, chart_target, located, pins_of_chart
from ..solver.parameterization.chart_map import ChartMap
from ..solver.parameterization.small_charts import batches, is_small
from ..solver.parameterization.unwrap import SurfaceMap
from ..solver.progress import Steps, part_of
from ..solver.refinement.refine import Refinement
from ..solver.subdivision.modifier import SubdivisionModifier
from .layout import PACKING_FROM, PlacedIsland, Refusal, corner_uvs, grown_together, pack_islands
from .subdivision import refined_on_subdivision, subdivided_target

# Of `Distortion`, what a report says of an island before and after.
FIGURES = ("area_l1", "area_sd", "angle_mean", "folds")

# Share of the progress of islands that are refined side by side.
TOGETHER = 0.2


@dataclass(frozen=True)
class RefinedLayout:
    """Corners (k,) to write and their UVs (k,2), and the report of every island, of each surface; warnings.

    `warnings` are pairs of surface index and text; -1 stands for all surfaces.
    """

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    reports: list[list[dict]]
    warnings: list[tuple[int, str]]


@dataclass(frozen=True)
class _RefinedIsland:
    """An island of surface `owner` and its refinement.

    pins : those it has, which keep it from being packed; fixed_scale : whether they also fix how large it is
    density : (m,) of the area that its triangles ask for, if that is not their own
    """

    owner: int
    island: Island
    pins: ChartPins | None
    fixed_scale: bool
    refinement: Refinement
    density: np.ndarray | None = None

    @property
    def areas(self) -> tuple[float, float]:
        """Area of the surface and of the UVs."""
        chart = self.island.chart
        covered = abs(float(signed_areas(self.refinement.uv, chart.triangles).sum()))
        area = polygon_areas(chart.vertices, chart.triangles, chart.faces)
        return float(area.sum() if self.density is None else area @ self.density), covered


def refine_islands(
    surfaces: Sequence[tuple[Surface, np.ndarray | None, CornerPins | None]],
    settings: RefineSettings,
    subdivisions: Sequence[SubdivisionModifier | None] | None = None,
) -> Steps[RefinedLayout]:
    """Improve the UV islands that contain the given polygons (f,) bool of surfaces with UVs and pins.

    Every island keeps its centroid, direction and mirroring. All get one texel density, at which together they have
    the UV area they had; islands with two or more pins, or with their outline kept, have their own. Nothing is
    packed unless the settings say so, and then only islands without pins.

    subdivisions : of each surface, the modifier on whose surface the areas shall be right; none by default

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    MarginError : the margins leave no room for the islands
    """
    found, warnings = found_islands(surfaces)
    modifiers = subdivisions or [None] * len(surfaces)
    targets = [
        None if modifier is None else subdivided_target(surface, modifier)
        for (surface, _, _), modifier in zip(surfaces, modifiers, strict=True)
    ]
    densities = []
    for owner, island, _ in found:
        target = chart_target(targets[owner], surfaces[owner][0], island.chart)
        densities.append(None if target is None else target.density)
    working = PACKING_FROM if settings.pack else 1.0
    refined = yield from part_of(_improved(found, densities, settings), 0.0, working)
    for r in refined:
        warnings += [(r.owner, text) for text in (*r.refinement.warnings, *_unfinished(r.refinement))]
    refined, more = yield from _on_subdivisions(surfaces, refined, modifiers, settings)
    warnings += more
    uvs = _at_one_density(refined)
    if settings.pack:
        uvs = yield from part_of(_packed(refined, uvs, settings), PACKING_FROM, 1 - PACKING_FROM)
    placed = [
        PlacedIsland(owner=r.owner, chart=r.island.chart, uv=uv, before=r.island.uv)
        for r, uv in zip(refined, uvs, strict=True)
    ]
    if not settings.pack and (warning := grown_together(placed)):
        warnings.append((-1, warning))
    corners, uv = _free_corners(surfaces, placed)
    reports: list[list[dict]] = [[] for _ in surfaces]
    for r, its_uv in zip(refined, uvs, strict=True):
        reports[r.owner].append(_report(r, its_uv))
    return RefinedLayout(corners=corners, uv=uv, reports=reports, warnings=warnings)


def _free_corners(surfaces, placed: Sequence[PlacedIsland]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Corners of each surface that are not pinned (the others are where they shall be), and their UVs."""
    corners, uv = corner_uvs(len(surfaces), placed)
    free = [~pins.pinned[k] for (_, _, pins), k in zip(surfaces, corners, strict=True)]
    return [k[f] for k, f in zip(corners, free, strict=True)], [x[f] for x, f in zip(uv, free, strict=True)]


def _unfinished(refinement: Refinement) -> tuple[str, ...]:
    """A warning where the refinement used up its steps."""
    return ("The refinement of an island stopped before it was done",) if refinement.status == "steps" else ()


def found_islands(surfaces) -> tuple[list[tuple[int, Island, ChartPins | None]], list[tuple[int, str]]]:
    """Islands with the index of their surface and their pins, and warnings."""
    found, warnings = [], []
    for index, (surface, faces, pins) in enumerate(surfaces):
        try:
            if pins is None:
                raise EmptyMeshError("There are no UVs to refine", remedy="Unwrap the mesh first")
            islands = uv_islands(surface, pins.uv, faces)
            warnings += [(index, text) for text in islands.warnings]
            for island in islands.islands:
                found.append((index, island, pins_of_chart(pins, island.chart)))
        except MeshError as error:
            raise Refusal(index, error) from error
    return found, warnings


def _improved(
    found: Sequence[tuple[int, Island, ChartPins | None]],
    densities: Sequence[np.ndarray | None],
    settings: RefineSettings,
) -> Steps[list[_RefinedIsland]]:
    """All islands, those of few triangles side by side, if they are many, and then the others; densities: of each, see
    `_RefinedIsland`."""
    together = yield from part_of(_improve_together(found, densities, settings), 0.0, TOGETHER)
    total = sum(len(island.chart.triangles) for _, island, _ in found)
    refined, done = [], 0
    for (owner, island, pins), density, ready in zip(found, densities, together, strict=True):
        begin, share = done / total, len(island.chart.triangles) / total
        done += len(island.chart.triangles)
        if ready is not None:
            refined.append(_RefinedIsland(owner, island, pins, False, ready, density))
            continue
        steps = _improve(island, pins, settings, density)
        try:
            fixed, refinement = yield from part_of(steps, TOGETHER + (1 - TOGETHER) * begin, (1 - TOGETHER) * share)
        except MeshError as error:
            raise Refusal(owner, located(_shown(error, island.chart), island.chart)) from error
        refined.append(_RefinedIsland(owner, island, pins, fixed, refinement, density))
    return refined


def _improve_together(
    found: Sequence[tuple[int, Island, ChartPins | None]],
    densities: Sequence[np.ndarray | None],
    settings: RefineSettings,
) -> Steps[list[Refinement | None]]:
    """Refinements of small islands without pins if they are many; None for each that has to go alone."""
    refined: list[Refinement | None] = [None] * len(found)
    if settings.keep_boundary:
        return refined
    small = [k for k, (_, island, pins) in enumerate(found) if pins is None and is_small(island.chart)]
    several = batches([len(found[k][1].chart.triangles) for k in small])
    for number, batch in enumerate(several):
        chosen = [small[k] for k in batch]
        charts = [found[k][1].chart for k in chosen]
        given = [
            GivenIsland(chart.vertices, chart.triangles, found[k][1].uv, chart.faces, densities[k])
            for k, chart in zip(chosen, charts, strict=True)
        ]
        steps = refine_together(given, balance=settings.balance, quality=settings.quality)
        maps = yield from part_of(steps, number / len(several), 1 / len(several))
        for k, refinement in zip(chosen, maps, strict=True):
            refined[k] = refinement
    return refined


def _improve(
    island: Island, pins: ChartPins | None, settings: RefineSettings, density: np.ndarray | None
) -> Steps[tuple[bool, Refinement]]:
    """Whether the scale of the island is fixed, and its refinement; density (m,): see `_RefinedIsland`."""
    chart = island.chart
    vertices = np.zeros(0, np.int64) if pins is None else pins.vertices
    places = np.zeros((0, 2)) if pins is None else pins.places
    if settings.keep_boundary:
        outline = np.setdiff1d(boundary_edges(chart.triangles), vertices)
        vertices, places = np.concatenate([vertices, outline]), np.concatenate([places, island.uv[outline]])
    try:
        refinement = yield from refine_island(
            chart.vertices,
            chart.triangles,
            island.uv,
            balance=settings.balance,
            quality=settings.quality,
            pins=(vertices, places) if len(vertices) else None,
            polygons=chart.faces,
            target=density,
        )
    except PinError as error:
        if not settings.keep_boundary:
            raise
        raise PinError(
            "The outline of an island cannot be kept without a fold",
            remedy="Let the outline move, or unwrap these faces anew first",
            kind=error.kind,
            elements=error.elements,
        ) from error
    return len(vertices) > 1, refinement


def _on_subdivisions(
    surfaces: Sequence[tuple[Surface, np.ndarray | None, CornerPins | None]],
    refined: Sequence[_RefinedIsland],
    modifiers: Sequence[SubdivisionModifier | None],
    settings: RefineSettings,
) -> Steps[tuple[list[_RefinedIsland], list[tuple[int, str]]]]:
    """All islands, those of surfaces with modifiers refined for the subdivided surfaces, and warnings."""
    found: list[_RefinedIsland] = []
    warnings: list[tuple[int, str]] = []
    for owner, (surface, modifier) in enumerate(zip(surfaces, modifiers, strict=True)):
        mine = [r for r in refined if r.owner == owner]
        if modifier is not None and mine:
            mine, texts = yield from _on_subdivision(surface, mine, modifier, settings)
            warnings += [(owner, text) for text in texts]
        found += mine
    return found, warnings


def _on_subdivision(
    given: tuple[Surface, np.ndarray | None, CornerPins | None],
    refined: Sequence[_RefinedIsland],
    modifier: SubdivisionModifier,
    settings: RefineSettings,
) -> Steps[tuple[list[_RefinedIsland], tuple[str, ...]]]:
    """The islands of a surface refined for the areas of its subdivided surface, where they lay, and warnings."""
    surface, _, pins = given
    # Islands that look to the other side are mapped as in a mirror.
    mirrors = [np.array([np.sign(signed_areas(r.refinement.uv, r.island.chart.triangles).sum()), 1]) for r in refined]
    charts = [r.island.chart for r in refined]
    maps = [_as_chart_map(r.refinement, mirror) for r, mirror in zip(refined, mirrors, strict=True)]
    kept = "kept" if settings.keep_boundary else "free"
    found = SurfaceMap(charts, maps, np.zeros((0, 2), np.int64))
    areas_first = settings.balance == 0
    found = yield from refined_on_subdivision(surface, found, modifier, pins, kept, areas_first=areas_first)
    better = []
    for r, mirror, chart_map in zip(refined, mirrors, found.maps, strict=True):
        uv = chart_map.uv * mirror
        if not r.fixed_scale and r.pins is None:
            uv = _placed_like(uv, r.refinement.uv, r.island.chart)
        warnings = (*r.refinement.warnings, *chart_map.warnings)
        better.append(replace(r, refinement=replace(r.refinement, uv=uv, warnings=warnings)))
    return better, (*found.warnings, *(text for m in found.maps for text in m.warnings))


def _as_chart_map(refinement: Refinement, mirror: np.ndarray) -> ChartMap:
    """A refinement as the map of a chart, to refine it further."""
    return ChartMap(
        uv=refinement.uv * mirror,
        newton_refinement=refinement.iterations,
        residual_refinement=refinement.residual,
        status=refinement.status,
        area_l1=0.0,
        area_sd=0.0,
        angle_mean=0.0,
        folds=0,
        area_weight=refinement.area_weight,
    )


def _placed_like(uv: np.ndarray, given: np.ndarray, chart: Chart) -> np.ndarray:
    """A map uv (n,2) with the area, the place and the direction of another one."""
    now, before = (abs(float(signed_areas(x, chart.triangles).sum())) for x in (uv, given))
    w = np.sqrt(before / now) * (uv @ [1, 1j])
    w = fit_similarity(w, given @ [1, 1j], rigid=True)(w)
    return np.column_stack([w.real, w.imag])


def _shown(error: MeshError, chart: Chart) -> MeshError:
    """An error about the island as a whole points to its faces."""
    if isinstance(error, FoldedUVError) and not error.kind:
        return FoldedUVError(error.cause, error.remedy, "face", np.arange(len(chart.faces)))
    return error


def _at_one_density(refined: Sequence[_RefinedIsland]) -> list[np.ndarray]:
    """UVs (n_i,2) of all islands, those of no fixed scale scaled about their centroid, or their pin."""
    areas = np.array([r.areas for r in refined])
    loose = np.array([not r.fixed_scale for r in refined])
    uvs = []
    for r, (space, covered) in zip(refined, areas, strict=True):
        uv = r.refinement.uv
        if not r.fixed_scale:
            target = space * areas[loose, 1].sum() / areas[loose, 0].sum()
            centre = _centroid(r.island.chart, uv) if r.pins is None else r.pins.places[0]
            uv = centre + (uv - centre) * np.sqrt(target / covered)
        uvs.append(uv)
    return uvs


def _centroid(chart: Chart, uv: np.ndarray) -> np.ndarray:
    """Mean of the map (n,2) over the surface."""
    area = face_areas(chart.vertices, chart.triangles)
    return (area[:, None] * uv[chart.triangles].mean(axis=1)).sum(axis=0) / area.sum()


def _packed(
    refined: Sequence[_RefinedIsland], uvs: list[np.ndarray], settings: RefineSettings
) -> Steps[list[np.ndarray]]:
    """The islands without pins packed into the unit square, the others where they are."""
    loose = [k for k, r in enumerate(refined) if r.pins is None and not r.fixed_scale]
    triangles = [refined[k].island.chart.triangles for k in loose]
    packed = yield from pack_islands([uvs[k] for k in loose], triangles, settings)
    result = list(uvs)
    for k, uv in zip(loose, packed.islands, strict=True):
        result[k] = uv
    return result


def _report(refined: _RefinedIsland, uv: np.ndarray) -> dict:
    """Figures of an island for a report, before and after."""
    chart, done = refined.island.chart, refined.refinement
    before, after = (
        distortion(
            chart.vertices,
            chart.triangles,
            x[chart.triangles],
            overlap=False,
            density=refined.density,
            polygons=chart.faces,
        )
        for x in (refined.island.uv, uv)
    )
    return {
        "vertices": len(chart.vertices),
        "faces": len(np.unique(chart.faces)),
        "triangles": len(chart.triangles),
        "pins": 0 if refined.pins is None else len(refined.pins.vertices),
        "newton_refinement": done.iterations,
        "residual_refinement": done.residual,
        "status": done.status,
        "before": {name: getattr(before, name) for name in FIGURES},
        **{name: getattr(after, name) for name in FIGURES},
        "overlap": done.overlap,
        "warnings": list(done.warnings),
    }
