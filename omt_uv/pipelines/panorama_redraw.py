"""Redraw images of the whole sphere for another layout, by supersampling (Dominitz, Tannenbaum 2010, section 5)."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..solver.editing.image_warp import bilinear
from ..solver.globe.projections import OCTAHEDRAL, SINUSOIDAL, check_projection, is_cylindrical, to_plane, to_sphere
from ..solver.progress import Progress, Steps

# Samples along each side of a pixel, enough where a row at a pole covers a dozen rows of the source.
SAMPLES = 4
# Samples taken at once, which bounds the memory.
BLOCK = 1 << 18


def redraw(image: np.ndarray, source: str, target: str, size: tuple[int, int] | None = None) -> Steps[np.ndarray]:
    """An image (h,w,c) of the sphere in the layout `source`, redrawn for the layout `target`, (rows,columns,c).

    The source "sinusoidal" is a flat picture, of which the whole is drawn about the equator and ever less towards the
    poles, which would pinch it. Row 0 is the bottom, v = 0. Every pixel is the mean of bilinear samples spread over
    it. The size, as rows and columns, is that of the image by default, but square for the octahedral layout.

    Raises
    ------
    ValueError : an unknown layout, or an image without pixels
    """
    if source != SINUSOIDAL:
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
        places = to_plane(to_sphere(uv, target), source)
        colours = bilinear(image, places, partial(_pixels, image, source))
        blocks = colours.reshape(last - first, SAMPLES, columns, SAMPLES, -1)
        result[first:last] = blocks.mean(axis=(1, 3))
    return result


def _size(image: np.ndarray, target: str) -> tuple[int, int]:
    """Rows and columns for a layout: those of the image, but as many pixels in a square for the octahedral one."""
    rows, columns = image.shape[:2]
    if target == OCTAHEDRAL:
        side = max(1, round(float(np.sqrt(rows * columns))))
        return side, side
    return rows, columns


def _pixels(image: np.ndarray, layout: str, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Pixels at rows i and columns j, at most one beyond the image, where the layout has its continuation."""
    rows, columns = image.shape[:2]
    if is_cylindrical(layout):
        return image[np.clip(i, 0, rows - 1), j % columns]
    # A side of the octahedral square is glued to itself about its midpoint.
    beyond_i, beyond_j = (i < 0) | (i >= rows), (j < 0) | (j >= columns)
    row = np.where(beyond_j, rows - 1 - i, i)
    column = np.where(beyond_i, columns - 1 - j, j)
    return image[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
