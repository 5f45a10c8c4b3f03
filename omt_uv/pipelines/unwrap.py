"""Unwrap several surfaces into one packed layout; the one path of the operator and of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..settings import Settings
from ..solver.analysis.facing import Y_UP, SceneAxes
from ..solver.canonical.markers import MapMarkers
from ..solver.errors import DISSOLVE, MERGING, MeshError, plural
from ..solver.maps.upright import turn_upright
from ..solver.mesh.charts import Chart
from ..solver.mesh.geometry import face_areas, signed_areas, turned_by
from ..solver.mesh.repair import flat_triangles, joined_vertices
from ..solver.mesh.surface import FlatTriangles, side_ends, turned_surface, with_joined_vertices
from ..solver.mesh.topology import pair_keys, paired, twins
from ..solver.parameterization.chart_indices import CornerPins
from ..solver.parameterization.options import UnwrapOptions
from ..solver.parameterization.small_charts import SMALL
from ..solver.parameterization.unwrap import CutCharts, SurfaceMap, cut_charts, map_small_charts, unwrap
from ..solver.progress import Progress, Steps, part_of
from ..xatlas_charts import SegmentationError, chart_seams
from .layout import (
    PACKING_FROM,
    Layout,
    PlacedIsland,
    Refusal,
    UnwrapJob,
    corner_uvs,
    in_single_precision,
    pack_islands,
)

# Share of the time that the cage's own maps take where those of its subdivided surface follow.
CAGE_SHARE = 0.5


def lay_out(
    jobs: Sequence[UnwrapJob],
    settings: Settings,
) -> Steps[Layout]:
    """Unwrap surfaces at one texel density into one unit square.

    Solver results have the area of the surface, or of the target, so packing with a single scale gives every island
    of every surface the same texels per area. Islands are turned upright. Those
    with pins are neither turned, scaled nor packed, as in Blender; the others are packed as if they were not there, or,
    by `settings.pack_around`, around them and around what the surfaces have beside the polygons that are unwrapped.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    MarginError : the margins leave no room for the islands
    """
    options = UnwrapOptions(**settings.unwrap_arguments())
    maps: list[SurfaceMap] = []
    as_they_stand, jobs = jobs, [_set_up(job) for job in jobs]
    whole, (jobs, flat, warnings) = jobs, _without_flat(jobs, settings.seams)
    given, (jobs, more) = jobs, _prepared(jobs, settings.seams)
    warnings += more
    share = PACKING_FROM / len(jobs)
    options_of = _in_one_texture(jobs, options)
    cuts = yield from _cut_together(jobs, options_of)
    for index, job in enumerate(jobs):
        try:
            unwrapping = _unwrapped(job, options_of[index], cuts.get(index))
            found = yield from part_of(unwrapping, index * share, share)
            maps.append(_seams_as_given(found, given[index], job))
        except MeshError as error:
            raise Refusal(index, error) from error
        warnings += [(index, text) for text in maps[-1].warnings]
        warnings += [(index, text) for chart_map in maps[-1].maps for text in chart_map.warnings]
    mapped = [
        PlacedIsland(index, chart, chart_map.uv)
        for index, surface_map in enumerate(maps)
        for chart, chart_map in zip(surface_map.charts, surface_map.maps, strict=True)
    ]
    pinned = [chart_map.pinned for surface_map in maps for chart_map in surface_map.maps]
    free = [island for island, stays in zip(mapped, pinned, strict=True) if not stays]
    staying = [island for island, stays in zip(mapped, pinned, strict=True) if stays]
    around = []
    if settings.pack_around:
        around = [(i.uv, i.chart.triangles) for i in staying] + [x for job in whole for x in _beside(job)]
    elif staying:
        warnings.append((-1, _in_place(len(staying), len(free))))
    triangles = [_connected_triangles(island.chart) for island in free]
    upright = _upright(free, jobs, maps)
    # What markers say stays as they say.
    turnable = np.array([jobs[island.owner].markers is None for island in free], dtype=bool)
    steps = pack_islands(upright, triangles, settings, around, turnable)
    packed = yield from part_of(steps, PACKING_FROM, 1 - PACKING_FROM)
    moved = [replace(i, uv=uv) for i, uv in zip(free, packed.islands, strict=True)]
    rounded = iter(in_single_precision(moved))
    placed = [i if stays else next(rounded) for i, stays in zip(mapped, pinned, strict=True)]
    carried = [one.carried(*laid) for one, *laid in zip(flat, *corner_uvs(len(maps), placed), strict=True)]
    corners, uv = (list(x) for x in zip(*carried, strict=True))
    as_given = [_set_back(one, job.axes) for one, job in zip(maps, as_they_stand, strict=True)]
    return Layout(corners=corners, uv=uv, maps=as_given, packing=packed, warnings=warnings)


def _set_up(job: UnwrapJob) -> UnwrapJob:
    """The job with its surface turned so that Y is up: the same body gets the same cuts whatever its file calls up, for
    a search that branches tells roundings apart."""
    return replace(job, surface=turned_surface(job.surface, job.axes.frame), axes=Y_UP)


def _set_back(found: SurfaceMap, axes: SceneAxes) -> SurfaceMap:
    """What was found for a surface that `_set_up` has turned, as it stands itself."""
    back = axes.frame.T
    charts = [replace(chart, vertices=turned_by(chart.vertices, back)) for chart in found.charts]
    return replace(found, charts=charts, axes=None if found.axes is None else found.axes.turned_by(back))


def _upright(
    islands: Sequence[PlacedIsland], jobs: Sequence[UnwrapJob], maps: Sequence[SurfaceMap]
) -> list[np.ndarray]:
    """UVs (n,2) of islands turned upright, but for those whose markers say how they lie."""
    turned = [k for k, island in enumerate(islands) if jobs[island.owner].markers is None]
    charts, owners = [islands[k].chart for k in turned], [islands[k].owner for k in turned]
    axes = [maps[owner].axes or jobs[owner].axes for owner in owners]
    ups, viewers = [scene.up for scene in axes], [scene.viewer for scene in axes]
    upright = turn_upright(charts, [islands[k].uv for k in turned], ups, viewers)
    found = dict(zip(turned, upright, strict=True))
    return [found.get(k, island.uv) for k, island in enumerate(islands)]


def _beside(job: UnwrapJob) -> list[tuple[np.ndarray, np.ndarray]]:
    """Corners (3k,2) and triangles (k,3) of the polygons that have UVs and are not unwrapped, each by itself."""
    if job.uv is None or job.faces is None or job.faces.all():
        return []
    corners = job.surface.triangles[~job.faces[job.surface.triangle_face]]
    points = np.asarray(job.uv, dtype=float)[corners]
    area = signed_areas(points.reshape(-1, 2), np.arange(corners.size).reshape(-1, 3))
    # Faces that are mirrored in the map are outlined the other way round.
    points = np.where((area < 0)[:, None, None], points[:, ::-1], points)[area != 0]
    return [(points.reshape(-1, 2), np.arange(points.shape[0] * 3).reshape(-1, 3))] if len(points) else []


def _cut_together(jobs: Sequence[UnwrapJob], options: Sequence[UnwrapOptions]) -> Steps[dict[int, CutCharts]]:
    """Charts of several small surfaces, by the numbers of these, those mapped that can be solved together."""
    small = [k for k, job in enumerate(jobs) if len(job.surface.triangles) <= SMALL and job.subdivision is None]
    small = [k for k in small if jobs[k].markers is None]
    if len(small) < 2:
        return {}
    cuts = []
    for k in small:
        yield Progress("Charts", 0.0)
        job = jobs[k]
        try:
            given: dict[str, Any] = {
                "options": options[k],
                "pins": job.pins,
                "target": job.target,
                "avoid": job.avoid,
            }
            cuts.append((yield from part_of(cut_charts(job.surface, job.faces, **given), 0.0, 0.0)))
        except MeshError as error:
            raise Refusal(k, error) from error
    cuts = yield from part_of(map_small_charts(cuts, options[0]), 0.0, 0.0)
    return dict(zip(small, cuts, strict=True))


def _in_one_texture(jobs: Sequence[UnwrapJob], options: UnwrapOptions) -> list[UnwrapOptions]:
    """The options of each of several surfaces, which know how much lies beside it."""
    if len(jobs) == 1:
        return [_standing(options, jobs[0])]
    areas = np.zeros(len(jobs))
    for k, job in enumerate(jobs):
        surface, chosen = job.surface, job.chosen[job.surface.triangle_face]
        # What is not finite is refused in its turn.
        with np.errstate(all="ignore"):
            areas[k] = face_areas(surface.positions, surface.corner_vertex[surface.triangles[chosen]]).sum()
    areas[~np.isfinite(areas)] = 0.0
    beside = areas.sum() - areas
    return [_standing(replace(options, beside=float(b)), job) for b, job in zip(beside, jobs, strict=True)]


def _standing(options: UnwrapOptions, job: UnwrapJob) -> UnwrapOptions:
    """The options of a surface that stands in the scene: cuts are hidden from where it is looked at."""
    return replace(options, preferences=replace(options.preferences, axes=job.axes))


def _unwrapped(job: UnwrapJob, options: UnwrapOptions, cut: CutCharts | None = None) -> Steps[SurfaceMap]:
    """The maps of the charts of a surface, for the areas of its subdivided surface where it has a modifier for that."""
    target, modifier = job.target, job.subdivision
    share = 1.0
    if modifier is not None:
        from .subdivision import refinable, subdivided_target

        share = CAGE_SHARE
        if options.boundary != "free" or not refinable(job.surface):
            target = subdivided_target(job.surface, modifier, job.target)
    given: dict[str, Any] = {
        "options": options,
        "pins": job.pins,
        "target": target,
        "avoid": job.avoid,
        "markers": job.markers,
    }
    steps = unwrap(job.surface, job.faces, cut=cut, **given)
    found = yield from part_of(steps, 0.0, share)
    if modifier is None or options.kind != "authalic":
        return found
    from .subdivision import refined_on_subdivision

    density = None if job.target is None else job.target.density
    areas_first = options.balance == 0
    rest = refined_on_subdivision(job.surface, found, modifier, job.pins, options.boundary, density, areas_first)
    return (yield from part_of(rest, share, 1 - share))


def _without_flat(
    jobs: Sequence[UnwrapJob], seams: str
) -> tuple[list[UnwrapJob], list[FlatTriangles], list[tuple[int, str]]]:
    """The jobs without triangles that would tear their maps and lie on others anyway, these triangles of each, and
    warnings."""
    rest, flat, warnings = [], [], []
    for index, job in enumerate(jobs):
        is_joined = seams == "auto" and job.subdivision is None
        found = flat_triangles(job.surface, job.chosen, job.was_split if is_joined else None)
        flat.append(found)
        if count := len(found.polygons):
            who = plural(count, "A triangle", "{} triangles")
            warnings.append((index, f"{who} with two corners at one place, left out of the map; {DISSOLVE}"))
            faces = job.chosen.copy()
            faces[found.polygons] = False
            job = replace(job, faces=faces, pins=_pins_of_hosts(job.pins, found))
        rest.append(job)
    return rest, flat, warnings


def _pins_of_hosts(pins: CornerPins | None, flat: FlatTriangles) -> CornerPins | None:
    """Pins of corners that get the UVs of others hold these, where they are not pinned themselves."""
    if pins is None:
        return None
    held = pins.pinned[flat.corners] & ~pins.pinned[flat.hosts]
    pinned, uv = pins.pinned.copy(), pins.uv.copy()
    pinned[flat.hosts[held]] = True
    uv[flat.hosts[held]] = uv[flat.corners[held]]
    return CornerPins(pinned, uv)


def _prepared(jobs: Sequence[UnwrapJob], seams: str) -> tuple[list[UnwrapJob], list[tuple[int, str]]]:
    """The jobs with the seams of charts, or with parts joined, and warnings."""
    prepare = {"charts": _with_charts, "auto": _joined}.get(seams, _as_it_is)
    prepared = [prepare(index, job) for index, job in enumerate(jobs)]
    return [job for job, _ in prepared], [(index, text) for index, (_, text) in enumerate(prepared) if text]


def _with_charts(index: int, job: UnwrapJob) -> tuple[UnwrapJob, str]:
    """The job with the seams of charts of low distortion added, or as it is and a warning."""
    try:
        more = chart_seams(job.surface, job.faces)
    except MeshError as error:
        raise Refusal(index, error) from error
    except SegmentationError as error:
        return job, f"{error}; cut only where it has to be"
    seams = np.concatenate([job.surface.seams, more])
    return replace(job, surface=replace(job.surface, seams=seams)), ""


def _as_it_is(index: int, job: UnwrapJob) -> tuple[UnwrapJob, str]:
    return job, ""


def _joined(index: int, job: UnwrapJob) -> tuple[UnwrapJob, str]:
    """The job with parts joined whose sides lie on one another, as importers leave them, or as it is; and a warning.

    A modifier subdivides the mesh as it is.
    """
    surface = job.surface
    if job.subdivision is not None:
        return job, ""
    same = joined_vertices(surface, job.chosen, job.was_split)
    moved = np.flatnonzero(same != np.arange(len(same)))
    if not len(moved):
        return job, ""
    avoid, markers = job.avoid, job.markers
    if avoid is not None:
        least = np.zeros(len(same))
        np.maximum.at(least, same, avoid)
        avoid = least
    if markers is not None:
        markers = MapMarkers(same[markers.centre], same[markers.start], same[markers.corners])
    who = plural(len(moved), "A boundary vertex lies on another and is", "{} boundary vertices lie on others and are")
    # Of a file that had no choice there is nothing to be told.
    text = "" if job.was_split else f"{who} joined to them for the map; {MERGING} joins them in the mesh, too"
    return replace(job, surface=with_joined_vertices(surface, same), avoid=avoid, markers=markers), text


def _seams_as_given(found: SurfaceMap, given: UnwrapJob, joined: UnwrapJob) -> SurfaceMap:
    """What was found for a job whose parts were joined, its seams along the edges of all vertices that were joined."""
    if joined.surface.corner_vertex is given.surface.corner_vertex:
        return found
    ends, there = side_ends(given.surface), side_ends(joined.surface)
    cut, keys = pair_keys(*found.seams.T), pair_keys(*there)
    every = pair_keys(*ends)[np.isin(keys, cut)]
    return replace(found, seams=paired(np.unique(np.concatenate([every, cut[~np.isin(cut, keys)]]))))


def _connected_triangles(chart: Chart) -> np.ndarray:
    """Triangles (m,3) to pack a chart by: with those that fill its holes where it falls apart without, or hangs by a
    vertex. The packer would scatter its parts."""
    if not len(chart.patches):
        return chart.triangles
    twin = twins(chart.triangles)
    inner = np.flatnonzero(twin >= 0)
    m = len(chart.triangles)
    pairs = coo_matrix((np.ones(len(inner)), (inner // 3, twin[inner] // 3)), shape=(m, m))
    return chart.triangles if connected_components(pairs, directed=False)[0] == 1 else chart.disk


def _in_place(pinned: int, others: int) -> str:
    """A warning that islands with pins are not packed."""
    text = plural(pinned, "An island with pins stays", "{} islands with pins stay")
    return f"{text} in place" + ("; the others were packed as if there were none" if others else "")
