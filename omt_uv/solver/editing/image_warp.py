"""Warp an image from an old UV layout to a new one: every pixel looks up where its place was."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..mesh.geometry import cross2
from ..mesh.topology import expand

# Pixels at a time, for memory.
ROWS = 64


def warp_image(
    picture: np.ndarray, old: np.ndarray, new: np.ndarray, margin: int = 4, straight: bool = False
) -> np.ndarray:
    """The picture (h,w,c) of the layout `old` as a picture of the same size for the layout `new`, (m,3,2) each.

    UVs count from the lower left corner of the first row of pixels, as in Blender; beyond [0,1] it repeats.
    Sampled bilinearly. Islands are continued by `margin` pixels; what lies farther outside stays as it is.
    straight : the last channel is alpha, and colours are not multiplied by it: what is transparent has no part in means
    """
    height, width = picture.shape[:2]
    place, _, known = continued(*old_places(old, new, height, width), margin)
    result = np.array(picture, dtype=float, copy=True)
    result[known] = _by_alpha(picture, place[known]) if straight else _repeated(picture, place[known])
    if np.issubdtype(picture.dtype, np.floating):
        return result.astype(picture.dtype)
    return rounded(result, picture.dtype)


def rounded(values: np.ndarray, dtype) -> np.ndarray:
    """Values as integers of a type, within its limits, in their shape."""
    limits = np.iinfo(dtype)
    return np.clip(np.rint(values), limits.min, limits.max).astype(dtype)


def old_places(old: np.ndarray, new: np.ndarray, height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """The old UV (h,w,2) of every pixel's middle, and the triangle (h,w) that covers it, -1 for none.

    All pixels of the faces' bounding boxes at once, in slices of faces so that memory stays bounded.
    """
    size = np.array([width, height])
    corner = new * size - 0.5
    low = np.clip(np.ceil(corner.min(axis=1) - 1e-9), 0, size).astype(np.int64)
    high = np.clip(np.floor(corner.max(axis=1) + 1e-9) + 1, 0, size).astype(np.int64)
    span = np.maximum(high - low, 0)
    count = span.prod(axis=1)
    place, covered = np.zeros((height, width, 2)), np.full((height, width), -1, np.int64)
    for part in np.split(np.arange(len(new)), _cuts(count, ROWS * max(width, 256))):
        face, k = expand(count[part])
        face = part[face]
        x = low[face, 0] + k % np.maximum(span[face, 0], 1)
        y = low[face, 1] + k // np.maximum(span[face, 0], 1)
        share = _barycentric(corner[face], np.stack([x, y], axis=1).astype(float))
        inside = (share >= -1e-9).all(axis=1)
        x, y, face, share = x[inside], y[inside], face[inside], share[inside]
        place[y, x] = np.einsum("ki,kid->kd", share, old[face])
        covered[y, x] = face
    return place, covered


def _cuts(count: np.ndarray, most: int) -> np.ndarray:
    """Where to split so that the counts (m,) of a part sum to about `most`."""
    total = np.cumsum(count)
    return np.unique(np.searchsorted(total, np.arange(most, int(total[-1]) if len(total) else 0, most)))


def _barycentric(corner: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (k,3) of points (k,2) in triangles (k,3,2); NaN where a triangle has no area."""
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    total = cross2(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        v = cross2(point - a, c - a) / total
        w = cross2(b - a, point - a) / total
    return np.stack([1 - v - w, v, w], axis=1)


def continued(place: np.ndarray, face: np.ndarray, margin: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (h,w,2) and faces (h,w) continued into uncovered pixels nearer than `margin`, each that of its nearest
    covered pixel, and which pixels (h,w) bool have one."""
    covered = face >= 0
    if margin <= 0 or covered.all() or not covered.any():
        return place, face, covered
    distance, nearest = distance_transform_edt(~covered, return_indices=True)
    near = distance <= margin
    return place[nearest[0], nearest[1]], face[nearest[0], nearest[1]], near


def _by_alpha(picture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Samples (k,c) of a picture (h,w,c) at UVs (k,2), colours weighed by the last channel, where there is any."""
    plain = _repeated(picture, uv)
    alpha = picture[..., -1:].astype(float)
    weighed, weight = _repeated(picture * alpha, uv), plain[:, -1:]
    colours = np.where(weight > 0, weighed / np.where(weight > 0, weight, 1), plain)
    return np.column_stack([colours[:, :-1], plain[:, -1]])


def bilinear(
    picture: np.ndarray, uv: np.ndarray, pixels_at: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """Sample a picture (h,w,c) at UVs (...,2): (...,c), bilinearly between pixels, whose centres are at half integers.

    pixels_at : pixels (...,c) at rows and columns (...) of integers, beyond the picture as well
    """
    height, width = picture.shape[:2]
    x, y = uv[..., 0] * width - 0.5, uv[..., 1] * height - 0.5
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    s, t = (x - column)[..., None], (y - row)[..., None]
    lower = (1 - s) * pixels_at(row, column) + s * pixels_at(row, column + 1)
    upper = (1 - s) * pixels_at(row + 1, column) + s * pixels_at(row + 1, column + 1)
    return (1 - t) * lower + t * upper


def _repeated(picture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Samples (k,c) at UVs (k,2) of a picture (h,w,c) that repeats beyond [0,1]."""
    height, width = picture.shape[:2]
    return bilinear(picture, uv, lambda row, column: picture[row % height, column % width])
