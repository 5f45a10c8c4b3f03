"""Draw a matrix of distances as shades, and things as points of a map; needs no display."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import write
from .plots import COLOURS, INK, dots

# Pixels of a picture's side, its margins, and room for names at the right.
SIDE = 900
MARGIN = 56
LEGEND = 200
# More names than these are not written.
MOST_NAMES = 120


def matrix_picture(distances: np.ndarray, classes: Sequence[str] | None = None) -> np.ndarray:
    """A picture (h,w,3) of a matrix (n,n): black is 0, white the greatest; grey-blue where there is none. With classes
    (n,), rows are in their order, and lines part these."""
    n = len(distances)
    order = np.arange(n) if classes is None else np.argsort(np.asarray(classes), kind="stable")
    values = np.asarray(distances, float)[np.ix_(order, order)]
    known = np.isfinite(values)
    top = values[known].max(initial=0) or 1.0
    shade = np.repeat(np.where(known, values / top, 0)[..., None], 3, axis=2)
    shade[~known] = (0.45, 0.5, 0.6)
    index = np.arange(SIDE) * n // SIDE
    picture = np.ones((SIDE + 2 * MARGIN, SIDE + MARGIN + LEGEND, 3))
    picture[MARGIN : MARGIN + SIDE, MARGIN : MARGIN + SIDE] = shade[np.ix_(index, index)]
    write(picture, f"0 to {top:.3g}", MARGIN + SIDE / 2, MARGIN - 20, 18, INK, "middle")
    if classes is None:
        return picture
    names = np.asarray(classes)[order]
    first = np.flatnonzero(np.r_[True, names[1:] != names[:-1]])
    for k, begin in enumerate(first):
        end = first[k + 1] if k + 1 < len(first) else n
        low, high = MARGIN + begin * SIDE // n, MARGIN + end * SIDE // n
        colour = COLOURS[k % len(COLOURS)]
        picture[low : low + 1, MARGIN : MARGIN + SIDE] = picture[MARGIN : MARGIN + SIDE, low : low + 1] = colour
        picture[low:high, MARGIN - 10 : MARGIN - 2] = colour
        if len(first) <= MOST_NAMES:
            write(picture, str(names[begin]), MARGIN + SIDE + 12, (low + high) / 2 + 5, 15, colour)
    return np.clip(picture, 0, 1)


def map_picture(places: np.ndarray, names: Sequence[str], classes: Sequence[str] | None = None) -> np.ndarray:
    """A picture (h,w,3) of points (n,2), with their names where these are few, in the colours of their classes."""
    picture = np.ones((SIDE + 2 * MARGIN, SIDE + 2 * MARGIN + LEGEND, 3))
    size = float(np.ptp(places, axis=0).max(initial=0)) or 1.0
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    at = MARGIN + SIDE / 2 + (places - middle) / size * [SIDE, -SIDE]
    kinds = sorted(set(classes)) if classes is not None else [""]
    for k, kind in enumerate(kinds):
        colour = COLOURS[k % len(COLOURS)]
        rows = [row for row in range(len(at)) if classes is None or classes[row] == kind]
        dots(picture, at[rows], colour, 5.0)
        if kind:
            write(picture, kind, SIDE + 2 * MARGIN, MARGIN + 22 * k, 16, colour)
    if len(at) <= MOST_NAMES and (classes is None or len(set(names)) == len(names)):
        for (x, y), name in zip(at, names, strict=True):
            write(picture, str(name), x + 8, y + 4, 11, (0.45, 0.45, 0.45))
    return np.clip(picture, 0, 1)
