"""Images of the whole sphere from one layout to another, so that they look right on it (Dominitz, Tannenbaum 2010,
5)."""

from __future__ import annotations

import numpy as np

from ..solver.globe.projections import OCTAHEDRAL, check_projection, is_cylindrical, to_plane, to_sphere
from ..solver.progress import Progress, Steps

# Samples along each side of a pixel: enough where a row at a pole covers a dozen rows of the source.
SAMPLES = 4
# Pixels that are resampled at once; bounds the memory.
BLOCK = 1 << 18


def redraw(image: np.ndarray, source: str, target: str, size: tuple[int, int] | None = None) -> Steps[np.ndarray]:
    """An image (h,w,c) of the sphere in the layout `source`, redrawn for the layout `target`, (rows,columns,c).

    Row 0 is the bottom, v = 0. Every pixel is the mean of bilinear samples spread over it. The size, as rows and
    columns, is that of the image by default, but square for the octahedral layout.

    Raises
    ------
    ValueError : an unknown layout, or an image without pixels
    """
    check_projection(source)
    check_projection(target)
    if image.ndim != 3 or min(image.shape) == 0:
        raise ValueError(f"an image needs rows, columns and channels, not the shape {image.shape}")
    rows, columns = size or _size(image, target)
    result = np.empty((rows, columns, image.shape[2]), image.dtype)
    spread = (np.arange(SAMPLES) + 0.5) / SAMPLES
    at_once = max(1, BLOCK // (columns * SAMPLES**2))
    u = ((np.arange(columns)[:, None] + spread) / columns).ravel()
    for first in range(0, rows, at_once):
        yield Progress("Image", first / rows)
        last = min(first + at_once, rows)
        v = ((np.arange(first, last)[:, None] + spread) / rows).ravel()
        uv = np.stack(np.meshgrid(u, v), axis=-1)
        colours = _bilinear(image, to_plane(to_sphere(uv, target), source), source)
        blocks = colours.reshape(last - first, SAMPLES, columns, SAMPLES, -1)
        result[first:last] = blocks.mean(axis=(1, 3))
    return result


def _size(image: np.ndarray, target: str) -> tuple[int, int]:
    rows, columns = image.shape[:2]
    if target == OCTAHEDRAL:
        side = max(1, round(float(np.sqrt(rows * columns))))
        return side, side
    return rows, columns


def _bilinear(image: np.ndarray, uv: np.ndarray, layout: str) -> np.ndarray:
    """Colours (...,c) of an image at uv (...,2); pixel centres are at half integers, and the layout goes on beyond."""
    rows, columns = image.shape[:2]
    x, y = uv[..., 0] * columns - 0.5, uv[..., 1] * rows - 0.5
    j, i = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = (x - j)[..., None], (y - i)[..., None]
    low = (1 - fx) * _pixels(image, i, j, layout) + fx * _pixels(image, i, j + 1, layout)
    high = (1 - fx) * _pixels(image, i + 1, j, layout) + fx * _pixels(image, i + 1, j + 1, layout)
    return (1 - fy) * low + fy * high


def _pixels(image: np.ndarray, i: np.ndarray, j: np.ndarray, layout: str) -> np.ndarray:
    """Pixels at rows i and columns j, at most one beyond the image, where the layout has its continuation."""
    rows, columns = image.shape[:2]
    if is_cylindrical(layout):
        return image[np.clip(i, 0, rows - 1), j % columns]
    # A side of the octahedral square is glued to itself about its midpoint.
    beyond_i, beyond_j = (i < 0) | (i >= rows), (j < 0) | (j >= columns)
    row = np.where(beyond_j, rows - 1 - i, i)
    column = np.where(beyond_i, columns - 1 - j, j)
    return image[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
