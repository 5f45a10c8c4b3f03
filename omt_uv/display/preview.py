"""A preview of a result in one picture: the mesh with a checker or its cells, the layout, the wireframe.

Needs no display.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..pipelines.distortion import triangles_of
from ..pipelines.reading import Reading
from ..solver.maps.distortion import face_distortion
from .colormaps import area_colours, cell_colours
from .raster import Covered, cover, edge_distances

# Pixels of a tile, twice those of a page of many, and how many samples a pixel has along either axis.
TILE = 240
SAMPLES = 2
# Cells of the checker along the texture.
CELLS = 16
# Share of a tile that stays free around what is shown.
FREE = 0.06
# Whence a mesh is looked at, in degrees about and above.
AZIMUTH = 35.0
ELEVATION = 20.0
# Pixels of a line, and heights of triangles below which lines fade, or dense meshes would be black.
LINE = 1.1
DENSE = 7.0
PAPER = np.array([1.0, 1.0, 1.0])
INK = np.array([0.1, 0.12, 0.16])
CLAY = np.array([0.75, 0.8, 0.86])
FOLDED = np.array([0.85, 0.0, 0.55])


@dataclass(frozen=True)
class Placed:
    """A reading, and the rotation (3,3) and shift (3,) of its positions in the world, where Z is up.

    cells (f,): numbers of what its polygons belong to, -1 for nothing, whose colours are shown in place of a checker
    """

    reading: Reading
    rotation: np.ndarray
    shift: np.ndarray
    cells: np.ndarray | None = None


@dataclass(frozen=True)
class _Drawn:
    """Triangles of several objects: corners in space (m,3,3), normals (m,3,3), UVs (m,3,2) or None, which edges are
    those of polygons (m,3), the one opposite corner i first, octaves (m,), and cells (m,), -1 for none."""

    space: np.ndarray
    normals: np.ndarray
    uv: np.ndarray | None
    real: np.ndarray
    octaves: np.ndarray
    cells: np.ndarray


def preview(objects: Sequence[Placed], tile: int = TILE) -> np.ndarray:
    """A picture (h,w,3) in [0,1], top row first: checker or cells, layout, wireframe; without UVs clay, no layout."""
    drawn = _drawn(objects)
    corners, depth, light = _seen(drawn, tile)
    found = cover(corners, depth, (tile * SAMPLES,) * 2)
    shade = _shade(found, light)
    tiles = [_checkered(drawn, tile, found, shade)]
    if drawn.uv is not None:
        tiles.append(_layout(drawn, tile))
    return np.concatenate([*tiles, _wireframe(drawn, tile, found, shade, corners)], axis=1)


def _drawn(objects: Sequence[Placed]) -> _Drawn:
    """The triangles of all objects."""
    parts = [_of_object(item) for item in objects]
    uvs = [part.uv for part in parts if part.uv is not None]
    space = np.concatenate([part.space for part in parts])
    uv = np.concatenate(uvs) if len(uvs) == len(parts) else None
    octaves = np.zeros(len(space))
    if uv is not None and np.cross(space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]).any():
        # They share a texture, so one scale of areas holds for all.
        found = triangles_of([item.reading for item in objects])
        octaves = face_distortion(found.positions, found.triangles, found.uv, found.polygons)[0]
    return _Drawn(
        space=space,
        normals=np.concatenate([part.normals for part in parts]),
        uv=uv,
        real=np.concatenate([part.real for part in parts]),
        octaves=octaves,
        cells=np.concatenate([part.cells for part in parts]),
    )


def _of_object(item: Placed) -> _Drawn:
    """The triangles of the chosen polygons of an object."""
    surface, reading = item.reading.surface, item.reading
    positions = surface.positions @ item.rotation.T + item.shift
    chosen = reading.faces[surface.triangle_face]
    corners = surface.triangles[chosen]
    triangles = surface.corner_vertex[corners]
    space = positions[triangles]
    cross = np.cross(space[:, 1] - space[:, 0], space[:, 2] - space[:, 0])
    normals = np.column_stack(
        [np.bincount(triangles.ravel(), np.repeat(cross[:, k], 3), len(positions)) for k in range(3)]
    )
    # Corners of a triangle follow one another along a polygon's edge, or its diagonal.
    face = surface.triangle_face[chosen]
    start, size = surface.face_start[face], np.diff(surface.face_start)[face]
    a, b = np.roll(corners, -1, 1) - start[:, None], np.roll(corners, -2, 1) - start[:, None]
    step = (b - a) % size[:, None]
    real = (step == 1) | (step == size[:, None] - 1)
    uv = None if reading.uv is None else reading.uv[corners].astype(float)
    cells = np.full(len(corners), -1) if item.cells is None else item.cells[face]
    return _Drawn(space, normals[triangles], uv, real, np.zeros(len(corners)), cells)


def _checkered(drawn: _Drawn, tile: int, found: Covered, shade: np.ndarray) -> np.ndarray:
    """The mesh, as found in pixels and in their shade (k,1), in the colours of its cells, without any with a checker on
    it, in clay without UVs."""
    colour = np.broadcast_to(CLAY, (len(found.pixels), 3))
    if (drawn.cells >= 0).any():
        colour = np.where((drawn.cells >= 0)[:, None], cell_colours(drawn.cells), CLAY)[found.triangles]
    elif drawn.uv is not None:
        colour = checker_colours((found.weights[:, :, None] * drawn.uv[found.triangles]).sum(1))
    return _picture(found, colour * shade, tile)


def _layout(drawn: _Drawn, tile: int) -> np.ndarray:
    """The UVs in the colours of their areas, with lines; folded faces in one of their own."""
    assert drawn.uv is not None
    low = np.minimum(drawn.uv.reshape(-1, 2).min(0), 0) if len(drawn.uv) else np.zeros(2)
    high = np.maximum(drawn.uv.reshape(-1, 2).max(0), 1) if len(drawn.uv) else np.ones(2)
    corners = _fitted((drawn.uv - low) * [1, -1], (np.zeros(2), (high - low) * [1, -1]), tile * SAMPLES)
    found = cover(corners, np.zeros(corners.shape[:2]), (tile * SAMPLES,) * 2)
    octaves = drawn.octaves[found.triangles]
    # Octaves of folded faces are those of no area at all.
    colour = np.where((octaves < -30)[:, None], FOLDED, area_colours(octaves))
    return _picture(found, _lined(found, corners, drawn.real, colour, 0.4), tile)


def _wireframe(drawn: _Drawn, tile: int, found: Covered, shade: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The mesh in clay, as found in pixels and in their shade (k,1), with the edges of its polygons."""
    return _picture(found, _lined(found, corners, drawn.real, CLAY * shade), tile)


def _seen(drawn: _Drawn, tile: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners in pixels (m,3,2), depth (m,3) and brightness (m,3) as a camera sees them that is far away."""
    a, e = np.radians(AZIMUTH), np.radians(ELEVATION)
    towards = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    right = np.array([np.cos(a), np.sin(a), 0.0])
    local = drawn.space @ np.stack([right, np.cross(towards, right), towards]).T
    flat = local[..., :2] * [1, -1]
    points = flat.reshape(-1, 2)
    corners = _fitted(flat, (points.min(0), points.max(0)), tile * SAMPLES)
    normals = drawn.normals / np.maximum(np.linalg.norm(drawn.normals, axis=2, keepdims=True), 1e-300)
    lamp = towards + 0.5 * np.cross(towards, right) - 0.4 * right
    # Both sides are lit: which of them is the outer one, a mesh may not say.
    bright = 0.35 + 0.65 * np.abs(normals @ (lamp / np.linalg.norm(lamp)))
    return corners, local[..., 2], bright


def _fitted(flat: np.ndarray, box: tuple[np.ndarray, np.ndarray], size: int) -> np.ndarray:
    """Points (m,3,2) moved and scaled so that a box with these two corners is in the middle of so many pixels."""
    low, high = np.minimum(*box), np.maximum(*box)
    extent = float((high - low).max()) or 1.0
    return (flat - (low + high) / 2) * ((1 - 2 * FREE) * size / extent) + size / 2


def _shade(found: Covered, light: np.ndarray) -> np.ndarray:
    """Brightness (k,1) of covered pixels."""
    return (found.weights * light[found.triangles]).sum(1, keepdims=True)


def _lined(found: Covered, corners: np.ndarray, real: np.ndarray, colour: np.ndarray, most: float = 0.85) -> np.ndarray:
    """Colours (k,3) with lines of such strength at most along real edges, fainter where triangles are small."""
    distance = edge_distances(corners, found)
    near = np.where(real[found.triangles], distance, np.inf).min(1)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    wide = np.sqrt(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))[found.triangles]
    strength = np.clip(LINE * SAMPLES - near, 0, 1) * np.clip(wide / (DENSE * SAMPLES), 0.12 * most, most)
    return colour + strength[:, None] * (INK - colour)


def checker_colours(uv: np.ndarray) -> np.ndarray:
    """sRGB (k,3) in [0,1] of a checker at places (k,2) of the texture, with a tint that tells its parts apart."""
    cell = np.floor(uv * CELLS)
    dark = (cell.sum(1) % 2)[:, None]
    phase = 2 * np.pi * np.floor(uv * 4) @ np.array([0.137, 0.411])
    tint = 0.5 + 0.5 * np.cos(phase[:, None] + np.array([0.0, 2.1, 4.2]))
    return (0.95 - 0.45 * dark) * (0.72 + 0.28 * tint)


def _picture(found: Covered, colour: np.ndarray, tile: int) -> np.ndarray:
    """A tile (tile,tile,3) of covered pixels and their colours (k,3), on paper."""
    size = tile * SAMPLES
    image = np.tile(PAPER, (size * size, 1))
    image[found.pixels] = colour
    return np.clip(image, 0, 1).reshape(tile, SAMPLES, tile, SAMPLES, 3).mean((1, 3))
