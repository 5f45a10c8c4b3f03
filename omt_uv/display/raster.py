"""Draw triangles into an array without a display or a graphics card: what covers each pixel, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Pixels that are looked at together, for memory.
CHUNK = 4_000_000
# Barycentric coordinates this far outside still count: pixels on a shared edge belong to somebody.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Covered:
    """Pixels (k,) of a picture, row by row, the nearest triangle (k,) of each, and barycentric coordinates (k,3)."""

    pixels: np.ndarray
    triangles: np.ndarray
    weights: np.ndarray


def cover(corners: np.ndarray, depth: np.ndarray, shape: tuple[int, int]) -> Covered:
    """The nearest triangle of every pixel.

    corners (m,3,2) : x to the right, y down, in pixels, whose centres are at halves; depth (m,3) : the greater, the
    nearer; shape : height and width
    """
    height, width = shape
    size = np.array([width, height])
    low = np.clip(np.ceil(corners.min(1) - 0.5), 0, size).astype(np.int64)
    high = np.clip(np.floor(corners.max(1) - 0.5) + 1, 0, size).astype(np.int64)
    extent = np.maximum(high - low, 0)
    counts = extent.prod(1)
    best = np.full(height * width, -np.inf)
    owner = np.full(height * width, -1, np.int64)
    weights = np.zeros((height * width, 3))
    cuts = np.flatnonzero(np.diff(np.cumsum(counts) // CHUNK)) + 1
    for part in np.split(np.arange(len(corners)), cuts):
        part = part[counts[part] > 0]
        if len(part):
            _draw_part(part, (corners, depth), (low, extent, counts), (best, owner, weights), width)
    found = np.flatnonzero(owner >= 0)
    return Covered(found, owner[found], weights[found])


def _draw_part(part, shapes, boxes, image, width: int) -> None:
    """Draw some of the triangles into depths, owners and weights of pixels."""
    corners, depth = shapes
    low, extent, counts = boxes
    best, owner, weights = image
    ids = np.repeat(part, counts[part])
    first = np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
    row, column = np.divmod(np.arange(len(ids)) - first, extent[ids, 0])
    x, y = low[ids, 0] + column, low[ids, 1] + row
    w = barycentric(corners[ids], np.column_stack([x, y]) + 0.5)
    inside = (w >= -TOLERANCE).all(1)
    ids, w, pixel = ids[inside], w[inside], (y * width + x)[inside]
    z = (w * depth[ids]).sum(1)
    order = np.lexsort((z, pixel))
    last = np.append(pixel[order][1:] != pixel[order][:-1], True) if len(order) else np.zeros(0, bool)
    order = order[last]
    order = order[z[order] > best[pixel[order]]]
    best[pixel[order]], owner[pixel[order]], weights[pixel[order]] = z[order], ids[order], w[order]


def barycentric(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (k,3) of points (k,2) in triangles (k,3,2), none inside where there is no area."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, p = b - a, c - a, points - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    safe = np.where(area == 0, 1.0, area)
    s = (p[:, 0] * v[:, 1] - p[:, 1] * v[:, 0]) / safe
    t = (u[:, 0] * p[:, 1] - u[:, 1] * p[:, 0]) / safe
    return np.where((area == 0)[:, None], -1.0, np.column_stack([1 - s - t, s, t]))


def edge_distances(corners: np.ndarray, covered: Covered) -> np.ndarray:
    """Distances (k,3) in pixels of covered pixels to edges of their triangles (m,3,2), opposite corner i first."""
    chosen = corners[covered.triangles]
    edges = np.roll(chosen, -2, 1) - np.roll(chosen, -1, 1)
    u, v = chosen[:, 1] - chosen[:, 0], chosen[:, 2] - chosen[:, 0]
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    length = np.maximum(np.linalg.norm(edges, axis=2), 1e-12)
    return np.maximum(covered.weights, 0) * area[:, None] / length
