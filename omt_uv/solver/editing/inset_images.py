"""Warp an image from an old UV layout to a new one with detail laid over boxes of the old one (Zhao et al. 2013).

What a map magnifies would only be blurred: images of higher resolution, of a part of the old layout each, take its
place there. Every pixel of the result knows its old place, and by the areas of its triangle how much of the old layout
it covers: that says which level of an image's pyramid it sees (Williams 1983).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..counts import check_pixels
from ..mesh.geometry import signed_areas
from .image_warp import bilinear, continued, old_places, rounded

# Width of the band, over that of a box, across which an image is faded in.
FADE = 0.1
# Channels of colours, where the last of four is alpha.
ALPHA = 3


@dataclass(frozen=True)
class InsetImage:
    """A picture (h,w,c) of the box from low (2,) to high (2,) of the old layout, in UV units."""

    picture: np.ndarray
    low: tuple[float, float]
    high: tuple[float, float]

    def __post_init__(self):
        if not (np.asarray(self.high) > np.asarray(self.low)).all():
            raise ValueError(f"the box from {self.low} to {self.high} has no area")

    def local(self, place: np.ndarray) -> np.ndarray:
        """Places (k,2) of the old layout as places of the picture, in [0, 1] inside of the box."""
        low = np.asarray(self.low, float)
        return (place - low) / (np.asarray(self.high, float) - low)

    def share(self, place: np.ndarray) -> np.ndarray:
        """How much (k,) of places (k,2) of the old layout the picture covers: 1 inside, 0 outside, faded between."""
        inside = np.minimum(self.local(place), 1 - self.local(place)).min(axis=1)
        t = np.clip(inside / FADE, 0, 1)
        return t * t * (3 - 2 * t)


def pyramid(picture: np.ndarray) -> list[np.ndarray]:
    """A picture (h,w,c) as floats, and ones of half the size each down to one pixel: means of two by two pixels.

    >>> [level.shape[:2] for level in pyramid(np.zeros((5, 4, 1)))]
    [(5, 4), (3, 2), (2, 1), (1, 1)]
    """
    levels = [np.asarray(picture, float)]
    while max(levels[-1].shape[:2]) > 1:
        last = levels[-1]
        for axis in (0, 1):
            if last.shape[axis] % 2 and last.shape[axis] > 1:
                last = np.concatenate([last, np.take(last, [-1], axis=axis)], axis=axis)
        rows, columns = (max(n // 2, 1) for n in last.shape[:2])
        blocks = last.reshape(rows, last.shape[0] // rows, columns, last.shape[1] // columns, last.shape[2])
        levels.append(blocks.mean(axis=(1, 3)))
    return levels


def sampled(levels: Sequence[np.ndarray], uv: np.ndarray, pixels: np.ndarray, repeat: bool) -> np.ndarray:
    """Samples (k,c) of a pyramid at UVs (k,2) of pixels that each cover so many (k,) of its pixels along a side.

    repeat : beyond [0, 1] the picture repeats; otherwise its border goes on
    """
    level = np.clip(np.log2(np.maximum(pixels, 1e-12)), 0, len(levels) - 1)
    lower = np.floor(level).astype(np.int64)
    result = np.zeros((len(uv), levels[0].shape[2]))
    for k, picture in enumerate(levels):
        weight = np.where(lower == k, 1 - (level - lower), np.where(lower + 1 == k, level - lower, 0))
        mine = np.flatnonzero(weight > 0)
        result[mine] += weight[mine, None] * bilinear(picture, uv[mine], _pixels(picture, repeat))
    return result


def _pixels(picture: np.ndarray, repeat: bool):
    height, width = picture.shape[:2]
    if repeat:
        return lambda row, column: picture[row % height, column % width]
    return lambda row, column: picture[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]


def warp_with_insets(
    picture: np.ndarray,
    old: np.ndarray,
    new: np.ndarray,
    insets: Sequence[InsetImage] = (),
    size: tuple[int, int] | None = None,
    margin: int = 4,
) -> np.ndarray:
    """The picture (h,w,c) of the layout `old` for the layout `new`, (m,3,2) each, with insets where it shows them.

    size : rows and columns of the result, those of the picture by default; what is made smaller is filtered. Islands
        are continued by `margin` pixels; what lies farther outside shows the picture as it was. Insets have as many
        channels as the picture; their alpha, if there is one, covers

    Raises
    ------
    CountError : more pixels than this machine has memory for

    References
    ----------
    Zhao et al. 2013, sections 4.3 and 5.2
    """
    height, width = size or picture.shape[:2]
    check_pixels(width, height)
    place, face = old_places(old, new, height, width)
    place, face, known = continued(place, face, margin)
    corner = np.arange(3 * len(new)).reshape(-1, 3)
    areas = [np.abs(signed_areas(x.reshape(-1, 2), corner)) for x in (old, new)]
    # Of the old layout, what the side of a pixel covers.
    covers = np.sqrt(areas[0] / np.maximum(areas[1], 1e-300) / (height * width))
    row, column = np.mgrid[0:height, 0:width]
    own = np.stack([(column + 0.5) / width, (row + 0.5) / height], axis=-1)
    place = np.where(known[..., None], place, own).reshape(-1, 2)
    cover = np.where(known.ravel(), covers[np.maximum(face.ravel(), 0)], 1 / np.sqrt(height * width))
    side = np.sqrt(picture.shape[0] * picture.shape[1])
    result = sampled(pyramid(picture), place, cover * side, repeat=True)
    for inset in insets:
        mine = np.flatnonzero(inset.share(place) > 0)
        extent = np.sqrt(np.prod(np.asarray(inset.high, float) - np.asarray(inset.low, float)))
        pixels = cover[mine] * np.sqrt(inset.picture.shape[0] * inset.picture.shape[1]) / extent
        colours = sampled(pyramid(inset.picture), inset.local(place[mine]), pixels, repeat=False)
        share = inset.share(place[mine])[:, None]
        if picture.shape[2] > ALPHA and not np.issubdtype(picture.dtype, np.integer):
            share = share * np.clip(colours[:, ALPHA:], 0, 1)
            colours[:, ALPHA:] = np.maximum(colours[:, ALPHA:], result[mine, ALPHA:])
        result[mine] += share * (colours - result[mine])
    result = result.reshape(height, width, -1)
    if np.issubdtype(picture.dtype, np.floating):
        return result.astype(picture.dtype)
    return rounded(result, picture.dtype)
