"""Area ratio, shear and the direction of stretch of every polygon, as values for Geometry Nodes and shaders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...solver.maps.distortion import RATIO_FLOOR, face_distortion
from ...solver.mesh.geometry import face_areas
from ..distortion import triangles_of
from ..reading import Reading


@dataclass(frozen=True)
class FaceValues:
    """Of every polygon of a mesh: log2 of its area ratio (f,), shear (f,), and stretch (f,3), the unit vector of space
    along which its texture is pulled most; 0, 1 and 0 where nothing was measured."""

    area: np.ndarray
    shear: np.ndarray
    stretch: np.ndarray


def face_values(reading: Reading) -> FaceValues:
    """Values of the chosen polygons of a reading.

    Raises
    ------
    EmptyMeshError : no polygon is chosen, or there are no UVs
    """
    found = triangles_of([reading])
    f = len(reading.faces)
    octaves, shear = face_distortion(found.positions, found.triangles, found.uv, found.polygons)
    area, ratio = np.zeros(f), np.ones(f)
    # All triangles of a polygon have its value.
    area[found.polygons] = np.maximum(octaves, np.log2(RATIO_FLOOR))
    ratio[found.polygons] = shear
    return FaceValues(area, ratio, _stretch(found.positions[found.triangles], found.uv, found.polygons, f))


def _stretch(space: np.ndarray, uv: np.ndarray, polygons: np.ndarray, f: int) -> np.ndarray:
    """Directions (f,3) of least texture per length, of triangles (m,3,3) with UVs (m,3,2) and polygons (m,).

    A texture that has few pixels along a direction looks pulled along it: the singular vector in space of the smaller
    singular value of the map from space to UV. That of a polygon is the one of its largest triangle.
    """
    u, v = space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]
    length = np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300)
    x = u / length
    y = v - (v * x).sum(1, keepdims=True) * x
    y /= np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-300)
    flat = np.stack([np.stack([(e * x).sum(1), (e * y).sum(1)], 1) for e in (u, v)], 2)
    image = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], 2)
    good = np.abs(np.linalg.det(flat)) > 1e-300
    flat[~good] = np.eye(2)
    _, values, axes = np.linalg.svd(image @ np.linalg.inv(flat))
    least = axes[:, 1]
    direction = least[:, :1] * x + least[:, 1:] * y
    # Where no direction stands out there is none.
    direction[~good | (values[:, 0] <= values[:, 1] * (1 + 1e-6))] = 0.0
    made = np.zeros((f, 3))
    order = np.argsort(face_areas(space.reshape(-1, 3), np.arange(3 * len(space)).reshape(-1, 3)), kind="stable")
    made[polygons[order]] = direction[order]
    return made
