"""The pipeline: polygon mesh -> charts -> conformal map -> optimal transport -> texture coordinates.

Each stage may be replaced by a milder one where its mathematics leaves double precision; the result says so.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from .charts import Chart, Surface, split
from .conformal import conformal_disk, conformal_rectangle, sharpest_corners
from .distortion import measure
from .domain import Disk, Domain, Rectangle
from .embedding import arc_length_parameters, tutte
from .errors import MeshError, PrecisionError, TransportError
from .geometry import face_areas, halfedge_lengths, signed_areas, vertex_areas
from .progress import Progress, Steps
from .topology import boundary_loops
from .transport import Transport, transport

BOUNDARIES = ("disk", "square")
# Sites closer than this share of the domain are lost when they are lifted to the paraboloid, where their
# distance counts squared.
SITE_RESOLUTION = 1e-7


@dataclass(frozen=True)
class ChartMap:
    """Texture coordinates of one chart.

    uv (n,2) in the units of the surface: the UV area is the area of the chart, its centroid is 0.
    newton_conformal, newton_transport : Newton steps; None where a stage was replaced
    residual_conformal : largest error of an angle sum, radians; residual_transport : |cell area - mass| / mass
    warnings : what was replaced and why; seconds : wall-clock time per stage
    """

    uv: np.ndarray
    newton_conformal: int | None
    residual_conformal: float | None
    newton_transport: int
    residual_transport: float
    area_l1: float
    area_sd: float
    angle_mean: float
    folds: int
    warnings: tuple[str, ...]
    seconds: dict[str, float]

    def report(self, chart: Chart) -> dict:
        """Everything but the coordinates, for a JSON file."""
        figures = {k: v for k, v in vars(self).items() if k != "uv"}
        size = {"vertices": len(chart.vertices), "faces": len(np.unique(chart.faces)), "triangles": len(chart.triangles)}
        return {**size, **figures, "warnings": list(self.warnings)}


@dataclass(frozen=True)
class SurfaceMap:
    """All charts of a surface and their maps, in one texel density."""

    charts: list[Chart]
    maps: list[ChartMap]

    def corner_uv(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of the surface (k,) that were mapped, each once, and their coordinates (k,2), charts unpacked."""
        corners = np.concatenate([c.corners.ravel() for c in self.charts])
        uv = np.concatenate([m.uv[c.triangles.ravel()] for c, m in zip(self.charts, self.maps, strict=True)])
        corners, first = np.unique(corners, return_index=True)
        return corners, uv[first]

    def report(self) -> list[dict]:
        """One dictionary per chart, for a JSON file."""
        return [m.report(c) for c, m in zip(self.charts, self.maps, strict=True)]


def unwrap(surface: Surface, faces: np.ndarray | None = None, *, boundary: str = "disk") -> Steps[SurfaceMap]:
    """Area-preserving texture coordinates of the polygons `faces` (f,) bool, all by default.

    Parameters
    ----------
    boundary : "disk" or "square", the domain every chart is mapped to

    Raises
    ------
    MeshError : see `charts.split` and `unwrap_chart`; element indices are those of the surface
    """
    yield Progress("Charts", 0.0)
    charts = split(surface, faces)
    maps = []
    total = sum(len(c.triangles) for c in charts)
    done = 0
    for chart in charts:
        share = len(chart.triangles) / total
        steps = unwrap_chart(chart, boundary=boundary)
        try:
            maps.append((yield from _within(steps, done, share)))
        except MeshError as error:
            raise located(error, chart) from error
        done += share
    return SurfaceMap(charts, maps)


def located(error: MeshError, chart: Chart) -> MeshError:
    """The same error with the element indices of the surface instead of the chart's."""
    place = {"vertex": chart.vertex_ids, "edge": chart.vertex_ids, "face": chart.faces}.get(error.kind)
    elements = error.elements if place is None else place[error.elements]
    return type(error)(error.cause, error.remedy, error.kind, elements)


# Where the time of a chart goes, roughly: a bar that moves evenly needs no more.
_STAGES = {"Conformal map": (0.0, 0.4), "Optimal transport": (0.4, 0.6)}


def _within(steps: Steps[ChartMap], done: float, share: float) -> Steps[ChartMap]:
    """Pass on progress of one chart as progress of all charts."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        start, width = _STAGES.get(progress.stage, (0.0, 1.0))
        yield Progress(progress.stage, min(done + share * (start + width * progress.fraction), 1.0))


def unwrap_chart(chart: Chart, *, boundary: str = "disk", density: np.ndarray | None = None) -> Steps[ChartMap]:
    """Area-preserving map of one chart: conformal map, transport, centroids of the cells.

    density (m,) > 0 multiplies the area that each triangle asks for; 1 by default.

    Raises
    ------
    PrecisionError, TransportError : where even the fallback embedding fails
    """
    if boundary not in BOUNDARIES:
        raise ValueError(f"boundary must be one of {', '.join(BOUNDARIES)}, not {boundary!r}")
    domain: Domain = Disk() if boundary == "disk" else Rectangle()
    clock: dict[str, float] = {}
    warnings: list[str] = []
    vertices, unit = _in_unit_box(chart.vertices)
    triangles = chart.triangles
    loop = boundary_loops(triangles)[0]
    mass = vertex_areas(vertices, triangles, density)
    solver = conformal_disk if boundary == "disk" else conformal_rectangle
    conformal, cells = None, None
    with _timed(clock, "conformal"):
        try:
            conformal = yield from solver(vertices, triangles)
        except PrecisionError as error:
            warnings.append(f"{error.cause}; started from a mean value map instead")
    if conformal is not None:
        sites = _sites(conformal.uv, boundary, conformal.aspect)
        nearest = halfedge_lengths(sites, triangles).min()
        if nearest < SITE_RESOLUTION:
            warnings.append(
                f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport; "
                "started from a mean value map instead"
            )
        else:
            with _timed(clock, "transport"):
                try:
                    cells = yield from transport(sites, mass, domain)
                except TransportError as error:
                    warnings.append(f"{error.cause} from the conformal map; started from a mean value map instead")
    if cells is None:
        with _timed(clock, "embedding"):
            sites = _mean_value_sites(vertices, triangles, loop, boundary, domain)
        with _timed(clock, "transport"):
            cells = yield from transport(sites, mass, domain)
    with _timed(clock, "measure"):
        uv = centroid_map(cells, domain, loop, warnings)
        covered = np.abs(signed_areas(uv, triangles)).sum()
        uv *= np.sqrt(face_areas(vertices, triangles).sum() / covered)
        figures = measure(vertices, triangles, uv[triangles], overlap=False)
    return ChartMap(
        uv * unit,
        conformal.iterations if conformal else None,
        conformal.residual if conformal else None,
        cells.iterations,
        cells.residual,
        figures.area_l1,
        figures.area_sd,
        figures.angle_mean,
        figures.folds,
        tuple(warnings),
        clock,
    )


def centroid_map(cells: Transport, domain: Domain, loop: np.ndarray, warnings: list[str]) -> np.ndarray:
    """The inverse of the transport map, (n,2): every vertex at the centroid of its cell.

    Boundary vertices (b,) move on to the boundary of the domain; where that would change their order, they
    are pushed on so that they keep it.
    """
    uv = cells.cells.centroid.copy()
    s = domain.boundary_parameter(uv[loop])
    step = (np.roll(s, -1) - s + domain.period / 2) % domain.period - domain.period / 2
    if not np.isclose(step.sum(), domain.period):
        warnings.append("The transport tangles the boundary; boundary vertices stay in their cells")
        return uv
    # Start behind the largest gap: there nothing can be out of order.
    first = (int(step.argmax()) + 1) % len(loop)
    along = s[first] + np.concatenate([[0.0], np.cumsum(np.roll(step, -first)[:-1])])
    backwards = np.diff(along) <= 0
    if backwards.any():
        warnings.append(f"The transport changed the order of {backwards.sum()} boundary vertices; it was restored")
        along = np.maximum.accumulate(along)
        spread = along[0] + domain.period * np.arange(len(loop)) / len(loop)
        along = 0.9 * along + 0.1 * spread
    uv[np.roll(loop, -first)] = domain.boundary_point(along % domain.period)
    return uv


def _in_unit_box(positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Positions (n,3) moved to 0 and divided by their extent, so that no unit over- or underflows; the extent."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    extent = 2 * float((high / 2 - low / 2).max())
    return (positions - (low / 2 + high / 2)) / extent, extent


def _sites(uv: np.ndarray, boundary: str, aspect: float) -> np.ndarray:
    """Conformal image in the domain; a rectangle is squeezed to the square."""
    return uv if boundary == "disk" else uv / [1, aspect] - 0.5


def _mean_value_sites(vertices, triangles, loop, boundary: str, domain: Domain) -> np.ndarray:
    """A milder embedding (n,2) with the boundary spread by its length (Floater 2003)."""
    if boundary == "square" and len(loop) > 3:
        # Each side of the square takes the boundary between two corners.
        corners = sharpest_corners(vertices, triangles, loop)
        loop = np.roll(loop, -int(np.flatnonzero(loop == corners[0])[0]))
        first = np.append(np.flatnonzero(np.isin(loop, corners)), len(loop))
        start = arc_length_parameters(vertices, loop)
        share = np.interp(start, np.append(start, 1.0)[first], np.arange(5) / 4)
    else:
        share = arc_length_parameters(vertices, loop)
    return tutte(vertices, triangles, loop, domain.map_boundary(share))


@contextmanager
def _timed(clock: dict[str, float], stage: str) -> Iterator[None]:
    begin = time.perf_counter()
    try:
        yield
    finally:
        clock[stage] = clock.get(stage, 0.0) + time.perf_counter() - begin
