"""UV islands of several surfaces, improved where they lie; the one path of the operator and of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..settings import RefineSettings
from ..solver.editing.refine_island import improve
from ..solver.editing.uv_islands import Island, uv_islands
from ..solver.errors import EmptyMeshError, FoldedUVError, MeshError, PinError
from ..solver.maps.distortion import distortion
from ..solver.maps.overlap import overlap_share
from ..solver.mesh.charts import Chart, Surface
from ..solver.mesh.geometry import face_areas, signed_areas
from ..solver.mesh.topology import boundary_edges
from ..solver.parameterization.chart_indices import located, located_pins
from ..solver.parameterization.chart_pins import ChartPins, CornerPins
from ..solver.progress import Progress, Steps, part_of
from ..solver.refinement.refine import Refinement
from .unwrap import Packer, Refusal, pack_islands

# More overlap than this, as a share of the UV area, is said.
OVERLAP = 1e-4
FIGURES = ("area_l1", "area_sd", "angle_mean", "folds")


@dataclass(frozen=True)
class Refined:
    """Corners (k,) to write and their UVs (k,2), and the report of every island, of each surface; warnings.

    `warnings` are pairs of surface index and text; -1 stands for all surfaces.
    """

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    reports: list[list[dict]]
    warnings: list[tuple[int, str]]


@dataclass(frozen=True)
class _Piece:
    """An island of surface `owner` and what became of it; held: pins fix its scale; pins: it is not packed."""

    owner: int
    island: Island
    pins: ChartPins | None
    held: bool
    refinement: Refinement

    @property
    def areas(self) -> tuple[float, float]:
        """Area of the surface and of the UVs."""
        chart = self.island.chart
        covered = abs(float(signed_areas(self.refinement.uv, chart.triangles).sum()))
        return float(face_areas(chart.vertices, chart.triangles).sum()), covered


def refine_islands(
    surfaces: Sequence[tuple[Surface, np.ndarray | None, CornerPins | None]],
    settings: RefineSettings,
    spare_packer: Packer | None = None,
) -> Steps[Refined]:
    """Improve the UV islands that contain the given polygons (f,) bool of surfaces with UVs and pins.

    Every island keeps its centroid, direction and mirroring. All get one texel density, at which together they have
    the UV area they had; islands with two or more pins, or with their outline kept, have their own. Nothing is
    packed unless the settings say so, and then only islands without pins.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    packing.PackingError : neither packer can place the islands
    """
    found, warnings = found_islands(surfaces)
    total = sum(len(island.chart.triangles) for _, island, _ in found)
    pieces, done = [], 0
    for owner, island, pins in found:
        share = len(island.chart.triangles)
        steps = _improve(island, pins, settings)
        try:
            held, refinement = yield from part_of(steps, done / total, share / total)
        except MeshError as error:
            raise Refusal(owner, located(_shown(error, island.chart), island.chart)) from error
        pieces.append(_Piece(owner, island, pins, held, refinement))
        warnings += [(owner, text) for text in (*refinement.warnings, *_unfinished(refinement))]
        done += share
    placed = _at_one_density(pieces)
    if settings.pack:
        yield Progress("Packing", 1.0)
        placed, complaints = _packed(pieces, placed, settings, spare_packer)
        warnings += [(-1, text) for text in complaints]
    elif grown := _grown_together(pieces, placed):
        warnings.append((-1, grown))
    corners, uv = _scatter(surfaces, pieces, placed)
    reports: list[list[dict]] = [[] for _ in surfaces]
    for piece, place in zip(pieces, placed, strict=True):
        reports[piece.owner].append(_report(piece, place))
    return Refined(corners, uv, reports, warnings)


def _unfinished(refinement: Refinement) -> tuple[str, ...]:
    """A warning where the refinement used up its steps."""
    return ("The refinement of an island stopped before it was done",) if refinement.status == "steps" else ()


def _grown_together(pieces: Sequence[_Piece], placed: Sequence[np.ndarray]) -> str:
    """A warning if islands that lay apart cover each other now."""
    if len(pieces) == 1:
        return ""
    before, after = (
        overlap_share(np.concatenate([x[p.island.chart.triangles] for p, x in zip(pieces, maps, strict=True)]))
        for maps in ([p.island.uv for p in pieces], placed)
    )
    more = after - before
    return "" if more < OVERLAP else f"Islands grew into each other, by {100 * more:.1f} % of the UV area; pack them"


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
                found.append((index, island, located_pins(pins, island.chart)))
        except MeshError as error:
            raise Refusal(index, error) from error
    return found, warnings


def _improve(island: Island, pins: ChartPins | None, settings: RefineSettings) -> Steps[tuple[bool, Refinement]]:
    """Whether the scale of the island is fixed, and its refinement."""
    chart = island.chart
    vertices = np.zeros(0, np.int64) if pins is None else pins.vertices
    places = np.zeros((0, 2)) if pins is None else pins.places
    if settings.keep_boundary:
        rim = np.setdiff1d(boundary_edges(chart.triangles), vertices)
        vertices, places = np.concatenate([vertices, rim]), np.concatenate([places, island.uv[rim]])
    try:
        refinement = yield from improve(
            chart.vertices,
            chart.triangles,
            island.uv,
            balance=settings.balance,
            quality=settings.quality,
            pins=(vertices, places),
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


def _shown(error: MeshError, chart: Chart) -> MeshError:
    """An error about the island as a whole points to its faces."""
    if isinstance(error, FoldedUVError) and not error.kind:
        return FoldedUVError(error.cause, error.remedy, "face", np.arange(len(chart.faces)))
    return error


def _at_one_density(pieces: Sequence[_Piece]) -> list[np.ndarray]:
    """UVs (n_i,2) of all islands, those that are not held scaled about their centroid, or their pin."""
    sizes = np.array([piece.areas for piece in pieces])
    loose = np.array([not piece.held for piece in pieces])
    placed = []
    for piece, (space, covered) in zip(pieces, sizes, strict=True):
        uv = piece.refinement.uv
        if not piece.held:
            wanted = space * sizes[loose, 1].sum() / sizes[loose, 0].sum()
            centre = _centroid(piece.island.chart, uv) if piece.pins is None else piece.pins.places[0]
            uv = centre + (uv - centre) * np.sqrt(wanted / covered)
        placed.append(uv)
    return placed


def _centroid(chart: Chart, uv: np.ndarray) -> np.ndarray:
    """Mean of the map (n,2) over the surface."""
    area = face_areas(chart.vertices, chart.triangles)
    return (area[:, None] * uv[chart.triangles].mean(axis=1)).sum(axis=0) / area.sum()


def _packed(pieces, placed, settings, spare_packer) -> tuple[list[np.ndarray], list[str]]:
    """The islands without pins packed into the unit square, the others where they are, and warnings."""
    loose = [k for k, piece in enumerate(pieces) if piece.pins is None and not piece.held]
    triangles = [pieces[k].island.chart.triangles for k in loose]
    packed, complaint = pack_islands([placed[k] for k in loose], triangles, settings, spare_packer)
    result = list(placed)
    for k, uv in zip(loose, packed.islands, strict=True):
        result[k] = uv
    return result, [complaint] if complaint else []


def _scatter(surfaces, pieces, placed) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """From island vertices to the corners of each surface; pinned corners are left out, they are where they are."""
    corners, uv = [], []
    for index, (_, _, pins) in enumerate(surfaces):
        mine = [(p.island.chart, place) for p, place in zip(pieces, placed, strict=True) if p.owner == index]
        k = np.concatenate([chart.corners.ravel() for chart, _ in mine])
        values = np.concatenate([place[chart.triangles.ravel()] for chart, place in mine])
        k, first = np.unique(k, return_index=True)
        free = ~pins.pinned[k]
        corners.append(k[free])
        uv.append(values[first][free])
    return corners, uv


def _report(piece: _Piece, uv: np.ndarray) -> dict:
    chart, done = piece.island.chart, piece.refinement
    before, after = (
        distortion(chart.vertices, chart.triangles, x[chart.triangles], overlap=False) for x in (piece.island.uv, uv)
    )
    return {
        "vertices": len(chart.vertices),
        "faces": len(np.unique(chart.faces)),
        "triangles": len(chart.triangles),
        "pins": 0 if piece.pins is None else len(piece.pins.vertices),
        "newton_refinement": done.iterations,
        "residual_refinement": done.residual,
        "status": done.status,
        "before": {name: getattr(before, name) for name in FIGURES},
        **{name: getattr(after, name) for name in FIGURES},
        "overlap": done.overlap,
        "warnings": list(done.warnings),
    }
