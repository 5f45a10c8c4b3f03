"""Magnify painted regions to their share of the texture; the one path of the operator and of the command line.

From the mesh, surfaces are unwrapped with the density as target. From existing UVs, every island is a plane of its own
and magnified inside its own outline.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..settings import MagnifySettings
from ..solver.analysis.density import (
    Target,
    check_factor,
    check_region,
    from_polygons,
    means_of_corners,
    normalised_density,
    region_share,
)
from ..solver.analysis.facing import Z_UP, SceneAxes
from ..solver.analysis.region_density import RegionDensity, target_density
from ..solver.editing.image_warp import warp_image
from ..solver.editing.magnify import OUTLINES, RegionMagnification, magnify_region, placed_like_outside, refuse_folds
from ..solver.editing.uv_islands import Island, Islands, uv_islands
from ..solver.errors import EmptyMeshError, MeshError, WeightError, plural
from ..solver.maps.distortion import distortion
from ..solver.mesh.charts import check_disk, triangle_rows
from ..solver.mesh.geometry import signed_areas
from ..solver.mesh.polygon_areas import polygon_areas
from ..solver.mesh.surface import Surface
from ..solver.parameterization.chart_indices import CornerPins, located
from ..solver.parameterization.chart_map import map_chart
from ..solver.parameterization.options import MapOptions
from ..solver.progress import Steps, part_of
from ..solver.subdivision.modifier import SubdivisionModifier
from .layout import PlacedIsland, Refusal, UnwrapJob, corner_uvs, grown_together
from .subdivision import polygon_uv_areas, subdivided_target
from .unwrap import lay_out

# Shares that miss their target by more than this, relative to it, are said.
MISSED = 5e-3


@dataclass(frozen=True)
class Region:
    """A surface, the polygons (f,) bool to work on, weights of its vertices (n,), or of its polygons (f,) where
    `kind` is "face", UVs and pins if it has any, how it stands, and the modifier on whose surface shares are asked for.

    Regions of existing UVs are magnified in the plane: there is no surface in it.
    """

    surface: Surface
    faces: np.ndarray
    weights: np.ndarray
    pins: CornerPins | None = None
    kind: str = "vertex"
    axes: SceneAxes = Z_UP
    subdivision: SubdivisionModifier | None = None
    was_split: bool = False

    def of_triangles(self, rows: np.ndarray) -> np.ndarray:
        """Weights (k,) of some triangles (k,) of the surface: those of their polygons."""
        surface, weights = self.surface, self.weights
        if self.kind != "face":
            weights = means_of_corners(weights, surface.corner_vertex, surface.face_start)
        return from_polygons(weights, surface.triangle_face[rows])


@dataclass(frozen=True)
class Shares:
    """Shares of the region before, as they shall be and as measured in the result, and the contrast of the densities:
    that of weight 1 over that of weight 0."""

    before: float
    target: float
    after: float
    contrast: float

    def report(self) -> dict[str, float]:
        """Figures for a report."""
        return {"before": self.before, "asked": self.target, "after": self.after, "factor": self.contrast}

    def said(self) -> tuple[tuple[str, str], ...]:
        """What the panel shows."""
        return (
            ("Region before", f"{100 * self.before:.3f} %"),
            ("Region asked", f"{100 * self.target:.3f} %"),
            ("Region now", f"{100 * self.after:.3f} %"),
        )

    def text(self) -> str:
        """One sentence for the user."""
        return (
            f"The region went from {100 * self.before:.4g} % to {100 * self.after:.4g} % of the texture "
            f"({100 * self.target:.4g} % asked)"
        )

    def warnings(self) -> tuple[str, ...]:
        """What is to be said where the region has missed its target."""
        if abs(self.after / self.target - 1) <= MISSED:
            return ()
        return (f"The region has {100 * self.after:.4g} % of the texture instead of {100 * self.target:.4g} %",)


class MeasuredShares(Protocol):
    """Shares of one or several regions, for those who tell of them."""

    def report(self) -> dict | list:
        """Figures for a report."""

    def said(self) -> tuple[tuple[str, str], ...]:
        """What the panel shows."""

    def text(self) -> str:
        """One sentence for the user."""


@dataclass(frozen=True)
class Magnified:
    """Corners (k,) to write and their UVs (k,2) and reports, of each surface; shares of the region; warnings.

    `warnings` are pairs of surface index and text; -1 stands for all surfaces.
    """

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    reports: list[list[dict]]
    shares: MeasuredShares
    warnings: list[tuple[int, str]]


def magnify(regions: Sequence[Region], settings: MagnifySettings) -> Steps[Magnified]:
    """Magnify painted regions of surfaces as the settings say.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    MarginError : the margins leave no room
    """
    for index, region in enumerate(regions):
        try:
            check_weights(region)
        except MeshError as error:
            raise Refusal(index, error) from error
    if settings.source == "uv":
        return (yield from _from_uv(regions, settings))
    return (yield from _from_mesh(regions, settings))


def check_weights(region: Region) -> None:
    """Weights that are no weights, by their elements; a region may lie on one of several surfaces alone."""
    wrong = np.flatnonzero(~np.isfinite(region.weights))
    if len(wrong):
        raise WeightError("A weight is not a finite number", kind=region.kind, elements=wrong)
    wrong = np.flatnonzero((region.weights < 0) | (region.weights > 1))
    if len(wrong):
        raise WeightError("A weight is not between 0 and 1", kind=region.kind, elements=wrong)


# ---- from the mesh ------------------------------------------------------------------------------------------


def unwrap_jobs(regions: Sequence[Region], parts, density: np.ndarray, direction: np.ndarray | None) -> list[UnwrapJob]:
    """Jobs to unwrap surfaces by a density (m,) of the triangles `parts` of them all, and which way (m,) there is more
    of it, if there is any."""
    jobs, start = [], 0
    for region, (rows, area, _) in zip(regions, parts, strict=True):
        full, inside = np.ones(len(region.surface.triangles)), np.zeros(len(region.surface.triangles))
        mine = slice(start, start + len(area))
        start += len(area)
        full[rows] = density[mine]
        if direction is not None:
            inside[rows] = direction[mine]
        jobs.append(
            UnwrapJob(
                region.surface,
                region.faces,
                region.pins if region.pins is not None and region.pins.pinned.any() else None,
                target=Target(full, None if direction is None else inside),
                subdivision=region.subdivision,
                axes=region.axes,
                was_split=region.was_split,
            )
        )
    return jobs


def _from_mesh(regions, settings: MagnifySettings) -> Steps[Magnified]:
    """Unwrap with the density as target; the share is that of all surfaces together."""
    parts = [region_triangles(region) for region in regions]
    area = np.concatenate([a for _, a, _ in parts])
    weights = np.concatenate([w for *_, w in parts])
    try:
        found = target_density(weights, area, whole_factor(settings), settings.exact)
    except MeshError as error:
        raise Refusal(0, error) from error
    density = normalised_density(found.density, area)
    jobs = unwrap_jobs(regions, parts, density, weights)
    if settings.boundary == "own":
        settings = replace(settings, boundary="free")
    layout = yield from lay_out(jobs, settings)
    after = [uv_areas(*x) for x in zip(regions, parts, layout.corners, layout.uv, strict=True)]
    shares = Shares(
        before=found.share_before,
        target=found.target_share,
        after=region_share(weights, np.concatenate(after)),
        contrast=found.contrast,
    )
    reports = [m.report() for m in layout.maps]
    warnings = [*layout.warnings, *((-1, text) for text in (*found.warnings, *shares.warnings()))]
    return Magnified(corners=layout.corners, uv=layout.uv, reports=reports, shares=shares, warnings=warnings)


def whole_factor(settings: MagnifySettings) -> float:
    """The factor of all magnifications in a row, infinite where it is too large. Raises ShareError for no factor."""
    check_factor(settings.factor)
    with np.errstate(over="ignore"):
        return float(np.float64(settings.factor) ** settings.cascade)


def region_triangles(region: Region) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles to work on (k,), their areas in space (k,) and weights (k,)."""
    surface = region.surface
    rows = np.flatnonzero(region.faces[surface.triangle_face])
    vertices = surface.corner_vertex[surface.triangles[rows]]
    area = polygon_areas(surface.positions, vertices, surface.triangle_face[rows])
    if region.subdivision is not None:
        area = area * subdivided_target(surface, region.subdivision).density[rows]
    return rows, np.where(np.isfinite(area), area, 0.0), region.of_triangles(rows)


def uv_areas(region: Region, part, corners: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """UV areas of the triangles worked on (k,), 0 for those that were left out."""
    full = np.zeros((len(region.surface.corner_vertex), 2))
    full[corners] = uv
    rows = part[0]
    if region.subdivision is None:
        return np.abs(signed_areas(full, region.surface.triangles[rows]))
    # Triangles of a polygon have the same weight.
    owner = region.surface.triangle_face
    whole = polygon_uv_areas(region.surface, full, region.subdivision)
    # The last polygons may have no triangle.
    whole = whole / np.maximum(np.bincount(owner, minlength=len(whole)), 1)
    return np.where(np.isin(region.surface.triangles[rows, 0], corners), whole[owner[rows]], 0.0)


# ---- from existing UVs --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _MagnifiedIsland:
    """An island of surface `owner`, its region (m,), UV area (m,) and target density, and what became of it."""

    owner: int
    island: Island
    region: np.ndarray
    area: np.ndarray
    found: RegionDensity
    uv: np.ndarray
    outline: str
    iterations: int


def _from_uv(regions, settings: MagnifySettings) -> Steps[Magnified]:
    """Magnify inside every island that the region touches; the others stay to the bit."""
    islands, warnings = _islands(regions)
    total = sum(len(island.chart.triangles) for _, island in islands)
    magnified: list[_MagnifiedIsland] = []
    done = 0
    for owner, island in islands:
        size = len(island.chart.triangles)
        weights = _weights_of(regions[owner], island)
        try:
            result, texts = yield from part_of(_magnified(owner, island, weights, settings), done / total, size / total)
        except MeshError as error:
            raise Refusal(owner, located(error, island.chart)) from error
        magnified.append(result)
        warnings += [(owner, text) for text in texts]
        done += size
    placed = [PlacedIsland(owner=p.owner, chart=p.island.chart, uv=p.uv, before=p.island.uv) for p in magnified]
    # Inside outlines that stay nothing grows.
    if any(p.outline not in ("circle", "sides") for p in magnified) and (warning := grown_together(placed)):
        warnings.append((-1, warning))
    corners, uv = corner_uvs(len(regions), placed)
    reports = [[_report(p) for p in magnified if p.owner == index] for index in range(len(regions))]
    shares = _overall(magnified)
    warnings += ((-1, text) for text in shares.warnings())
    return Magnified(corners=corners, uv=uv, reports=reports, shares=shares, warnings=warnings)


def islands_of(index: int, region: Region) -> Islands:
    """The islands of surface number `index`; Refusal where it has no UVs, or such as make none."""
    try:
        if region.pins is None:
            raise EmptyMeshError("There are no UVs to magnify", remedy="Unwrap the mesh first")
        return uv_islands(region.surface, region.pins.uv, region.faces)
    except MeshError as error:
        raise Refusal(index, error) from error


def _islands(regions) -> tuple[list[tuple[int, Island]], list[tuple[int, str]]]:
    """Islands with a part of the region and a rest, and warnings."""
    found, warnings, constant = [], [], 0
    for index, region in enumerate(regions):
        islands = islands_of(index, region)
        warnings += [(index, text) for text in islands.warnings]
        for island in islands.islands:
            weights = _weights_of(region, island)
            if np.ptp(weights) > 0:
                found.append((index, island))
            elif weights[0] > 0:
                constant += 1
    if not found:
        try:
            check_region(np.concatenate([r.weights for r in regions]), regions[0].kind)
            raise WeightError("No island has both a part of the region and a rest", "Paint a part of an island")
        except MeshError as error:
            raise Refusal(0, error) from error
    if constant:
        text = plural(constant, "An island is painted all over, and stays", "{} islands are painted all over, and stay")
        warnings.append((-1, f"{text} as before"))
    return found, warnings


def _weights_of(region: Region, island: Island) -> np.ndarray:
    """Weights (m,) of an island's triangles."""
    return region.of_triangles(triangle_rows(region.surface, island.chart))


def _magnified(
    owner: int, island: Island, weights, settings: MagnifySettings
) -> Steps[tuple[_MagnifiedIsland, tuple[str, ...]]]:
    """An island after its magnification, and warnings."""
    if settings.boundary in OUTLINES:
        done = yield from magnify_region(
            island.uv,
            island.chart.triangles,
            weights,
            whole_factor(settings),
            exact=settings.exact,
            boundary=settings.boundary,
            quality=settings.quality,
            polygons=island.chart.faces,
        )
    else:
        done = yield from _into_shape(island, weights, settings)
    result = _MagnifiedIsland(
        owner=owner,
        island=island,
        region=weights,
        area=np.abs(signed_areas(island.uv, island.chart.triangles)),
        found=done.target,
        uv=done.uv,
        outline=done.outline,
        iterations=done.iterations,
    )
    return result, done.warnings


def _into_shape(island: Island, weights: np.ndarray, settings: MagnifySettings) -> Steps[RegionMagnification]:
    """An island in a disk or a square: the plane is unwrapped like any other surface."""
    uv, triangles = island.uv, island.chart.triangles
    refuse_folds(uv, triangles)
    area = np.abs(signed_areas(uv, triangles))
    found = target_density(weights, area, whole_factor(settings), settings.exact)
    check_disk(island.chart)
    mirror = np.array([np.sign(signed_areas(uv, triangles).sum()), 1.0])
    flat = replace(island.chart, vertices=np.column_stack([uv * mirror, np.zeros(len(uv))]))
    density = normalised_density(found.density, area)
    options = MapOptions(boundary=settings.boundary, quality=settings.quality)
    done = yield from map_chart(flat, options=options, target=Target(density, weights))
    square = settings.boundary == "square"
    placed = placed_like_outside(done.uv, uv * mirror, triangles, 1 - weights, quarters=square) * mirror
    return RegionMagnification(
        uv=placed,
        outline=settings.boundary,
        iterations=done.newton_refinement,
        residual=0.0,
        status=done.status,
        area_error=done.area_l1,
        warnings=(*found.warnings, *done.warnings),
        target=found,
    )


def _overall(magnified: Sequence[_MagnifiedIsland]) -> Shares:
    """Shares of the region in all islands that it touches, and the mean of their contrasts, by their UV area."""
    size = np.array([island.area.sum() for island in magnified])
    size = size / size.sum()
    before = size @ [region_share(p.region, p.area) for p in magnified]
    target = size @ [p.found.target_share for p in magnified]
    after = size @ [region_share(p.region, np.abs(signed_areas(p.uv, p.island.chart.triangles))) for p in magnified]
    contrast = size @ [p.found.contrast for p in magnified]
    return Shares(before=float(before), target=float(target), after=float(after), contrast=float(contrast))


def _report(done: _MagnifiedIsland) -> dict:
    """Figures of an island for a report."""
    chart = done.island.chart
    flat = np.column_stack([done.island.uv, np.zeros(len(done.uv))])
    figures = distortion(
        flat, chart.triangles, done.uv[chart.triangles], density=done.found.density, polygons=chart.faces
    )
    now = np.abs(signed_areas(done.uv, chart.triangles))
    return {
        "vertices": len(chart.vertices),
        "triangles": len(chart.triangles),
        "outline": done.outline,
        "newton_refinement": done.iterations,
        "share_before": region_share(done.region, done.area),
        "share_asked": done.found.target_share,
        "share_after": region_share(done.region, now),
        "area_l1": figures.area_l1,
        "angle_mean": figures.angle_mean,
        "folds": figures.folds,
        "overlap": figures.overlap,
        "warnings": list(done.found.warnings),
    }


def warped_picture(
    picture: np.ndarray, regions: Sequence[Region], result: Magnified, margin: float, straight: bool = False
) -> np.ndarray:
    """Warp a picture (h,w,c) of the UVs there were to those that the result has, islands continued by the margin.

    straight : see `solver.editing.image_warp.warp_image`
    """
    return warp_image(picture, *layouts(regions, result), int(margin), straight)


def layouts(regions: Sequence[Region], result: Magnified) -> tuple[np.ndarray, np.ndarray]:
    """The triangles (m,3,2) that moved, in the UVs there were and in those that the result has."""
    old, new = [], []
    for region, corners, uv in zip(regions, result.corners, result.uv, strict=True):
        before = np.asarray(region.pins.uv, float) if region.pins is not None else np.zeros((0, 2))
        after = before.copy()
        after[corners] = uv
        moved = np.isin(region.surface.triangles[:, 0], corners)
        triangles = region.surface.triangles[moved]
        old.append(before[triangles])
        new.append(after[triangles])
    return np.concatenate(old), np.concatenate(new)
