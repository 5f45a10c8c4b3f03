"""Measure the distortion of several readings as one: they share a texture, so one scale holds for all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..solver.errors import EmptyMeshError
from ..solver.maps.distortion import Distortion, distortion
from .reading import Reading


def triangles_of(readings: Sequence[Reading]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (n,3), triangles (m,3) and their UVs (m,3,2) of the chosen polygons of all readings in turn.

    Raises
    ------
    EmptyMeshError : no polygon is chosen, or a mesh with chosen polygons has no UVs
    """
    positions, triangles, uv, offset = [], [], [], 0
    for reading in readings:
        surface = reading.surface
        corners = surface.triangles[reading.faces[surface.triangle_face]]
        if not len(corners):
            continue
        if reading.uv is None:
            raise EmptyMeshError("There are no UVs to measure", remedy="Unwrap the mesh first")
        positions.append(surface.positions)
        triangles.append(surface.corner_vertex[corners] + offset)
        uv.append(reading.uv[corners].astype(float))
        offset += len(surface.positions)
    if not triangles:
        raise EmptyMeshError("There are no faces to measure")
    return np.concatenate(positions), np.concatenate(triangles), np.concatenate(uv)


def measure_readings(readings: Sequence[Reading], overlap: bool = True) -> Distortion:
    """Distortion of the active UVs over the chosen polygons of all readings; `overlap` costs most of the time.

    Raises
    ------
    EmptyMeshError : no polygon is chosen, or a mesh with chosen polygons has no UVs
    NonFiniteError, ZeroAreaFaceError : see `solver.maps.distortion.distortion`
    """
    return distortion(*triangles_of(readings), overlap=overlap)


def summary(figures: Distortion) -> str:
    """One line for a status bar."""
    return (
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
