"""Several surfaces to one packed layout; the one path of the operator and of the command line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..errors import UserError
from ..settings import Settings
from ..solver.analysis.density import Target
from ..solver.errors import MeshError
from ..solver.mesh.charts import Chart, Surface
from ..solver.mesh.topology import twins
from ..solver.parameterization.chart_indices import chart_target, located, located_pins
from ..solver.parameterization.chart_map import ChartMap, unwrap_chart
from ..solver.parameterization.chart_pins import CornerPins, chart_pins, clear_of_pins
from ..solver.parameterization.convex_maps import with_open_corners
from ..solver.parameterization.shear_bound import unwrap_within
from ..solver.parameterization.unwrap import SurfaceMap, unwrap
from ..solver.progress import Progress, Steps, part_of
from ..xatlas import packing
from ..xatlas.segmentation import SegmentationError, chart_seams

Packer = Callable[[Sequence[np.ndarray], Sequence[np.ndarray], float, int], packing.Packing]


class Refusal(UserError):
    """A surface that cannot be unwrapped: its index and the error."""

    def __init__(self, index: int, error: MeshError):
        super().__init__(str(error))
        self.index, self.error = index, error


@dataclass(frozen=True)
class Layout:
    """Corners (k,) and their UVs (k,2) of each surface, the maps with their reports, the packing and warnings.

    `warnings` are pairs of surface index and text; -1 stands for the layout as a whole.
    """

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    maps: list[SurfaceMap]
    packing: packing.Packing
    warnings: list[tuple[int, str]]


@dataclass(frozen=True)
class Job:
    """A surface, the polygons (f,) bool to unwrap, its pins, vertices (n,) in [0,1] to keep free of cuts, and what
    its triangles shall get: their own areas by default. Targets of several surfaces are relative to each other."""

    surface: Surface
    faces: np.ndarray | None = None
    pins: CornerPins | None = None
    avoid: np.ndarray | None = None
    target: Target | None = None


def lay_out(
    jobs: Sequence[Job],
    settings: Settings,
    spare_packer: Packer | None = None,
) -> Steps[Layout]:
    """Unwrap surfaces at one texel density into one unit square.

    Solver results have the area of the surface, or of the target, so packing with a single scale gives every island
    of every surface the same texels per area. `spare_packer` takes over, with a warning, where xatlas cannot. Islands
    with pins are neither scaled nor packed, as in Blender, and the others are packed as if they were not there.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    packing.PackingError : neither packer can place the islands
    """
    maps: list[SurfaceMap] = []
    warnings: list[tuple[int, str]] = []
    for index, job in enumerate(jobs):
        try:
            job, complaint = _with_charts(job) if settings.seams == "charts" else (job, "")
            maps.append((yield from part_of(_mapped(job, settings), index / len(jobs), 1 / len(jobs))))
        except MeshError as error:
            raise Refusal(index, error) from error
        warnings += [(index, text) for text in (complaint, *maps[-1].warnings) if text]
        warnings += [(index, text) for chart_map in maps[-1].maps for text in chart_map.warnings]
    yield Progress("Packing", 1.0)
    charts = [pair for surface_map in maps for pair in zip(surface_map.charts, surface_map.maps, strict=True)]
    free = [(c, m.uv) for c, m in charts if not m.pinned]
    if len(free) < len(charts):
        warnings.append((-1, _in_place(len(charts) - len(free), len(free))))
    islands = [uv for _, uv in free]
    packed, complaint = pack_islands(islands, [_in_one_piece(chart) for chart, _ in free], settings, spare_packer)
    if complaint:
        warnings.append((-1, complaint))
    placed = iter(packed.islands)
    corners, uv = _scatter(maps, [m.uv if m.pinned else next(placed) for _, m in charts])
    return Layout(corners, uv, maps, packed, warnings)


def _with_charts(job: Job) -> tuple[Job, str]:
    """The job with the seams of charts of low distortion added, or as it is and a warning."""
    try:
        more = chart_seams(job.surface, job.faces)
    except SegmentationError as error:
        return job, f"{error}; cut only where it has to be"
    seams = np.concatenate([job.surface.seams, more])
    return replace(job, surface=replace(job.surface, seams=seams)), ""


def _mapped(job: Job, settings: Settings) -> Steps[SurfaceMap]:
    options = settings.preparation_arguments()
    if not settings.max_shear:
        arguments = {**settings.solver_arguments(), **options}
        return (
            yield from unwrap(job.surface, job.faces, pins=job.pins, avoid=job.avoid, target=job.target, **arguments)
        )

    def map_chart(chart: Chart) -> Steps[ChartMap]:
        try:
            arguments = {**settings.solver_arguments(), **chart_target(job.target, job.surface, chart)}
            return (yield from unwrap_chart(chart, pins=chart_pins(job.pins, chart), **arguments))
        except MeshError as error:
            raise located(error, chart) from error

    avoid = clear_of_pins(job.surface, job.pins, job.avoid)
    found = yield from unwrap_within(job.surface, job.faces, map_chart, settings.max_shear, avoid=avoid, **options)
    charts, held = found.prepared.charts, [located_pins(job.pins, c) for c in found.prepared.charts]
    maps = with_open_corners(job.surface, charts, found.maps, held, settings.boundary, settings.quality, job.target)
    cuts = found.slits if found.prepared.cuts is None else np.concatenate([found.prepared.cuts.edges, found.slits])
    (length, shear), first = found.history[-1], found.history[0]
    warnings = list(found.prepared.warnings)
    if not found.reached:
        warnings.append(
            f"The mean shear went from {first[1]:.3g} to {shear:.3g} with {length - first[0]:.3g} more of seam, "
            f"not below {settings.max_shear:.3g}; the least that was found is kept"
        )
    return SurfaceMap(charts, maps, cuts, tuple(warnings))


def _in_one_piece(chart: Chart) -> np.ndarray:
    """Triangles (m,3) to pack a chart by: with those that fill its holes where it falls apart without, or hangs by a
    vertex. The packer would scatter such pieces."""
    if not len(chart.patches):
        return chart.triangles
    twin = twins(chart.triangles)
    inner = np.flatnonzero(twin >= 0)
    m = len(chart.triangles)
    pairs = coo_matrix((np.ones(len(inner)), (inner // 3, twin[inner] // 3)), shape=(m, m))
    return chart.triangles if connected_components(pairs, directed=False)[0] == 1 else chart.disk


def _in_place(pinned: int, others: int) -> str:
    text = "An island with pins stays" if pinned == 1 else f"{pinned} islands with pins stay"
    return f"{text} in place" + ("; the others were packed as if there were none" if others else "")


def pack_islands(
    islands: Sequence[np.ndarray], triangles: Sequence[np.ndarray], settings: Settings, spare_packer: Packer | None
) -> tuple[packing.Packing, str]:
    """Islands (n_i,2) packed as the settings say, and a warning or an empty text; see `packing.pack`."""
    if not islands:
        return packing.Packing([], 0.0, "none", 0.0), ""
    packed, complaint = _packed(islands, triangles, settings, spare_packer)
    return replace(packed, islands=[uv + settings.tile_origin for uv in packed.islands]), complaint


def _packed(islands, triangles, settings: Settings, spare_packer: Packer | None) -> tuple[packing.Packing, str]:
    """Islands in the unit square, and a warning or an empty text."""
    if not settings.pack:
        return packing.stack(islands), ""
    try:
        return packing.pack(islands, triangles, settings.margin, settings.texture_size), ""
    except packing.MarginError:
        raise
    except packing.PackingError as error:
        if spare_packer is None:
            raise
        result = spare_packer(islands, triangles, settings.margin, settings.texture_size)
        return result, f"{error}; packed with {result.packer} instead"


def _scatter(maps: Sequence[SurfaceMap], placed: Sequence[np.ndarray]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """From island vertices to the corners of each surface."""
    island = iter(placed)
    corners, uv = [], []
    for surface_map in maps:
        k = [chart.corners.ravel() for chart in surface_map.charts]
        v = [next(island)[chart.triangles.ravel()] for chart in surface_map.charts]
        unique, first = np.unique(np.concatenate(k), return_index=True)
        corners.append(unique)
        uv.append(np.concatenate(v)[first])
    return corners, uv
