"""Map one chart: conformal map -> optimal transport -> refinement.

Each stage may be replaced by a milder one where its mathematics leaves double precision; the result says so.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..analysis.density import Target, area_error_warnings
from ..canonical.markers import ChartMarkers
from ..errors import FoldedUVError, MeshError, PinError, PrecisionError, TransportError, positive_density, without_room
from ..freed_memory import give_back_of
from ..maps.contacts import touches_itself
from ..maps.distortion import RATIO_FLOOR, Distortion, distortion, face_distortion
from ..maps.tutte import arcs_of_parts
from ..mesh.charts import Chart
from ..mesh.geometry import bounding_box, face_areas, signed_areas
from ..mesh.polygon_areas import polygon_areas
from ..mesh.topology import boundary_loops
from ..progress import RunLog, Steps, part_of
from ..refinement.continuation_rules import QUALITIES
from ..refinement.elimination_order import has_several
from ..refinement.initial_maps import unroll
from ..refinement.refine import Refinement, RefinementOptions, refine
from ..transport.convex_domain import Disk
from .chart_indices import ChartPins, mirrored_to_pins, moved_to_pins, refuse_pins_on_outline
from .initial_map import (
    COARSE_ABOVE,
    DRAFT_ABOVE,
    DRAFT_SPREAD,
    InitialChartMap,
    coarse_initial_map,
    direct_initial_map,
    evened_initial_map,
    flat_initial_map,
    good_enough,
    mean_value_sites,
    roomier_initial_map,
    roomy_initial_map,
)
from .options import MapOptions
from .polygons.polygon_disk import DiskMesh, of_polygon_disk, polygon_disk, with_centres

# Where the time of a chart goes, roughly, as start and width in [0, 1]: a bar that moves evenly needs no more.
INITIAL = (0.0, 0.4)
REFINEMENT = (0.4, 0.6)
# Boundaries with four corners.
RECTANGLES = ("square", "rectangle")
# Errors of charts that have no map in double precision.
WITHOUT_MAP = (FoldedUVError, PrecisionError, TransportError)
ANOTHER_SEAM = "Cut this part further, with automatic seams or another one along it"
# Shear of what has no area to speak of.
VANISHED = 50.0
# Mean shear above 1, and area error, of maps that have no shear to speak of: what is unrolled.
UNROLLED = 1e-4
# Share of its area below which a face is nothing in single precision: a disk, a square or a rectangle has no room then.
NO_ROOM = 1e-7
NOWHERE = np.zeros((0, 2))  # coordinates of no vertices
# What is said, after their number, of faces of a map that is returned all the same.
FOLDED = "faces are folded or without area in the map"


@dataclass(frozen=True, kw_only=True)
class ChartMap:
    """Texture coordinates of one chart.

    Attributes
    ----------
    uv (n,2) : in the units of the surface: the UV area is the area of the chart, and 0 the centroid of a chart with a
        free boundary, the middle of its disk or square otherwise. A chart with pins (pinned) is where its pins are
        instead, at a scale that follows from them
    newton_conformal, newton_transport : Newton steps; None where a stage was replaced
    residual_conformal : largest error of an angle sum, radians; residual_transport : |cell area - mass| / mass
    newton_refinement, residual_refinement, status, area_weight : see `refine.Refinement`
    area_l1, area_sd, angle_mean, folds : see `distortion.Distortion`
    warnings : what was replaced and why; seconds : wall-clock time per stage
    failure : why there is no map, where the chart is to be cut instead; its uv are all 0 then
    """

    uv: np.ndarray
    newton_conformal: int | None = None
    residual_conformal: float | None = None
    newton_transport: int | None = None
    residual_transport: float | None = None
    newton_refinement: int = 0
    residual_refinement: float = 0.0
    status: str = ""
    area_l1: float
    area_sd: float
    angle_mean: float
    folds: int
    warnings: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    pinned: bool = False
    area_weight: float = 0.0
    failure: MeshError | None = None

    def report(self, chart: Chart) -> dict:
        """Everything but the coordinates, for a JSON file."""
        figures = {k: v for k, v in vars(self).items() if k not in ("uv", "area_weight", "failure")}
        size = {"vertices": len(chart.vertices), "faces": len(np.unique(chart.faces))}
        counts = {**size, "triangles": len(chart.triangles)}
        return {**counts, **figures, "warnings": list(self.warnings), "weight": self.area_weight}


def map_chart(
    chart: Chart,
    *,
    options: MapOptions | None = None,
    target: Target | None = None,
    pins: ChartPins | None = None,
    markers: ChartMarkers | None = None,
) -> Steps[ChartMap]:
    """Map one chart so that its areas are kept, by a conformal map, optimal transport and Newton's method.

    Parameters
    ----------
    target : density (m,) > 0 multiplies the area that each triangle asks for, 1 by default; the map has the area asked
        for. Of a region (m,) the share of the map is to be exact
    pins : two or more fix place, direction and scale; one fixes the place, and the chart stays as large as it is
    markers : corners of a rectangle, and which way the map is turned

    Raises
    ------
    PinError : pins that force a fold, or that a disk or a square cannot keep
    PrecisionError, TransportError, FoldedUVError : where even the fallbacks fail
    DensityError : a density that is not positive and finite
    """
    options, markers, log = options or MapOptions(), markers or ChartMarkers(), RunLog()
    _refuse_pins(pins, options)
    density, plain = None if target is None else target.density, target is None and pins is None
    vertices, unit = in_unit_box(chart.vertices)
    disk = _disk_mesh(vertices, chart, options, target, log, markers)
    if options.kind != "authalic":
        return (yield from _named_map(chart, disk, unit, options, markers, log))
    draft = options.quality == "draft" and options.balance == 0 and plain
    goal = QUALITIES[options.quality].area_error if plain else 0.0
    initial = yield from part_of(_initial_map(disk, options.balance, log, draft, goal), *INITIAL)
    with log.timed("refinement"):
        start, places = mirrored_to_pins(initial.uv, pins)
        refined = good_enough(disk, start, draft, initial.apart, goal) if plain else None
        if refined is None:
            again = _refinement_options(disk, options, initial, places is None)
            steps = _refined(replace(disk), start, again, target is not None, places, log)
            disk, initial, start, vertices = _outlined(disk), replace(initial, uv=NOWHERE), NOWHERE, NOWHERE
            refined = yield from part_of(steps, *REFINEMENT)
        refined = replace(refined, uv=refined.uv[: len(chart.vertices)])  # without the centres of polygons
    with log.timed("measure"):
        vertices, unit = in_unit_box(chart.vertices)
        figures = measured_chart(vertices, chart, refined.uv, density)
    if target is not None and options.balance == 0:
        log.warnings += area_error_warnings(figures.area_l1, QUALITIES[options.quality].area_error)
    log.warnings += [f"{figures.folds} {FOLDED}"] if figures.folds else []
    uv = refined.uv
    if places is None:
        uv = placed_chart(uv, vertices, chart, density, unit, pins, disk.boundary == "free")
        uv = _turned(uv, disk, markers, pins, log)
    return _chart_map(uv, initial, refined, figures, log, pins is not None)


def _refinement_options(disk: DiskMesh, options: MapOptions, start: InitialChartMap, loose: bool) -> RefinementOptions:
    """How the map of a disk is refined from a start; loose: without pins. Quads are ordered as such."""
    return RefinementOptions(
        boundary=disk.boundary,
        balance=options.balance,
        quality=options.quality,
        warm_start=start.warm and loose,
        prolonged=start.prolonged and loose,
        multiplier=start.multiplier,
        order=None if disk.polygons is not None and has_several(disk.polygons) else disk.order,
    )


def _outlined(disk: DiskMesh) -> DiskMesh:
    """What is known of a disk but its mesh, which what refines it has: steps take so much memory that nothing waits for
    their end twice. It is without the maps that were made of it on the way, too."""
    none = np.zeros((0, 3), np.int64)
    return replace(disk, vertices=none, triangles=none, target=none[:, 0], region=None, polygons=None)


def _refuse_pins(pins: ChartPins | None, options: MapOptions) -> None:
    refuse_pins_on_outline(pins, options.boundary)
    if pins is not None and options.kind != "authalic":
        raise PinError("Pins are kept by area preserving maps alone", "Unpin these vertices, or map by areas")


def refined_again(
    chart: Chart, uv: np.ndarray, options: MapOptions, target: Target | None = None, crossing: bool = False
) -> Steps[np.ndarray]:
    """A map uv (n,2) of a chart without pins, refined further from where it is; errors are those of `map_chart`.

    crossing: a free boundary may come to cross itself
    """
    return (yield from refined_on(chart, uv, options, target, crossing=crossing)).uv


def refined_on(
    chart: Chart, uv: np.ndarray, options: MapOptions, target: Target | None = None, **changes: Any
) -> Steps[Refinement]:
    """What `refined_again` gives, and how it was found; changes : of the `RefinementOptions` that it has."""
    vertices, unit = in_unit_box(chart.vertices)
    disk = _disk_mesh(vertices, chart, options, target, RunLog(), ChartMarkers())
    start = with_centres(uv / unit, disk.triangles, len(disk.vertices))
    again = _refinement_options(disk, options, InitialChartMap(start, warm=True), True)
    again = replace(again, **{"order": None, **changes})
    asked = None if target is None else disk.target
    refined = yield from refine(
        disk.vertices, disk.triangles, start, again, target=asked, region=disk.region, polygons=disk.polygons
    )
    density = None if target is None else target.density
    uv = placed_chart(refined.uv[: len(uv)], vertices, chart, density, unit, None, disk.boundary == "free")
    return replace(refined, uv=uv)


def _chart_map(
    uv: np.ndarray,
    initial: InitialChartMap,
    refined: Refinement,
    figures: Distortion,
    log: RunLog,
    pinned: bool,
) -> ChartMap:
    """What the stages of a map found, in one."""
    conformal, cells = initial.conformal, initial.cells
    bare = _stages(uv, conformal, cells, figures, log, refined.warnings)
    return replace(
        bare,
        newton_refinement=refined.iterations,
        residual_refinement=refined.residual,
        status=refined.status,
        pinned=pinned,
        area_weight=refined.area_weight,
    )


def no_map(chart: Chart, failure: MeshError) -> ChartMap:
    """What stands for the map of a chart that has none in double precision, until it is cut further."""
    uv, folds, off = np.zeros((len(chart.vertices), 2)), len(np.unique(chart.faces)), np.inf
    return ChartMap(uv=uv, status="failed", area_l1=off, area_sd=off, angle_mean=off, folds=folds, failure=failure)


def _stages(uv: np.ndarray, conformal, cells, figures: Distortion, log: RunLog, warnings: tuple[str, ...]) -> ChartMap:
    """A map that is not refined, from what its stages, None for those it has not, and its figures say."""
    return ChartMap(
        uv=uv,
        newton_conformal=conformal.iterations if conformal else None,
        residual_conformal=conformal.residual if conformal else None,
        newton_transport=cells.iterations if cells else None,
        residual_transport=cells.residual if cells else None,
        area_l1=figures.area_l1,
        area_sd=figures.area_sd,
        angle_mean=figures.angle_mean,
        folds=figures.folds,
        warnings=tuple(dict.fromkeys((*log.warnings, *warnings))),
        seconds=log.seconds,
    )


def _turned(uv: np.ndarray, disk: DiskMesh, markers: ChartMarkers, pins: ChartPins | None, log: RunLog) -> np.ndarray:
    """A map uv (n,2) turned as its markers say, if it may be."""
    if markers.centre >= 0 or len(markers.corners) == 3:
        log.warnings.append("Markers of a centre, and of three places, are kept by conformal and polar maps alone")
    return markers.turned(uv) if disk.corners is None and pins is None else uv


def _named_map(
    chart: Chart, disk: DiskMesh, unit: float, options: MapOptions, markers: ChartMarkers, log: RunLog
) -> Steps[ChartMap]:
    """A map by name: see `canonical.named_maps`."""
    from ..canonical.named_maps import NamedProblem, conformal_map, polar_map

    aspect = 1.0 if disk.boundary == "square" and options.kind == "polar" else options.aspect
    problem = NamedProblem(disk.vertices, disk.triangles, disk.target, disk.boundary, disk.corners, aspect, markers)
    if disk.boundary == "square" and options.kind == "conformal":
        log.warnings.append("A conformal map fills a rectangle of its own aspect, and no square")
    with log.timed(options.kind):
        steps = conformal_map(problem) if options.kind == "conformal" else polar_map(problem, options.balance)
        found = yield from steps
    vertices = disk.vertices[: len(chart.vertices)]
    uv = found.uv[: len(vertices)]
    with log.timed("measure"):
        figures = measured_chart(vertices, chart, uv, None)
    if figures.folds:
        log.warnings.append(f"{figures.folds} {FOLDED}")
    placed = placed_chart(uv, vertices, chart, None, unit, None, disk.boundary == "free")
    return replace(_stages(placed, found.conformal, found.cells, figures, log, found.warnings), status=options.kind)


def _disk_mesh(
    vertices: np.ndarray, chart: Chart, options: MapOptions, target: Target | None, log: RunLog, markers: ChartMarkers
) -> DiskMesh:
    """The chart, vertices (n,3) in a unit box, as a disk to be mapped, its polygons cut for that.

    Patches over holes are mapped with the rest, and forgotten afterwards.
    """
    disk = polygon_disk(vertices, chart)
    area, region, loop = face_areas(disk.vertices, disk.triangles), None, boundary_loops(disk.triangles)[0]
    boundary = options.boundary
    if target is not None:
        area = area * of_polygon_disk(positive_density(target.density), vertices, chart, disk, 1.0)
        if target.region is not None:
            region = of_polygon_disk(target.region, vertices, chart, disk, 0.0)
    if boundary in RECTANGLES and len(loop) < 4:
        text = f"A chart with only three boundary vertices does not fill a {boundary}; its boundary is free"
        log.warnings.append(text)
        boundary = "free"
    exact = boundary != "free" and options.kind == "authalic" and options.balance == 0
    if exact and arcs_of_parts(disk.triangles, loop, area)[0].sum() > 1:
        why = "parts that single edges cut off take more than all of a circle"
        log.warnings.append(without_room(boundary, why))
        boundary = "free"
    corners, aspect = None, 1.0
    if boundary in RECTANGLES:
        from ..canonical.rectangles import natural_aspect, rectangle_corners
        from ..conformal.disk_map import sharpest_corners

        corners = np.array(markers.corners, np.int64)
        if len(corners) != 4:
            find = sharpest_corners if boundary == "square" else rectangle_corners
            corners = find(disk.vertices, disk.triangles, loop)
        if boundary == "rectangle":
            aspect = options.aspect or natural_aspect(disk.vertices, disk.triangles, corners)
    return DiskMesh(
        vertices=disk.vertices,
        triangles=disk.triangles,
        target=area,
        loop=loop,
        boundary=boundary,
        corners=corners,
        region=region,
        polygons=disk.polygons,
        aspect=aspect,
    )


def _initial_map(disk: DiskMesh, balance: float, log: RunLog, draft: bool, goal: float) -> Steps[InitialChartMap]:
    """The initial map: charts with a free boundary are unrolled or flattened where that changes their areas little;
    large ones come by way of a coarser mesh."""
    if disk.boundary == "free":
        flat = unroll(disk.vertices, disk.triangles, disk.loop)
        # What touches itself and is to be refined has to begin where it does not.
        if flat is not None and (not touches_itself(flat, disk.loop) or good_enough(disk, flat, draft, True, goal)):
            return InitialChartMap(flat, apart=True)
        if draft and len(disk.vertices) <= COARSE_ABOVE:
            even = flat_initial_map(disk, log, DRAFT_SPREAD)
            if even is not None:
                return even
    if not draft or (disk.boundary != "free" and len(disk.vertices) <= COARSE_ABOVE):
        roomy = roomy_initial_map(disk, log) if disk.boundary == "free" else evened_initial_map(disk, log, large=False)
        if roomy is not None:
            return roomy
    if len(disk.vertices) > (DRAFT_ABOVE if draft else COARSE_ABOVE):
        try:
            found = yield from coarse_initial_map(disk, balance, log, draft=draft)
            if found is not None:
                return found
        except MeshError as error:
            log.warnings.append(f"{error.cause}; refined without a coarser mesh")
    return (yield from (direct_initial_map(disk, log) if draft else roomier_initial_map(disk, balance, log)))


def _refined(
    disk: DiskMesh, uv: np.ndarray, options: RefinementOptions, has_target: bool, pins, log: RunLog
) -> Steps[Refinement]:
    """The refined map, with a free boundary where the domain asked for leaves faces folded; pins : see `refine`."""
    domain, given = options.boundary, {"region": disk.region, "polygons": disk.polygons, "pins": pins}
    given["target"] = disk.target if has_target else None
    try:
        steps = refine(disk.vertices, disk.triangles, uv, options, **given)
        if domain == "free":
            del disk, uv, given
        refined = yield from steps
        if domain == "free" or (signed_areas(refined.uv, disk.triangles) > NO_ROOM * disk.target).all():
            return refined
        cause = "faces stay squeezed to nothing"
    except (FoldedUVError, PrecisionError) as error:
        if domain == "free":
            raise type(error)(error.cause, ANOTHER_SEAM, error.kind, error.elements) from error
        cause = error.cause
    log.warnings.append(without_room(domain, cause))
    uv = mean_value_sites(disk.vertices, disk.triangles, disk.loop, None, Disk())
    free = RefinementOptions(balance=options.balance, quality=options.quality)
    return (yield from refine(disk.vertices, disk.triangles, uv, free, **given))


def measured_chart(vertices: np.ndarray, chart: Chart, uv: np.ndarray, density: np.ndarray | None) -> Distortion:
    """Figures of a map (n,2) of the polygons of a chart, at the positions (n,3), against a density (m,)."""
    give_back_of(len(vertices))
    mapped = uv[chart.triangles]
    return distortion(vertices, chart.triangles, mapped, overlap=False, density=density, polygons=chart.faces)


def measured_map(chart: Chart, uv: np.ndarray, density: np.ndarray | None) -> Distortion:
    """Figures of a map (n,2) of a chart, of any size, against a density (m,)."""
    return measured_chart(in_unit_box(chart.vertices)[0], chart, in_unit_box(uv)[0], density)


def local_shear(chart: Chart, chart_map: ChartMap, kept: bool) -> tuple[np.ndarray, np.ndarray]:
    """The shear s1/s2 (m,) of triangles, and the areas (m,) of these.

    kept : areas are to be kept; then it is the shear that has the symmetric Dirichlet energy of their polygons
    """
    area = polygon_areas(chart.vertices, chart.triangles, chart.faces)
    if chart_map.failure is not None:
        return np.full(len(area), VANISHED), area
    if not chart_map.folds and max(chart_map.angle_mean - 1, chart_map.area_l1) <= UNROLLED:
        return np.ones(len(area)), area
    octaves, shear = face_distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles], chart.faces)
    if kept:
        # A corner of a polygon that folds is mended at last, too: what the rest of it shears is what a seam can help.
        ratio = np.where(octaves > np.log2(2 * RATIO_FLOOR), 2.0 ** np.clip(octaves, -20, 20), 1.0)
        energy = (ratio + 1 / ratio) * (shear + 1 / shear) / 4
        # Quads that fold or vanish, also along the other diagonal, are mended at last: no seam helps against them.
        shear = np.minimum(energy + np.sqrt(energy**2 - 1), VANISHED)
    return shear, area


def placed_chart(
    uv: np.ndarray, vertices, chart: Chart, density, unit: float, pins: ChartPins | None, centred: bool = True
) -> np.ndarray:
    """A map uv (n,2) of a chart in a unit box, as large as its target really is, or where its one or two pins are.

    centred : with its centroid at 0, if it has no pins
    """
    # A polygon inscribed in the disk is smaller than the disk: one texel density needs its own area.
    covered = signed_areas(uv, chart.triangles).sum()
    area = polygon_areas(vertices, chart.triangles, chart.faces)
    uv = uv * np.sqrt((area.sum() if density is None else area @ density) / covered)
    if pins is not None:
        return moved_to_pins(uv, chart.triangles, pins)
    if centred:
        area = signed_areas(uv, chart.triangles)
        uv = uv - area @ uv[chart.triangles.T].mean(axis=0) / area.sum()
    return uv * unit


def in_unit_box(positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Positions (n,3) moved to 0 and divided by their extent, so that no unit over- or underflows; the extent."""
    middle, extent = bounding_box(positions)
    return (positions - middle) / extent, extent
