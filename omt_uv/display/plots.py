"""Draw curves of figures over the number of faces, both logarithmic, with the slope of each; needs no display."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from .canvas import write

# Pixels of a plot, and its margins: left, right, top, bottom.
WIDTH = 840
HEIGHT = 460
LEFT = 96
RIGHT = 224
TOP = 56
BOTTOM = 64
INK = (0.13, 0.13, 0.13)
GREY = (0.88, 0.88, 0.88)
# Colours that are told apart by most eyes (Okabe, Ito 2008).
COLOURS = ((0.0, 0.45, 0.70), (0.84, 0.37, 0.0), (0.0, 0.62, 0.45), (0.80, 0.47, 0.65), (0.90, 0.62, 0.0),
           (0.34, 0.71, 0.91))  # fmt: skip
DOT = 3.5
THIN = 1.2

Curves = Mapping[str, Sequence[tuple[float, float]]]


def slope(points: Sequence[tuple[float, float]]) -> float:
    """p of y ~ x^p by least squares of the logarithms; NaN for fewer than two different x."""
    known = np.log(np.array([p for p in points if p[0] > 0 and p[1] > 0]).reshape(-1, 2))
    if len(known) < 2 or np.ptp(known[:, 0]) == 0:
        return float("nan")
    return float(np.polyfit(known[:, 0], known[:, 1], 1)[0])


def plot(curves: Curves, title: str, cloud: bool = False, below: str = "faces") -> np.ndarray:
    """A picture (h,w,3) in [0,1] of curves: points (x, y) > 0 by name; a cloud is points without lines;
    below : what x is."""
    picture = np.ones((HEIGHT, WIDTH, 3))
    points = np.array([p for curve in curves.values() for p in curve if p[0] > 0 and p[1] > 0]).reshape(-1, 2)
    if not len(points):
        write(picture, "nothing to draw", WIDTH / 2, HEIGHT / 2, 18, INK, "middle")
        return picture
    low, high = np.log10(points.min(0)), np.log10(points.max(0))
    room = np.maximum(0.06 * (high - low), 0.03)
    low, high = low - room, high + room
    size = np.array([WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM])

    def place(point: np.ndarray) -> np.ndarray:
        return (np.log10(point) - low) / (high - low) * size * [1, -1] + [LEFT, HEIGHT - BOTTOM]

    _axes(picture, low, high, place)
    for k, (name, curve) in enumerate(curves.items()):
        colour = COLOURS[k % len(COLOURS)]
        known = sorted(p for p in curve if p[0] > 0 and p[1] > 0)
        at = np.array([place(np.array(p)) for p in known]).reshape(-1, 2)
        if not cloud:
            _lines(picture, at, colour)
        dots(picture, at, colour, 1.8 if cloud else DOT)
        exponent = slope(known)
        text = name if np.isnan(exponent) else f"{name}  {exponent:+.2f}"
        write(picture, text, WIDTH - RIGHT + 14, TOP + 16 + 22 * k, 15, colour)
    write(picture, title, LEFT + size[0] / 2, 32, 20, INK, "middle")
    write(picture, below, LEFT + size[0] / 2, HEIGHT - 16, 16, INK, "middle")
    return np.clip(picture, 0, 1)


def _axes(picture: np.ndarray, low: np.ndarray, high: np.ndarray, place) -> None:
    """Lines of a grid at 1, 2, 5 times powers of ten, with numbers."""
    for axis in (0, 1):
        powers = np.arange(np.floor(low[axis]), np.ceil(high[axis]) + 1)
        ticks = np.concatenate([np.log10([1, 2, 5]) + p for p in powers])
        for tick in ticks[(ticks >= low[axis]) & (ticks <= high[axis])]:
            point = np.where(np.arange(2) == axis, 10**tick, 10**low)
            x, y = np.round(place(point)).astype(int)
            if axis == 0:
                picture[TOP : HEIGHT - BOTTOM, x] = GREY
                write(picture, f"{10**tick:g}", x, HEIGHT - BOTTOM + 20, 13, INK, "middle")
            else:
                picture[y, LEFT : WIDTH - RIGHT] = GREY
                write(picture, f"{10**tick:.3g}", LEFT - 8, y + 5, 13, INK, "right")
    picture[TOP : HEIGHT - BOTTOM, LEFT] = INK
    picture[HEIGHT - BOTTOM, LEFT : WIDTH - RIGHT] = INK


def _lines(picture: np.ndarray, at: np.ndarray, colour) -> None:
    """Straight lines between points (k,2) one after the other."""
    for a, b in pairwise(at):
        steps = max(int(np.abs(b - a).max()), 1)
        dots(picture, a + (b - a) * np.linspace(0, 1, steps + 1)[:, None], colour, THIN)


def dots(picture: np.ndarray, at: np.ndarray, colour, radius: float) -> None:
    """Discs around points (k,2), smooth at the edge."""
    reach = int(np.ceil(radius + 1))
    for x, y in at:
        left, top = int(x) - reach, int(y) - reach
        rows, columns = slice(max(top, 0), top + 2 * reach + 1), slice(max(left, 0), left + 2 * reach + 1)
        part = picture[rows, columns]
        v, u = np.mgrid[rows.start : rows.start + part.shape[0], columns.start : columns.start + part.shape[1]]
        cover = np.clip(radius + 0.5 - np.hypot(u + 0.5 - x, v + 0.5 - y), 0, 1)[..., None]
        part += cover * (np.array(colour) - part)
