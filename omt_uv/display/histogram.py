"""Draw how area error and shear are spread over the surface: two histograms in one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..pipelines.distortion import triangles_of
from ..pipelines.reading import Reading
from ..solver.maps.distortion import distortion, face_distortion
from ..solver.mesh.polygon_areas import polygon_areas
from .canvas import write
from .colormaps import AREA_OCTAVES, SHEAR_TOP, area_colours, shear_colours

# Pixels of the picture.
WIDTH = 1200
HEIGHT = 420
# Bars of a histogram; odd, so that one of them stands for areas as they are due.
BINS = 41
# Colours, sRGB in [0,1].
PAPER = (1.0, 1.0, 1.0)
INK = (0.13, 0.13, 0.13)
GREY = (0.82, 0.82, 0.82)
# Share of the surface that an axis reaches over, as far as `MOST_OCTAVES`.
REACHED = 0.99
MOST_OCTAVES = 10
# Words below an axis at most, beside that in the middle or at the start.
MOST_TICKS = 4


@dataclass(frozen=True)
class _Axis:
    """What a histogram counts: octaves from `low` to `high`, colours (k,3) of octaves (k,), words, and its name."""

    low: int
    high: int
    colours: Callable[[np.ndarray], np.ndarray]
    ticks: Sequence[tuple[float, str]]
    name: str

    def places(self, octaves):
        """Places along the axis, in [0,1] as far as it reaches, of octaves."""
        return (octaves - self.low) / (self.high - self.low)

    def scale(self, place):
        """Colours (k,3) of places (k,) along the axis."""
        return self.colours(self.low + place * (self.high - self.low))


def histogram(readings: Sequence[Reading]) -> np.ndarray:
    """A picture (h,w,3) in [0,1] of the active UVs of the chosen polygons.

    Shares of the surface in percent over the texture that faces get, in octaves of what is due to them, and over
    their shear s1/s2, logarithmic. Axes reach over 99 % of the surface; what lies beyond is counted in the last bin.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : see `solver.maps.distortion.distortion`
    """
    octaves, shear, share, figures = _values(readings)
    picture = np.ones((HEIGHT, WIDTH, 3)) * PAPER
    left, right = picture[:, : WIDTH // 2], picture[:, WIDTH // 2 :]
    title = f"Area error {100 * figures.area_l1:.2f} %, {figures.folds} folded faces"
    _plot(left, octaves, share, area_axis(octaves, share), title)
    title = f"Mean shear {figures.angle_mean:.3f}, 99 % within {figures.angle_p99:.2f}"
    _plot(right, np.log2(np.maximum(shear, 1)), share, shear_axis(shear, share), title)
    return picture


def thumbnail(readings: Sequence[Reading], size: int = 256) -> np.ndarray:
    """Both histograms without words, one above the other, (size,size,4) in [0,1] on a transparent ground.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : see `histogram`
    """
    octaves, shear, share, _ = _values(readings)
    picture = np.zeros((size, size, 4))
    half, thick = size // 2, size // 24
    pairs = ((octaves, area_axis(octaves, share)), (np.log2(np.maximum(shear, 1)), shear_axis(shear, share)))
    for top, (values, axis) in zip((0, half), pairs, strict=True):
        scale = axis.scale
        count, _ = np.histogram(np.clip(axis.places(values), 0, 1), BINS, (0, 1), weights=share)
        foot = top + half - 3 * thick
        edges = np.round(np.linspace(0, size, BINS + 1)).astype(int)
        rgb = scale((np.arange(BINS) + 0.5) / BINS)
        for k, height in enumerate(np.round(count / count.max() * (foot - top - thick)).astype(int)):
            picture[foot - height : foot, edges[k] : edges[k + 1] - 1] = (*rgb[k], 1.0)
        picture[foot + thick // 2 : foot + 2 * thick] = np.column_stack([scale(np.linspace(0, 1, size)), np.ones(size)])
    return picture


def _values(readings: Sequence[Reading]):
    """Octaves (m,), shear (m,) and share of the surface in percent (m,) of every triangle, the first two
    those of its polygon, and the figures of all."""
    found = triangles_of(readings)
    V, F, uv, polygons = found.positions, found.triangles, found.uv, found.polygons
    octaves, shear = face_distortion(V, F, uv, polygons)
    weight = polygon_areas(V, F, polygons)
    return octaves, shear, 100 * weight / weight.sum(), distortion(V, F, uv, overlap=False, polygons=polygons)


def area_axis(octaves: np.ndarray, share: np.ndarray) -> _Axis:
    """An axis for octaves (m,) of area of faces with these shares (m,): two each way, or as many as it takes."""
    end = _reach(np.abs(octaves), share, round(AREA_OCTAVES))
    step = -(-end // (MOST_TICKS // 2))
    ticks = [(float(k), "as due" if k == 0 else f"{2**k}x" if k > 0 else f"1/{2**-k}") for k in _around(end, step)]
    return _Axis(-end, end, area_colours, ticks, "texture that a face gets, over what is due to it")


def shear_axis(shear: np.ndarray, share: np.ndarray) -> _Axis:
    """An axis for the shear (m,) of faces with these shares (m,): to 4, or as far as it takes."""
    end = _reach(np.log2(np.maximum(shear, 1)), share, round(float(np.log2(SHEAR_TOP))))
    ticks = [(float(k), f"{2**k}") for k in range(0, end + 1, -(-end // MOST_TICKS))]
    return _Axis(0, end, lambda octaves: shear_colours(2.0**octaves), ticks, "shear s1/s2, 1 keeps angles")


def _around(end: int, step: int) -> list[int]:
    """Whole numbers from -end to end, so far apart, with 0."""
    return [*range(-(end // step) * step, 0, step), *range(0, end + 1, step)]


def _reach(octaves: np.ndarray, share: np.ndarray, least: int) -> int:
    """Octaves within which `REACHED` of the surface is, a whole number from `least` to `MOST_OCTAVES`."""
    order = np.argsort(octaves)
    total = np.cumsum(share[order])
    reached = octaves[order][min(np.searchsorted(total, REACHED * total[-1]), len(order) - 1)]
    # A face that stands for nothing but rounding shall not move an end.
    return int(np.clip(np.ceil(reached - 1e-6), least, MOST_OCTAVES))


def _plot(picture: np.ndarray, octaves: np.ndarray, share: np.ndarray, axis: _Axis, title: str) -> None:
    """Draw the histogram of octaves (m,) with shares (m,) in percent into a picture (h,w,3)."""
    height, width = picture.shape[:2]
    x0, x1, y0, y1 = 80, width - 30, 64, height - 78
    count, _ = np.histogram(np.clip(axis.places(octaves), 0, 1), BINS, (0, 1), weights=share)
    top = _round_up(count.max())
    for k in range(5):
        y = round(y1 - (y1 - y0) * k / 4)
        picture[y, x0:x1] = GREY
        write(picture, f"{top * k / 4:g}", x0 - 10, y + 5, 18, INK, "right")
    edges = np.round(np.linspace(x0, x1, BINS + 1)).astype(int)
    rgb = axis.scale((np.arange(BINS) + 0.5) / BINS)
    for k, part in enumerate(count / top):
        bar = round((y1 - y0) * part)
        if bar:
            # A dark edge keeps pale bars visible on paper.
            picture[y1 - bar : y1, edges[k] : edges[k + 1] - 1] = 0.55 * rgb[k]
            picture[y1 - bar + 1 : y1, edges[k] + 1 : edges[k + 1] - 2] = rgb[k]
    picture[y1 : y1 + 2, x0:x1] = INK
    picture[y1 + 8 : y1 + 16, x0:x1] = axis.scale(np.linspace(0, 1, x1 - x0))
    for tick, text in axis.ticks:
        write(picture, text, x0 + axis.places(tick) * (x1 - x0), y1 + 36, 18, INK, "middle")
    write(picture, title, (x0 + x1) / 2, 34, 22, INK, "middle")
    write(picture, axis.name, (x0 + x1) / 2, height - 14, 18, INK, "middle")
    write(picture, "% of the surface", x0 - 62, y0 - 14, 16, INK)


def _round_up(value: float) -> float:
    """The next greater of 1, 2, 4, 8 times a power of ten."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(k * power for k in (1, 2, 4, 8, 10, 20) if k * power >= value))
