"""Layouts of UVs as pictures: in the colours of area or shear, or lit by the normals of the surface; power diagrams."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipelines.distortion import triangles_of
from ...pipelines.measuring.diagrams import Diagram
from ...solver.counts import check_pixels
from ...solver.maps.distortion import face_distortion
from ..colormaps import area_colours, cell_colours, shear_colours
from ..preview import Placed
from ..raster import cover, edge_distances

SAMPLES = 2
PAPER = np.array([1.0, 1.0, 1.0])
INK = np.array([0.1, 0.12, 0.16])
# Towards the light, in the world; what looks away from it is dark, but not black.
LIGHT = np.array([-0.4, -0.6, 0.7])
DARKEST = 0.2
# Share of a picture of cells that stays free at each side; whence the sphere is looked at.
FREE = 0.03
LINE = 1.2


def layout_picture(objects: Sequence[Placed], kind: str, size: int) -> np.ndarray:
    """The layout (size,size,3) in [0,1], top row first, of "area", "shear" or "normals"; all objects need UVs. They
    share a texture, so one scale of areas holds for all.

    Raises
    ------
    MeshError : there is no face, more pixels than this machine has memory for, or, but for normals, see
        `solver.maps.distortion.distortion`
    """
    check_pixels(size * SAMPLES, size * SAMPLES)
    found = triangles_of([item.reading for item in objects])
    if kind == "normals":
        colours = np.concatenate([_lit_faces(item) for item in objects])
    else:
        octaves, shear = face_distortion(found.positions, found.triangles, found.uv, found.polygons)
        tints = area_colours(octaves) if kind == "area" else shear_colours(shear)
        colours = np.repeat(tints[:, None], 3, axis=1)
    corner = found.uv * [1, -1] + [0, 1]
    wide = size * SAMPLES
    covered = cover(corner * wide, np.zeros(corner.shape[:2]), (wide, wide))
    shown = (covered.weights[:, :, None] * colours[covered.triangles]).sum(axis=1)
    return _averaged(covered.pixels, shown, size)


def cells_picture(diagram: Diagram, size: int) -> np.ndarray:
    """The cells (size,size,3) in [0,1], top row first, in tints with their sides; of the sphere the half in front.
    Raises CountError for more than this machine has memory for."""
    check_pixels(size * SAMPLES, size * SAMPLES)
    points = diagram.points
    triangles, owner = diagram.cells.fans()
    on_sphere = diagram.cells.points.shape[1] == 3
    seen, depth = (points[:, [0, 2]], -points[:, 1]) if on_sphere else (points[:, :2], points[:, 2])
    extent = float(np.abs(seen).max())
    wide = size * SAMPLES
    corner = (seen * [1, -1] * ((0.5 - FREE) / extent) + 0.5) * wide
    found = cover(corner[triangles], depth[triangles], (wide, wide))
    colour = cell_colours(owner)[found.triangles]
    # A side of a cell is a side of its fan that starts at no corner inside: opposite the first, and the two outermost.
    start, end = diagram.cells.start[:-1][owner], diagram.cells.start[1:][owner]
    real = np.stack([np.ones(len(owner), bool), triangles[:, 2] == end - 1, triangles[:, 1] == start + 1], axis=1)
    distance = np.where(real[found.triangles], edge_distances(corner[triangles], found), np.inf).min(axis=1)
    strength = np.clip(LINE * SAMPLES / 2 + 0.5 - distance, 0, 1)[:, None]
    return _averaged(found.pixels, colour + strength * (INK - colour), size)


def _lit_faces(item: Placed) -> np.ndarray:
    """Brightness (m,3,3) of the corners of the chosen triangles of an object as it stands in the world."""
    surface = item.reading.surface
    triangles = surface.corner_vertex[surface.triangles[item.reading.faces[surface.triangle_face]]]
    return _lit(surface.positions @ item.rotation.T, triangles)[triangles]


def _lit(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Brightness (n,3) of vertices by their normals."""
    p = positions[triangles]
    cross = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    sums = np.stack([np.bincount(triangles.ravel(), np.repeat(x, 3), len(positions)) for x in cross.T], axis=1)
    normal = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)
    light = DARKEST + (1 - DARKEST) * (0.5 + 0.5 * normal @ (LIGHT / np.linalg.norm(LIGHT)))
    return np.repeat(light[:, None], 3, axis=1)


def _averaged(pixels: np.ndarray, colour: np.ndarray, size: int) -> np.ndarray:
    """A picture (size,size,3) of samples and their colours (k,3) on paper."""
    image = np.tile(PAPER, ((size * SAMPLES) ** 2, 1))
    image[pixels] = colour
    return np.clip(image, 0, 1).reshape(size, SAMPLES, size, SAMPLES, 3).mean(axis=(1, 3))
