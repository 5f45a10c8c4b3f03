"""The strain of UV maps, of shape keys and between poses, as figures and as what is written to a mesh."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from ...solver.mesh.surface import Surface, check_finite
from ...solver.strain.beltrami import Beltrami, corner_beltrami
from ...solver.strain.regions import RegionStrain
from ..reading import check_uvs


def strain_of(surface: Surface, uv: np.ndarray | None = None, shape: np.ndarray | None = None) -> Beltrami:
    """Beltrami coefficients of the triangles of a surface, of its map to UVs (c,2) of the corners or to a shape (n,3).

    Raises
    ------
    ValueError : neither or both are given
    NonFiniteError : a coordinate of a face, of its shape or a UV is none; elements are vertices, or polygons
    """
    if (uv is None) == (shape is None):
        raise ValueError("strain is that of UVs or of a shape")
    triangles = surface.corner_vertex[surface.triangles]
    check_finite(surface.positions, triangles)
    corners = surface.positions[triangles]
    if uv is not None:
        check_uvs(surface, uv)
        return corner_beltrami(corners, np.asarray(uv, float)[surface.triangles])
    image = np.asarray(shape, float)
    check_finite(image, triangles)
    return corner_beltrami(corners, image[triangles])


def of_polygons(found: Beltrami, surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """|mu| (f,), at most 1, of the polygons, the mean over their triangles, and the vector (f,3) of stretch as long."""
    count = len(surface.face_start) - 1
    area = np.maximum(found.area, 1e-300)
    total = np.maximum(np.bincount(surface.triangle_face, area, count), 1e-300)
    # A direction and its opposite are one: squares are averaged.
    moment = np.einsum("m,ma,mb->mab", area * np.minimum(found.size, 1), found.direction, found.direction)
    square = np.zeros((count, 3, 3))
    np.add.at(square, surface.triangle_face, moment)
    size = np.bincount(surface.triangle_face, area * np.minimum(found.size, 1), count) / total
    _, axes = np.linalg.eigh(square)
    return size, size[:, None] * axes[:, :, 2]


def regions_of(surface: Surface, weights: dict[str, np.ndarray], materials: np.ndarray, names: list[str]) -> dict:
    """Regions as weights (m,) of the triangles: vertex groups by weights (n,), materials by slots (f,)."""
    triangles = surface.corner_vertex[surface.triangles]
    regions = {name: np.asarray(w, float)[triangles].mean(axis=1) for name, w in weights.items()}
    if len(names) > 1:
        # Slots beyond the last one are shown as that, and several may hold one material.
        slots = np.minimum(materials[surface.triangle_face], len(names) - 1)
        mine = np.array(names, dtype=object)[slots]
        regions |= {f"material {name}": (mine == name).astype(float) for name in names}
    return regions


def strain_report(rows: list[RegionStrain]) -> list[dict]:
    """Figures of the whole and of every region, for a JSON file."""
    return [_row(row) for row in rows]


def _row(row: RegionStrain) -> dict:
    return {**asdict(row), "histogram": row.histogram.round(6).tolist()}


def same_polygons(first: Surface, other: Surface) -> bool:
    """Whether two surfaces have the same polygons of the same vertices, each from whichever corner on, so that a vertex
    of one is one of the other."""
    return (
        len(first.positions) == len(other.positions)
        and len(first.corner_vertex) == len(other.corner_vertex)
        and np.array_equal(first.face_start, other.face_start)
        and np.array_equal(_from_the_least(first), _from_the_least(other))
    )


def _from_the_least(surface: Surface) -> np.ndarray:
    """The vertices (c,) of corners, every polygon from the least of its vertices on."""
    vertex, size = surface.corner_vertex, np.diff(surface.face_start)
    owner, first = np.repeat(np.arange(len(size)), size), np.repeat(surface.face_start[:-1], size)
    least = np.lexsort((vertex, owner))[first]
    return vertex[first + (np.arange(len(vertex)) + least - 2 * first) % size[owner]]
