"""Measure the distortion of several readings as one: they share a texture, so one scale holds for all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..solver.errors import EmptyMeshError, MeshError
from ..solver.maps.distortion import NEGLIGIBLE_AREA, Distortion, distortion, face_distortion
from ..solver.maps.embedding import check_layout
from ..solver.mesh.geometry import face_areas
from .reading import Reading
from .subdivision import evaluated

ON_SUBDIVISION = "on the subdivided surface"


@dataclass(frozen=True)
class ChosenTriangles:
    """Positions (n,3), triangles (m,3), their UVs (m,3,2), and the polygon (m,) of each, counted over all readings."""

    positions: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray
    polygons: np.ndarray


def triangles_of(readings: Sequence[Reading]) -> ChosenTriangles:
    """Triangles of the chosen polygons of all readings in turn.

    Raises
    ------
    EmptyMeshError : no polygon is chosen, or a mesh with chosen polygons has no UVs
    """
    positions, triangles, uv, polygons = [], [], [], []
    vertices = faces = 0
    for reading in readings:
        surface = reading.surface
        chosen = reading.faces[surface.triangle_face]
        corners = surface.triangles[chosen]
        if not len(corners):
            continue
        if reading.uv is None:
            raise EmptyMeshError("There are no UVs to measure", remedy="Unwrap the mesh first")
        positions.append(surface.positions)
        triangles.append(surface.corner_vertex[corners] + vertices)
        polygons.append(surface.triangle_face[chosen] + faces)
        uv.append(reading.uv[corners].astype(float))
        vertices += len(surface.positions)
        faces += len(reading.faces)
    if not triangles:
        raise EmptyMeshError("There are no faces to measure")
    return ChosenTriangles(
        positions=np.concatenate(positions),
        triangles=np.concatenate(triangles),
        uv=np.concatenate(uv),
        polygons=np.concatenate(polygons),
    )


def polygon_outlines(readings: Sequence[Reading]) -> np.ndarray:
    """UVs (k,2,2) of both ends of the sides of all chosen polygons that have UVs."""
    sides = [np.zeros((0, 2, 2))]
    for reading in readings:
        if reading.uv is None:
            continue
        starts = np.asarray(reading.surface.face_start)
        following = np.arange(1, starts[-1] + 1)
        following[starts[1:] - 1] = starts[:-1]
        chosen = np.repeat(reading.faces, np.diff(starts))
        sides.append(np.stack([reading.uv, reading.uv[following]], axis=1)[chosen])
    return np.concatenate(sides)


def measure_readings(readings: Sequence[Reading], overlap: bool = True) -> Distortion:
    """Distortion of the active UVs over the chosen polygons of all readings; `overlap` costs most of the time.

    Of objects with a Subdivision Surface modifier, the subdivided surface and its UVs are measured.

    Raises
    ------
    EmptyMeshError : no polygon is chosen, or a mesh with chosen polygons has no UVs
    NonFiniteError, ZeroAreaFaceError : see `solver.maps.distortion.distortion`
    """
    found = triangles_of([evaluated(reading) for reading in readings])
    return distortion(found.positions, found.triangles, found.uv, overlap=overlap, polygons=found.polygons)


def on_subdivision(readings: Sequence[Reading]) -> bool:
    """Whether figures of the readings are those of a subdivided surface."""
    return any(reading.subdivision is not None for reading in readings)


def summary(figures: Distortion, subdivided: bool = False) -> str:
    """One line for a status bar; `subdivided` is said."""
    place = ON_SUBDIVISION[0].upper() + ON_SUBDIVISION[1:] + ": " if subdivided else ""
    return place + (
        f"Area error {100 * figures.area_l1:.2f} % "
        f"(SD {figures.area_sd:.4f}, 99 % within {figures.area_p99:.3f} octaves), "
        f"shear {figures.angle_mean:.3f} (99 % within {figures.angle_p99:.2f}), "
        f"{figures.folds} folded of {figures.faces} faces, overlap {100 * (figures.overlap or 0):.2f} %, "
        f"{figures.charts} islands; area and angle of Dominitz & Tannenbaum: {_number(figures.seed_area)}, "
        f"{_number(figures.seed_angle)}"
    )


def _number(value: float | None) -> str:
    """A figure with three decimals, or none."""
    return "none" if value is None else f"{value:.3f}"


def worst_faces(readings: Sequence[Reading], figure: str, share: float) -> list[np.ndarray]:
    """Polygons (k,) of each reading whose UVs are worst, together at most `share` of the surface, at least one.

    figure : AREA, how far the texture of a polygon is from what is due to it, in octaves; SHEAR; FOLDS, all folded ones

    Raises
    ------
    EmptyMeshError : no polygon is chosen, or a mesh with chosen polygons has no UVs
    NonFiniteError, ZeroAreaFaceError : see `solver.maps.distortion.distortion`
    """
    found = triangles_of(readings)
    area = face_areas(found.positions, found.triangles)
    polygons, first = np.unique(found.polygons, return_index=True)
    if figure == "FOLDS":
        real = area > NEGLIGIBLE_AREA * area.sum()
        chosen = np.unique(found.polygons[real][check_layout(found.triangles[real], found.uv[real], True).folded])
    else:
        octaves, shear = face_distortion(found.positions, found.triangles, found.uv, found.polygons)
        # All triangles of a polygon have its value.
        order = np.argsort(-(np.abs(octaves) if figure == "AREA" else shear)[first], kind="stable")
        weight = np.bincount(found.polygons, area)[polygons[order]]
        count = int(np.searchsorted(np.cumsum(weight), share * area.sum(), side="right"))
        chosen = polygons[order[: max(1, count)]]
    ends = np.cumsum([len(reading.faces) for reading in readings])
    return [np.sort(mine) - start for mine, start in _of_each(chosen, ends)]


def _of_each(polygons: np.ndarray, ends: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """Those of the polygons (k,) that belong to each reading, and the number of its first one."""
    starts = [0, *ends[:-1].tolist()]
    return [(polygons[(polygons >= a) & (polygons < b)], a) for a, b in zip(starts, ends.tolist(), strict=True)]


@contextmanager
def blaming(
    pairs: Sequence[tuple[Any, Reading]], about: Callable[[Any], AbstractContextManager[None]]
) -> Iterator[None]:
    """Name the first object, of pairs of object and Reading that a block measures as one, that has no measure.

    about : a block whose errors are about an object
    """
    try:
        yield
    except MeshError:
        for obj, reading in pairs:
            with about(obj):
                measure_readings([reading])
        raise
