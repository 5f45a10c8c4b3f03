"""Figures of regions: of groups, materials, or whatever labels polygons (Zhao et al. 2013, section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ...solver.errors import EmptyMeshError
from ...solver.maps.distortion import face_distortion
from ...solver.mesh.geometry import edge_lengths, signed_areas
from ...solver.mesh.polygon_areas import polygon_areas
from ...solver.mesh.topology import halfedges, pair_keys, paired
from ..distortion import ChosenTriangles, triangles_of
from ..reading import Reading
from ..subdivision import evaluated_polygons


@dataclass(frozen=True)
class RegionFigures:
    """Figures of a region.

    name : of the region; faces : polygons in it; area, perimeter : in space; surface_share, texture_share : of all;
    uv_area, uv_diameter : of its UVs; ratio_mean, ratio_sd : of the area ratio over its surface, UV share over surface
    share, 1 is exact; shear : mean ratio of the singular values; texel_density : pixels per unit of length
    """

    name: str
    faces: int
    area: float
    surface_share: float
    texture_share: float
    perimeter: float
    uv_area: float
    uv_diameter: float
    ratio_mean: float
    ratio_sd: float
    shear: float
    texel_density: float


@dataclass(frozen=True)
class _Measured:
    """Of all triangles: what they are, areas (m,) in space and of UVs, area ratio (m,) and shear (m,)."""

    found: ChosenTriangles
    area: np.ndarray
    uv_area: np.ndarray
    ratio: np.ndarray
    shear: np.ndarray


def figures_by_region(
    readings: Sequence[Reading], regions: Sequence[tuple[str, Sequence[np.ndarray]]], texture_size: float
) -> list[RegionFigures]:
    """Figures of all chosen polygons together, and of each region.

    Of objects with a Subdivision Surface modifier, the subdivided surface and its UVs are measured, and the quads that
    a polygon became belong to its regions.

    regions : pairs of a name and, for every reading, which polygons (f,) bool belong to it; regions may share polygons

    Raises
    ------
    EmptyMeshError : no polygon is chosen, a mesh has no UVs, or a region has no polygon
    """
    fine = [evaluated_polygons(reading) for reading in readings]
    found = triangles_of([reading for reading, _ in fine])
    octaves, shear = face_distortion(found.positions, found.triangles, found.uv, found.polygons)
    flat = found.uv.reshape(-1, 2)
    measured = _Measured(
        found=found,
        area=polygon_areas(found.positions, found.triangles, found.polygons),
        uv_area=np.abs(signed_areas(flat, np.arange(len(flat)).reshape(-1, 3))),
        ratio=2.0**octaves,
        shear=shear,
    )
    rows = [_row("all", measured, np.ones(len(found.triangles), bool), texture_size)]
    for name, masks in regions:
        # Polygons are counted over all readings, as `triangles_of` does.
        parts = zip(masks, fine, strict=True)
        inside = np.concatenate([np.asarray(mask, bool)[polygon] for mask, (_, polygon) in parts])
        if not inside[found.polygons].any():
            raise EmptyMeshError(f"The region {name!r} has no face", remedy="Choose another, or paint it")
        rows.append(_row(name, measured, inside[found.polygons], texture_size))
    return rows


def _row(name: str, measured: _Measured, inside: np.ndarray, texture_size: float) -> RegionFigures:
    """Figures of the triangles (m,) bool that are inside."""
    area, uv_area = measured.area[inside], measured.uv_area[inside]
    weight = area / max(area.sum(), 1e-300)
    ratio = measured.ratio[inside]
    mean = float(weight @ ratio)
    return RegionFigures(
        name=name,
        faces=len(np.unique(measured.found.polygons[inside])),
        area=float(area.sum()),
        surface_share=float(area.sum() / measured.area.sum()),
        texture_share=float(uv_area.sum() / max(measured.uv_area.sum(), 1e-300)),
        perimeter=perimeter(measured.found.positions, measured.found.triangles[inside]),
        uv_area=float(uv_area.sum()),
        uv_diameter=diameter(measured.found.uv[inside].reshape(-1, 2)),
        ratio_mean=mean,
        ratio_sd=float(np.sqrt(weight @ (ratio - mean) ** 2)),
        shear=float(weight @ measured.shear[inside]),
        texel_density=float(texture_size * np.sqrt(uv_area.sum() / max(area.sum(), 1e-300))),
    )


def perimeter(positions: np.ndarray, triangles: np.ndarray) -> float:
    """Length of the edges of triangles (m,3) that have one of them at one side alone, at positions (n,3)."""
    a, b = halfedges(triangles)
    keys, count = np.unique(pair_keys(a, b), return_counts=True)
    outer = keys[count == 1]
    return float(edge_lengths(positions, paired(outer)).sum())


def diameter(points: np.ndarray) -> float:
    """The greatest distance of two of the points (k,2)."""
    points = np.unique(points, axis=0)
    try:
        corners = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        # All on a line, or too few: the ends are among those that are outermost along an axis.
        order = np.lexsort(points.T)
        corners = points[[order[0], order[-1], points[:, 0].argmin(), points[:, 0].argmax()]]
    # A hull has few corners, as a rule; those of a round one are taken some at a time.
    parts = np.array_split(corners, max(len(corners) // 500, 1))
    return float(max(np.linalg.norm(part[:, None] - corners, axis=2).max() for part in parts))


def table_text(rows: Sequence[RegionFigures], separator: str = ",") -> str:
    """Rows as text, with a line of names first; a separator within a name becomes a blank."""
    lines = [[field.name for field in fields(RegionFigures)]]
    lines += [[_cell(value, separator) for value in vars(row).values()] for row in rows]
    return "".join(separator.join(line) + "\n" for line in lines)


def _cell(value: object, separator: str) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value).replace(separator, " ").replace("\n", " ")
