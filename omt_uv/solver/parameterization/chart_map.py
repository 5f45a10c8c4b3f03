"""The map of one chart: conformal map -> transport -> refinement.

Each stage may be replaced by a milder one where its mathematics leaves double precision; the result says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.density import area_error_warnings
from ..conformal.disk_map import sharpest_corners
from ..errors import FoldedUVError, MeshError, positive_density
from ..maps.distortion import distortion
from ..mesh.charts import Chart
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.topology import boundary_loops
from ..progress import RunLog, Steps, part_of
from ..refinement.continuation import QUALITIES
from ..refinement.initial_maps import unroll
from ..refinement.refine import BOUNDARIES, Refinement, RefinementOptions, refine
from ..transport.convex_domain import Disk, Domain, Rectangle
from .chart_pins import ChartPins, anchored, facing, refuse_outline
from .initial_map import COARSE_ABOVE, FirstMap, coarse_first_map, first_map, mean_value_sites

# Where the time of a chart goes, roughly, as start and width: a bar that moves evenly needs no more.
FIRST, REFINEMENT = (0.0, 0.4), (0.4, 0.6)


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
    boundary, quality, balance : see `parameterize.unwrap`
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
    log = RunLog()
    vertices, unit = in_unit_box(chart.vertices)
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
    way = _first_map(vertices, triangles, asked_for, region, loop, corners, domain, boundary, balance, log)
    first = yield from part_of(way, *FIRST)
    with log.timed("refinement"):
        uv, held = facing(first.uv, pins)
        options = RefinementOptions(boundary, balance, quality, first.near and held is None, first.pull)
        target = {"target": wanted, "region": region, "pins": held}
        refined = yield from part_of(_refined(vertices, triangles, uv, options, target, log), *REFINEMENT)
    with log.timed("measure"):
        asked = None if density is None else density[: len(chart.triangles)]
        figures = distortion(vertices, chart.triangles, refined.uv[chart.triangles], overlap=False, density=asked)
    if density is not None and balance == 0:
        log.warnings += area_error_warnings(figures.area_l1, QUALITIES[quality].area_error)
    if figures.folds:
        log.warnings.append(f"{figures.folds} faces are folded or without area in the map")
    free = boundary == "free"
    return ChartMap(
        refined.uv if held else in_place(refined.uv, vertices, chart.triangles, asked, unit, pins, free),
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
        tuple(dict.fromkeys((*log.warnings, *refined.warnings))),
        log.seconds,
        pins is not None,
        refined.area_weight,
    )


def _first_map(
    vertices, triangles, target, region, loop, corners, domain: Domain, boundary: str, balance: float, log: RunLog
) -> Steps[FirstMap]:
    """Where the refinement starts; a flat chart with a free boundary is unrolled, large ones come by way of coarser."""
    if boundary == "free":
        flat = unroll(vertices, triangles, loop)
        if flat is not None:
            return FirstMap(None, None, flat)
    if len(vertices) > COARSE_ABOVE:
        try:
            options = (boundary, balance, log, None, region)
            found = yield from coarse_first_map(vertices, triangles, target, loop, corners, *options)
            if found is not None:
                return found
        except MeshError as error:
            log.warnings.append(f"{error.cause}; refined without a coarser mesh")
    return (yield from first_map(vertices, triangles, target, loop, corners, domain, log))


def _refined(vertices, triangles, uv, options: RefinementOptions, target: dict, log: RunLog) -> Steps[Refinement]:
    """The refined map, with a free boundary where the domain asked for leaves faces folded.

    target: target, region and pins of `refine`
    """
    try:
        return (yield from refine(vertices, triangles, uv, options, **target))
    except FoldedUVError as error:
        domain = options.boundary
        if domain == "free":
            raise
        log.warnings.append(f"The {domain} has no room for this chart ({error.cause}); its boundary is free instead")
    loop = boundary_loops(triangles)[0]
    uv = mean_value_sites(vertices, triangles, loop, None, Disk())
    free = RefinementOptions(balance=options.balance, quality=options.quality)
    return (yield from refine(vertices, triangles, uv, free, **target))


def _with_patches(density, region, patches: int) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Density and region of all triangles of a chart's disk, those of the patches over holes included."""
    return (
        None if density is None else np.concatenate([positive_density(density), np.ones(patches)]),
        None if region is None else np.concatenate([region, np.zeros(patches)]),
    )


def in_place(
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


def in_unit_box(positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Positions (n,3) moved to 0 and divided by their extent, so that no unit over- or underflows; the extent."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    extent = 2 * float((high / 2 - low / 2).max())
    return (positions - (low / 2 + high / 2)) / extent, extent
