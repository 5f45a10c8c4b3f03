"""The pipeline: polygon mesh -> charts -> conformal map -> transport -> refinement -> texture coordinates.

Each stage may be replaced by a milder one where its mathematics leaves double precision; the result says so.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from .chart_pins import ChartPins, CornerPins, anchored, chart_pins, clear_of_pins, facing, refuse_outline
from .charts import Chart, Surface, triangle_rows
from .conformal import conformal_disk, conformal_rectangle, sharpest_corners
from .distortion import measure
from .domain import Disk, Domain, Rectangle
from .elliptic import centre_in_disk
from .embedding import arc_length_parameters, tutte
from .errors import FoldedUVError, MeshError, PrecisionError, TransportError
from .geometry import face_areas, halfedge_lengths, signed_areas, vertex_areas
from .measure import Target
from .preparation import prepare
from .progress import Progress, Steps, part_of
from .refine import BOUNDARIES, Refinement, refine
from .topology import boundary_loops
from .transport import Transport, transport

# Where the time of a chart goes, roughly, as start and width: a bar that moves evenly needs no more.
CONFORMAL, TRANSPORT, REFINEMENT = (0.0, 0.15), (0.15, 0.25), (0.4, 0.6)
# Sites closer than this share of the domain are lost when they are lifted to the paraboloid, where their
# distance counts squared.
SITE_RESOLUTION = 1e-7
# A mean this near to the middle of the unit disk is there.
CENTRED = 1e-3


@dataclass(frozen=True)
class ChartMap:
    """Texture coordinates of one chart.

    uv (n,2) in the units of the surface: the UV area is the area of the chart, its centroid is 0. A chart with pins
    (pinned) is where its pins are instead, at a scale that follows from them.
    newton_conformal, newton_transport : Newton steps; None where a stage was replaced
    residual_conformal : largest error of an angle sum, radians; residual_transport : |cell area - mass| / mass
    newton_refinement, residual_refinement, status : see `refine.Refinement`
    warnings : what was replaced and why; seconds : wall-clock time per stage
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
    maps = []
    total = sum(len(c.triangles) for c in charts)
    done = 0.0
    for chart, fixed in zip(charts, held, strict=True):
        share = len(chart.triangles) / total
        options: dict = {"boundary": boundary, "quality": quality, "balance": balance, "pins": fixed}
        steps = unwrap_chart(chart, **options, **chart_target(target, surface, chart))
        try:
            maps.append((yield from part_of(steps, done, share)))
        except MeshError as error:
            raise located(error, chart) from error
        done += share
    cuts = np.zeros((0, 2), np.int64) if prepared.cuts is None else prepared.cuts.edges
    return SurfaceMap(charts, maps, cuts, prepared.warnings)


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
    log = _Log()
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
    mass = vertex_areas(vertices, triangles, density)
    conformal, cells, uv = yield from _start(vertices, triangles, mass, loop, corners, domain, log)
    wanted = None if density is None else face_areas(vertices, triangles) * density
    with log.timed("refinement"):
        uv, held = facing(uv, pins)
        options = {"target": wanted, "region": region, "balance": balance, "quality": quality, "pins": held}
        steps = _refined(vertices, triangles, uv, boundary, log, options)
        refined = yield from part_of(steps, *REFINEMENT)
    with log.timed("measure"):
        asked = None if density is None else density[: len(chart.triangles)]
        figures = measure(vertices, chart.triangles, refined.uv[chart.triangles], overlap=False, density=asked)
    if figures.folds:
        log.warnings.append(f"{figures.folds} faces are folded or without area in the map")
    return ChartMap(
        refined.uv if held else _in_place(refined.uv, vertices, chart.triangles, asked, unit, pins),
        conformal.iterations if conformal else None,
        conformal.residual if conformal else None,
        cells.iterations if cells else None,
        cells.residual if cells else None,
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
    )


def _start(vertices, triangles, mass, loop, corners, domain: Domain, log: _Log):
    """Where the refinement starts: the conformal map or None, the transport or None, and coordinates (n,2).

    The conformal map moved by the transport; where rounding decides where its points lie, a mean value map so moved.
    """
    conformal, sites, trouble = yield from _conformal_sites(vertices, triangles, corners, log)
    if not trouble:
        sites = _centred(sites, mass, triangles, loop) if corners is None else sites
        cells, trouble = yield from _transport(sites, mass, domain, log)
        if cells is not None:
            return conformal, cells, centroid_map(cells, domain, loop, corners, log.warnings)
    log.warnings.append(f"{trouble}; started from a mean value map instead")
    sites = _mean_value_sites(vertices, triangles, loop, corners, domain)
    cells, trouble = yield from _transport(sites, mass, domain, log)
    if cells is None:
        log.warnings.append(f"{trouble}; refined the embedding without transport")
        return conformal, None, sites
    return conformal, cells, centroid_map(cells, domain, loop, corners, log.warnings)


def _conformal_sites(vertices, triangles, corners, log: _Log):
    """Conformal map, its coordinates (n,2) in the domain, and why they cannot be used or an empty text."""
    with log.timed("conformal"):
        try:
            if corners is None:
                conformal = yield from part_of(conformal_disk(vertices, triangles), *CONFORMAL)
                sites = conformal.uv
            else:
                conformal = yield from part_of(conformal_rectangle(vertices, triangles, corners), *CONFORMAL)
                sites = conformal.uv / [1, conformal.aspect] - 0.5
        except PrecisionError as error:
            return None, None, error.cause
        nearest = halfedge_lengths(sites, triangles).min()
        if nearest < SITE_RESOLUTION:
            trouble = f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport"
            return conformal, None, trouble
        return conformal, sites, ""


def _centred(sites: np.ndarray, mass: np.ndarray, triangles: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Sites (n,2) of the disk moved by a Moebius map so that what has most mass is in the middle, if they stay apart.

    The transport then has less to move, and a magnified region meets the circle on all sides at once.
    """
    if np.linalg.norm(mass @ sites) < CENTRED * mass.sum():
        return sites
    centred = centre_in_disk(sites, mass)
    centred[loop] /= np.linalg.norm(centred[loop], axis=1)[:, None]
    return centred if halfedge_lengths(centred, triangles).min() >= SITE_RESOLUTION else sites


def _transport(sites, mass, domain: Domain, log: _Log):
    """The transport, or None and why there is none."""
    with log.timed("transport"):
        try:
            return (yield from part_of(transport(sites, mass, domain), *TRANSPORT)), ""
        except TransportError as error:
            return None, error.cause


def _refined(vertices, triangles, uv: np.ndarray, boundary: str, log: _Log, options: dict) -> Steps[Refinement]:
    """The refined map, with a free boundary where the domain asked for leaves faces folded."""
    try:
        return (yield from refine(vertices, triangles, uv, boundary=boundary, **options))
    except FoldedUVError as error:
        if boundary == "free":
            raise
        log.warnings.append(f"The {boundary} has no room for this chart ({error.cause}); its boundary is free instead")
    loop = boundary_loops(triangles)[0]
    uv = _mean_value_sites(vertices, triangles, loop, None, Disk())
    return (yield from refine(vertices, triangles, uv, boundary="free", **options))


def _mean_value_sites(vertices, triangles, loop, corners, domain: Domain) -> np.ndarray:
    """A milder embedding (n,2) with the boundary spread by its length (Floater 2003)."""
    if corners is not None:
        # Each side of the square takes the boundary between two corners.
        loop = np.roll(loop, -int(np.flatnonzero(loop == corners[0])[0]))
    share = arc_length_parameters(vertices, loop)
    if corners is not None:
        first = np.append(share[np.isin(loop, corners)], 1.0)
        share = np.interp(share, first, np.arange(5) / 4)
    return tutte(vertices, triangles, loop, domain.map_boundary(share))


def centroid_map(cells: Transport, domain: Domain, loop, corners, warnings: list[str]) -> np.ndarray:
    """The inverse of the transport map, (n,2): every vertex at the centroid of its cell.

    Boundary vertices (b,) move on to the boundary of the domain, in their order, and `corners` (4,), if given,
    into those of the rectangle.
    """
    uv = cells.cells.centroid.copy()
    s = domain.boundary_parameter(uv[loop])
    step = (np.roll(s, -1) - s + domain.period / 2) % domain.period - domain.period / 2
    if not np.isclose(step.sum(), domain.period):
        warnings.append("The transport tangles the boundary; it was spread evenly instead")
        step = np.full(len(loop), domain.period / len(loop))
    # Start behind the largest gap: there nothing can be out of order.
    first = (int(step.argmax()) + 1) % len(loop)
    along = s[first] + np.concatenate([[0.0], np.cumsum(np.roll(step, -first)[:-1])])
    if (np.diff(along) <= 0).any():
        along = np.maximum.accumulate(along)
        spread = along[0] + domain.period * np.arange(len(loop)) / len(loop)
        along = 0.9 * along + 0.1 * spread
    loop = np.roll(loop, -first)
    if corners is not None:
        loop, along = _into_corners(domain, loop, along, corners)
    uv[loop] = domain.boundary_point(along)
    return uv


def _into_corners(domain: Domain, loop, along, corners) -> tuple[np.ndarray, np.ndarray]:
    """Warp boundary parameters in order (b,) piecewise linearly so that the corners come to lie in corners."""
    first = int(np.flatnonzero(loop == corners[0])[0])
    loop, along = np.roll(loop, -first), np.concatenate([along[first:], along[:first] + domain.period])
    place = np.flatnonzero(np.isin(loop, corners))
    ends = np.append(along[place], along[0] + domain.period)
    return loop, np.interp(along, ends, domain.period * np.arange(5) / 4)


def _with_patches(density, region, patches: int) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Density and region of all triangles of a chart's disk, those of the patches over holes included."""
    return (
        None if density is None else np.concatenate([density, np.ones(patches)]),
        None if region is None else np.concatenate([region, np.zeros(patches)]),
    )


def _in_place(uv: np.ndarray, vertices, triangles, density, unit: float, pins: ChartPins | None) -> np.ndarray:
    """A map uv (n,2) of a chart in a unit box, as large as its target really is, or where its one or two pins are."""
    # A polygon inscribed in the disk is smaller than the disk: one texel density needs its own area.
    covered = signed_areas(uv, triangles).sum()
    area = face_areas(vertices, triangles)
    uv = uv * np.sqrt((area.sum() if density is None else area @ density) / covered)
    return uv * unit if pins is None else anchored(uv, triangles, pins)


def _in_unit_box(positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Positions (n,3) moved to 0 and divided by their extent, so that no unit over- or underflows; the extent."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    extent = 2 * float((high / 2 - low / 2).max())
    return (positions - (low / 2 + high / 2)) / extent, extent


class _Log:
    """What happened to one chart: warnings, and seconds per stage."""

    def __init__(self):
        self.warnings: list[str] = []
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - begin
