"""Measure and set the texel density of UV islands: how many pixels of the texture a metre of the surface gets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..solver.errors import EmptyMeshError, ZeroAreaFaceError
from ..solver.maps.distortion import uv_charts
from ..solver.mesh.geometry import signed_areas
from ..solver.mesh.polygon_areas import polygon_areas
from .reading import Reading

# UVs are stored with single precision.
ROUNDING = 1e-5


@dataclass(frozen=True)
class Texels:
    """How UV and space are measured: pixels along a side of the texture, and metres in a unit of length."""

    texture_size: float
    metres: float = 1.0


@dataclass(frozen=True)
class _MeasuredFaces:
    """UVs (c,2), triangles (m,3) of corners, of vertices, and their areas (m,) in space,
    those of a polygon summing to its own, and in UV."""

    uv: np.ndarray
    corners: np.ndarray
    vertices: np.ndarray
    space: np.ndarray
    uv_area: np.ndarray


def beyond_tile(uv: np.ndarray) -> float:
    """How far UVs (k,2) reach beyond the UDIM tile that holds their middle; 0 where they do not, up to rounding."""
    tile = np.floor((uv.min(axis=0) + uv.max(axis=0)) / 2)
    far = float(np.maximum(tile - uv.min(axis=0), uv.max(axis=0) - tile - 1).max())
    return far if far > ROUNDING else 0.0


def texel_density(readings: Sequence[Reading], texels: Texels) -> float:
    """Pixels per metre of the chosen polygons of all readings together.

    Raises
    ------
    EmptyMeshError : no UVs, or no polygon is chosen; ZeroAreaFaceError : nothing has an area
    """
    faces = [_faces(reading) for reading in readings]
    return _texels_per_metre(sum(f.space.sum() for f in faces), sum(f.uv_area.sum() for f in faces), texels)


def with_texel_density(
    readings: Sequence[Reading], target: float, texels: Texels, each_island: bool
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Corners (k,) and UVs (k,2) of the chosen polygons of every reading, scaled to `target` pixels per metre.

    each_island: every island about the middle of its bounding box, so that afterwards all have this density; otherwise
    the whole layout by one factor about its middle, which keeps the differences between islands.

    Raises
    ------
    EmptyMeshError, ZeroAreaFaceError : as for `texel_density`
    """
    faces = [_faces(reading) for reading in readings]
    common = target / _texels_per_metre(sum(f.space.sum() for f in faces), sum(f.uv_area.sum() for f in faces), texels)
    used = np.concatenate([f.uv[np.unique(f.corners)] for f in faces])
    middle = (used.min(axis=0) + used.max(axis=0)) / 2
    result = []
    for face in faces:
        corners, first = np.unique(face.corners, return_index=True)
        uv = face.uv[corners]
        if each_island:
            factor, centre = _of_islands(face, first, uv, target, texels)
        else:
            factor, centre = np.full(len(uv), common), middle
        result.append((corners, centre + (uv - centre) * factor[:, None]))
    return result


def _of_islands(face: _MeasuredFaces, first, uv, target: float, texels: Texels) -> tuple[np.ndarray, np.ndarray]:
    """Factor (k,) and centre (k,2) of the islands of corners first (k,); islands without area stay as they are."""
    count, of_face = uv_charts(face.vertices, face.uv[face.corners])
    space, covered = np.bincount(of_face, face.space, count), np.bincount(of_face, face.uv_area, count)
    island = np.repeat(of_face, 3)[first]
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = target * texels.metres / texels.texture_size * np.sqrt(space / covered)
    factor = np.where(np.isfinite(factor) & (factor > 0), factor, 1.0)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, island, uv)
    np.maximum.at(high, island, uv)
    return factor[island], ((low + high) / 2)[island]


def _faces(reading: Reading) -> _MeasuredFaces:
    """Triangles of the chosen polygons, as they lie in space and in UV."""
    if reading.uv is None:
        raise EmptyMeshError("There are no UVs", remedy="Unwrap the mesh first")
    surface = reading.surface
    corners = surface.triangles[reading.faces[surface.triangle_face]]
    if not len(corners):
        raise EmptyMeshError("There are no faces to measure")
    uv, triangles = reading.uv.astype(float), surface.corner_vertex[corners]
    polygons = surface.triangle_face[reading.faces[surface.triangle_face]]
    space = polygon_areas(surface.positions, triangles, polygons)
    return _MeasuredFaces(uv, corners, triangles, space, np.abs(signed_areas(uv, corners)))


def _texels_per_metre(space: float, covered: float, texels: Texels) -> float:
    """Pixels per metre where faces of so much area in space cover so much of the unit square."""
    if not (space > 0 and covered > 0):
        raise ZeroAreaFaceError("The faces have no area in space, or none in the UV map")
    return float(texels.texture_size / texels.metres * np.sqrt(covered / space))
