"""Figures of maps to the sphere: areas of spherical triangles, and the shear of flat ones with the same corners."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..maps.distortion import shear_of
from ..mesh.geometry import cross3, face_areas, lengths
from ..mesh.spherical_geometry import spherical_areas


@dataclass(frozen=True)
class SphereFigures:
    """How far a map to the sphere is from areas and angles.

    folds : triangles that the map turns over
    area_l1, area_sd : mean of |r - 1| and root of that of (r - 1)^2 over the surface, r the share of the area on the
        sphere over that on the surface; angle_mean : mean of the shear s1 / s2 over the surface
    symmetric_area, symmetric_angle : means over the triangles of r + 1/r and of s1/s2 + s2/s1, at least 2: tables 1 and
        2 of Dominitz, Tannenbaum 2010
    """

    folds: int
    area_l1: float
    area_sd: float
    angle_mean: float
    symmetric_area: float
    symmetric_angle: float

    def report(self) -> dict[str, float]:
        """The figures by name."""
        return asdict(self)


def sphere_figures(vertices: np.ndarray, triangles: np.ndarray, positions: np.ndarray) -> SphereFigures:
    """Figures of a map of a surface (n,3), (m,3) to unit vectors (n,3); holes leave a part of the sphere out.

    >>> octahedron = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    >>> faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    >>> sphere_figures(2 * octahedron, faces, octahedron).symmetric_area
    2.0
    """
    surface, on_sphere = face_areas(vertices, triangles), spherical_areas(positions, triangles)
    share = surface / surface.sum()
    ratio = on_sphere / on_sphere.sum() / np.maximum(share, np.finfo(float).tiny)
    corner = positions[triangles]
    side, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    base = np.maximum(lengths(side), np.finfo(float).tiny)
    along, up = np.einsum("md,md->m", side, other) / base, lengths(cross3(side, other)) / base
    shear = shear_of(vertices, triangles, np.column_stack([base, 0 * base]), np.column_stack([along, up]))
    real = (surface > 0) & (ratio > 0) & np.isfinite(shear)
    return SphereFigures(
        folds=int((ratio <= 0).sum()),
        area_l1=float(share @ np.abs(ratio - 1)),
        area_sd=float(np.sqrt(share @ (ratio - 1) ** 2)),
        angle_mean=float(share[real] @ shear[real] / share[real].sum()),
        symmetric_area=float((ratio[real] + 1 / ratio[real]).mean()),
        symmetric_angle=float((shear[real] + 1 / shear[real]).mean()),
    )
