"""The pipeline: polygon mesh -> charts -> conformal map -> transport -> refinement -> texture coordinates.

Each stage may be replaced by a milder one where its mathematics leaves double precision; the result says so.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .chart_pins import ChartPins, CornerPins, anchored, chart_pins, clear_of_pins, facing, refuse_outline
from .charts import Chart, Surface, triangle_rows
from .conformal import sharpest_corners
from .convex import opened
from .distortion import measure
from .domain import Disk, Domain, Rectangle
from .errors import FoldedUVError, MeshError, positive_density
from .first_map import COARSE_ABOVE, FirstMap, Log, coarse_first_map, first_map, mean_value_sites
from .geometry import face_areas, signed_areas
from .many import Maps, solve_many
from .measure import Target
from .preparation import prepare
from .progress import Progress, Steps, part_of
from .refine import BOUNDARIES, Refinement, refine
from .stages import QUALITIES
from .starts import unroll
from .topology import boundary_loops

# Where the time of a chart goes, roughly, as start and width: a bar that moves evenly needs no more.
FIRST, REFINEMENT = (0.0, 0.4), (0.4, 0.6)
# Charts of at most SMALL triangles are solved together where there are at least MANY, about BATCH triangles at a time.
SMALL, MANY, BATCH = 1000, 8, 50_000
# The area error of a map may grow by this factor, or to so much more than its goal, for polygons that are convex.
AREA_KEPT = 1.25


@dataclass(frozen=True)
class ChartMap:
    """Texture coordinates of one chart.

    uv (n,2) in the units of the surface: the UV area is the area of the chart, and 0 the centroid of a chart with a
    free boundary, the middle of its disk or square otherwise. A chart with pins
    (pinned) is where its pins are instead, at a scale that follows from them.
    newton_conformal, newton_transport : Newton steps; None where a stage was replaced
    residual_conformal : largest error of an angle sum, radians; residual_transport : |cell area - mass| / mass
    newton_refinement, residual_refinement, status : see `refine.Refinement`
    warnings : what was replaced and why; seconds : wall-clock time per stage; weight : of the area term at the end
    """

    uv: np.ndarray
    newton_conformal: int | None
    residual_conformal: float | None
    newton_transport: int | None
    residual_transport: float | None
    newton_refinement: int
    residual_refinement: float
    status: str
    area_l1: float
    area_sd: float
    angle_mean: float
    folds: int
    warnings: tuple[str, ...]
    seconds: dict[str, float]
    pinned: bool = False
    weight: float = 0.0

    def report(self, chart: Chart) -> dict:
        """Everything but the coordinates, for a JSON file."""
        figures = {k: v for k, v in vars(self).items() if k != "uv"}
        size = {"vertices": len(chart.vertices), "faces": len(np.unique(chart.faces))}
        return {**size, "triangles": len(chart.triangles), **figures, "warnings": list(self.warnings)}


@dataclass(frozen=True)
class SurfaceMap:
    """All charts of a surface and their maps, in one texel density.

    seams (k,2): edges that were cut for the map; warnings: what was repaired for the map.
    """

    charts: list[Chart]
    maps: list[ChartMap]
    seams: np.ndarray
    warnings: tuple[str, ...] = ()

    def corner_uv(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of the surface (k,) that were mapped, each once, and their coordinates (k,2), charts unpacked."""
        corners = np.concatenate([c.corners.ravel() for c in self.charts])
        uv = np.concatenate([m.uv[c.triangles.ravel()] for c, m in zip(self.charts, self.maps, strict=True)])
        corners, first = np.unique(corners, return_index=True)
        return corners, uv[first]

    def report(self) -> list[dict]:
        """One dictionary per chart, for a JSON file."""
        return [m.report(c) for c, m in zip(self.charts, self.maps, strict=True)]


def unwrap(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    boundary: str = "free",
    quality: str = "standard",
    balance: float = 0.0,
    pins: CornerPins | None = None,
    seams: str = "auto",
    fill_holes: bool = False,
    avoid: np.ndarray | None = None,
    target: Target | None = None,
) -> Steps[SurfaceMap]:
    """Area-preserving texture coordinates of the polygons `faces` (f,) bool, all by default.

    Parameters
    ----------
    boundary : "free" for the least shear; "disk" or "square", which every chart then fills
    quality : "draft", "standard" or "exact", how small the area error of single faces becomes
    balance : from 0, exact areas, to 1, least shear
    pins : corners that keep their places, with a free boundary
    seams, fill_holes, avoid : see `preparation.prepare`; cuts avoid pinned vertices, too
    target : density (m,) of the triangles of the surface, and a region; every triangle its own area by default

    Raises
    ------
    MeshError : see `preparation.prepare` and `unwrap_chart`; element indices are those of the surface
    """
    yield Progress("Charts", 0.0)
    avoid = clear_of_pins(surface, pins, avoid)
    prepared = prepare(surface, faces, seams=seams, fill_holes=fill_holes, avoid=avoid)
    charts = prepared.charts
    held = [located_pins(pins, chart) for chart in charts]
    maps: list[ChartMap] = []
    total = sum(len(c.triangles) for c in charts)
    alike = [k for k, c in enumerate(charts) if boundary == "free" and held[k] is None and _small(c)]
    done = sum(len(charts[k].triangles) for k in alike) / total
    targets = [chart_target(target, surface, charts[k]) for k in alike]
    found = yield from part_of(_together([charts[k] for k in alike], targets, quality, balance), 0.0, done)
    together = dict(zip(alike, found, strict=True))
    for k, (chart, fixed) in enumerate(zip(charts, held, strict=True)):
        ready = together.get(k)
        if ready is not None:
            maps.append(ready)
            continue
        share = 0.0 if k in together else len(chart.triangles) / total
        options: dict = {"boundary": boundary, "quality": quality, "balance": balance, "pins": fixed}
        steps = unwrap_chart(chart, **options, **chart_target(target, surface, chart))
        try:
            maps.append((yield from part_of(steps, done, share)))
        except MeshError as error:
            raise located(error, chart) from error
        done += share
    maps = with_open_corners(surface, charts, maps, held, boundary, quality, target)
    cuts = np.zeros((0, 2), np.int64) if prepared.cuts is None else prepared.cuts.edges
    return SurfaceMap(charts, maps, cuts, prepared.warnings)


def with_open_corners(
    surface: Surface,
    charts: list[Chart],
    maps: list[ChartMap],
    held: Sequence[ChartPins | None],
    boundary: str,
    quality: str,
    target: Target | None = None,
) -> list[ChartMap]:
    """The maps with polygons that are convex on the surface convex in them, too, as far as may be: `convex.opened`.

    held: the pins of every chart; the others as for `unwrap`. A map that would lose its areas stays as it is.
    """
    if not (np.diff(surface.face_start) > 3).any():
        return maps
    fixed = [_fixed(c, p, boundary) for c, p in zip(charts, held, strict=True)]
    density = [chart_target(target, surface, c).get("density") for c in charts]
    new = list(maps)
    for k, uv in opened(surface, charts, [m.uv for m in maps], fixed, density, [m.weight for m in maps]).items():
        chart, old = charts[k], maps[k]
        (vertices, _), (flat, unit) = _in_unit_box(chart.vertices), _in_unit_box(uv)
        figures = measure(vertices, chart.triangles, flat[chart.triangles], overlap=False, density=density[k])
        if figures.area_l1 <= AREA_KEPT * max(old.area_l1, QUALITIES[quality].area_error) and not figures.folds:
            if not fixed[k].any():
                uv = _as_before(flat, old.uv / unit, chart.triangles) * unit
            new[k] = replace(
                old, uv=uv, area_l1=figures.area_l1, area_sd=figures.area_sd, angle_mean=figures.angle_mean
            )
    return new


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
    centre = given.mean(axis=0)
    w, aim = ((x - x.mean(axis=0)) @ [1, 1j] for x in (uv, given))
    w = w * np.exp(1j * np.angle(np.vdot(w, aim)))
    w = w * np.sqrt(signed_areas(given, triangles).sum() / signed_areas(uv, triangles).sum())
    return np.column_stack([w.real, w.imag]) + centre


def _small(chart: Chart) -> bool:
    return len(chart.triangles) <= SMALL and not len(chart.patches)


def _together(charts: list[Chart], targets: list[dict], quality: str, balance: float) -> Steps[list[ChartMap | None]]:
    """Maps with free boundaries of small charts, solved together if they are many; None where one has to go alone.

    targets : density and region of each, or nothing, see `chart_target`
    """
    found: list[ChartMap | None] = [None] * len(charts)
    if len(charts) < MANY:
        return found
    sizes = np.cumsum([len(c.triangles) for c in charts])
    for batch in np.split(np.arange(len(charts)), np.flatnonzero(np.diff(sizes // BATCH)) + 1):
        members = [charts[k] for k in batch]
        begin = time.perf_counter()
        done = float(sizes[batch[0]] / sizes[-1])
        try:
            boxes = [_in_unit_box(c.vertices) for c in members]
            meshes = [(v, c.triangles) for (v, _), c in zip(boxes, members, strict=True)]
            maps = yield from part_of(
                solve_many(meshes, quality, balance, **_side_by_side([targets[k] for k in batch])),
                done,
                float(sizes[batch[-1]] / sizes[-1]) - done,
            )
        except MeshError:
            continue  # one of them is to blame, and will say so alone
        seconds = (time.perf_counter() - begin) / len(members)
        pieces = np.split(maps.uv, np.cumsum([len(v) for v, _ in meshes])[:-1])
        for k, (vertices, unit), chart, uv, place in zip(batch, boxes, members, pieces, range(len(batch)), strict=True):
            if maps.solved[place]:
                uv = _in_place(uv, vertices, chart.triangles, targets[k].get("density"), unit, None)
                found[k] = _of_many(maps, place, uv, seconds)
    return found


def _side_by_side(targets: list[dict]) -> dict:
    """Densities and regions of several charts as those of their union."""
    if not targets[0]:
        return {}
    density = positive_density(np.concatenate([t["density"] for t in targets]))
    regions = [t["region"] for t in targets]
    return {"density": density, "region": None if regions[0] is None else np.concatenate(regions)}


def _of_many(maps: Maps, k: int, uv: np.ndarray, seconds: float) -> ChartMap:
    return ChartMap(
        uv,
        None,
        None,
        None,
        None,
        int(maps.steps[k]),
        float(maps.residual[k]),
        "converged",
        float(maps.area_l1[k]),
        float(maps.area_sd[k]),
        float(maps.angle_mean[k]),
        0,
        (),
        {"refinement": seconds},
        weight=float(maps.weight[k]),
    )


def chart_target(target: Target | None, surface: Surface, chart: Chart) -> dict:
    """Arguments of `unwrap_chart` for the part of a surface's target that a chart has."""
    if target is None:
        return {}
    mine = target.of(triangle_rows(surface, chart))
    return {"density": mine.density, "region": mine.region}


def located_pins(pins: CornerPins | None, chart: Chart) -> ChartPins | None:
    """The pins of a chart; errors have the element indices of the surface."""
    try:
        return chart_pins(pins, chart)
    except MeshError as error:
        raise located(error, chart) from error


def located(error: MeshError, chart: Chart) -> MeshError:
    """The same error with the element indices of the surface instead of the chart's; patches are nobody's fault."""
    patched = np.concatenate([chart.faces, np.full(len(chart.patches), -1)])
    place = {"vertex": chart.vertex_ids, "edge": chart.vertex_ids, "face": patched}.get(error.kind)
    elements = error.elements
    if place is not None:
        elements = place[elements]
        elements = elements[(elements >= 0).reshape(len(elements), -1).all(axis=1)]
    return type(error)(error.cause, error.remedy, error.kind, elements)


def unwrap_chart(
    chart: Chart,
    *,
    boundary: str = "free",
    quality: str = "standard",
    balance: float = 0.0,
    density: np.ndarray | None = None,
    region: np.ndarray | None = None,
    pins: ChartPins | None = None,
) -> Steps[ChartMap]:
    """Area-preserving map of one chart: conformal map, transport, authalic refinement.

    Parameters
    ----------
    boundary, quality, balance : see `unwrap`
    density : (m,) > 0 multiplies the area that each triangle asks for; 1 by default. The map has the area asked for
    region : (m,) in [0, 1], weights of a region whose share of the map is to be exact
    pins : two or more fix place, direction and scale; one fixes the place, and the chart stays as large as it is

    Raises
    ------
    PinError : pins that force a fold, or that a disk or a square cannot keep
    PrecisionError, TransportError, FoldedUVError : where even the fallbacks fail
    DensityError : a density that is not positive and finite
    """
    if boundary not in BOUNDARIES:
        raise ValueError(f"boundary must be one of {', '.join(BOUNDARIES)}, not {boundary!r}")
    refuse_outline(pins, boundary)
    log = Log()
    vertices, unit = _in_unit_box(chart.vertices)
    # Patches over holes are mapped with the rest, and forgotten afterwards.
    triangles = chart.disk
    density, region = _with_patches(density, region, len(chart.patches))
    loop = boundary_loops(triangles)[0]
    if boundary == "square" and len(loop) < 4:
        log.warnings.append("A chart with only three boundary vertices does not fill a square; its boundary is free")
        boundary = "free"
    domain: Domain = Rectangle() if boundary == "square" else Disk()
    corners = sharpest_corners(vertices, triangles, loop) if boundary == "square" else None
    area = face_areas(vertices, triangles)
    wanted = None if density is None else area * density
    asked_for = area if wanted is None else wanted
    way = _first_map(vertices, triangles, asked_for, loop, corners, domain, boundary, balance, log)
    first = yield from part_of(way, *FIRST)
    with log.timed("refinement"):
        uv, held = facing(first.uv, pins)
        options = {"target": wanted, "region": region, "balance": balance, "quality": quality, "pins": held}
        options["near"] = first.near and held is None
        refined = yield from part_of(_refined(vertices, triangles, uv, boundary, log, options), *REFINEMENT)
    with log.timed("measure"):
        asked = None if density is None else density[: len(chart.triangles)]
        figures = measure(vertices, chart.triangles, refined.uv[chart.triangles], overlap=False, density=asked)
    if figures.folds:
        log.warnings.append(f"{figures.folds} faces are folded or without area in the map")
    free = boundary == "free"
    return ChartMap(
        refined.uv if held else _in_place(refined.uv, vertices, chart.triangles, asked, unit, pins, free),
        first.conformal.iterations if first.conformal else None,
        first.conformal.residual if first.conformal else None,
        first.cells.iterations if first.cells else None,
        first.cells.residual if first.cells else None,
        refined.iterations,
        refined.residual,
        refined.status,
        figures.area_l1,
        figures.area_sd,
        figures.angle_mean,
        figures.folds,
        tuple(log.warnings) + refined.warnings,
        log.seconds,
        pins is not None,
        refined.weight,
    )


def _first_map(
    vertices, triangles, target, loop, corners, domain: Domain, boundary: str, balance: float, log: Log
) -> Steps[FirstMap]:
    """Where the refinement starts; a flat chart with a free boundary is unrolled, large ones come by way of coarser."""
    if boundary == "free":
        flat = unroll(vertices, triangles, loop)
        if flat is not None:
            return FirstMap(None, None, flat)
    if len(vertices) > COARSE_ABOVE:
        try:
            found = yield from coarse_first_map(vertices, triangles, target, loop, corners, boundary, balance, log)
            if found is not None:
                return found
        except MeshError as error:
            log.warnings.append(f"{error.cause}; refined without a coarser mesh")
    return (yield from first_map(vertices, triangles, target, loop, corners, domain, log))


def _refined(vertices, triangles, uv: np.ndarray, boundary: str, log: Log, options: dict) -> Steps[Refinement]:
    """The refined map, with a free boundary where the domain asked for leaves faces folded."""
    try:
        return (yield from refine(vertices, triangles, uv, boundary=boundary, **options))
    except FoldedUVError as error:
        if boundary == "free":
            raise
        log.warnings.append(f"The {boundary} has no room for this chart ({error.cause}); its boundary is free instead")
    loop = boundary_loops(triangles)[0]
    uv = mean_value_sites(vertices, triangles, loop, None, Disk())
    return (yield from refine(vertices, triangles, uv, boundary="free", **{**options, "near": False}))


def _with_patches(density, region, patches: int) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Density and region of all triangles of a chart's disk, those of the patches over holes included."""
    return (
        None if density is None else np.concatenate([positive_density(density), np.ones(patches)]),
        None if region is None else np.concatenate([region, np.zeros(patches)]),
    )


def _in_place(
    uv: np.ndarray, vertices, triangles, density, unit: float, pins: ChartPins | None, centred: bool = True
) -> np.ndarray:
    """A map uv (n,2) of a chart in a unit box, as large as its target really is, or where its one or two pins are.

    centred : with its centroid at 0, if it has no pins
    """
    # A polygon inscribed in the disk is smaller than the disk: one texel density needs its own area.
    covered = signed_areas(uv, triangles).sum()
    area = face_areas(vertices, triangles)
    uv = uv * np.sqrt((area.sum() if density is None else area @ density) / covered)
    if pins is not None:
        return anchored(uv, triangles, pins)
    return (_about_zero(uv, triangles) if centred else uv) * unit


def _about_zero(uv: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A map (n,2) with its centroid moved to 0."""
    area = signed_areas(uv, triangles)
    return uv - area @ uv[triangles].mean(axis=1) / area.sum()


def _in_unit_box(positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Positions (n,3) moved to 0 and divided by their extent, so that no unit over- or underflows; the extent."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    extent = 2 * float((high / 2 - low / 2).max())
    return (positions - (low / 2 + high / 2)) / extent, extent
