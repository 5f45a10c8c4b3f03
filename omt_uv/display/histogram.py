"""How area error and shear are spread over the surface: two histograms in one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..pipelines.distortion import triangles_of
from ..pipelines.reading import Reading
from ..solver.maps.distortion import distortion, face_distortion
from ..solver.mesh.geometry import face_areas
from .canvas import write
from .colormaps import AREA_OCTAVES, SHEAR_TOP, area_colours, shear_colours

WIDTH, HEIGHT = 1200, 420
BINS = 41
PAPER, INK, GREY = (1.0, 1.0, 1.0), (0.13, 0.13, 0.13), (0.82, 0.82, 0.82)
AREA_TICKS = ((-2.0, "1/4"), (-1.0, "1/2"), (0.0, "as due"), (1.0, "2x"), (2.0, "4x"))
SHEAR_TICKS = ((0.0, "1"), (0.5, "2"), (1.0, "4"))


def histogram(readings: Sequence[Reading]) -> np.ndarray:
    """A picture (h,w,3) in [0,1] of the active UVs of the chosen polygons.

    Shares of the surface in percent over the texture that faces get, in octaves of what is due to them, and over
    their shear s1/s2, logarithmic. What lies beyond the ends of an axis is counted in its last bin.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : see `solver.maps.distortion.distortion`
    """
    octaves, shear, share, figures = _values(readings)
    picture = np.ones((HEIGHT, WIDTH, 3)) * PAPER
    half = WIDTH // 2
    error = f"Area error {100 * figures.area_l1:.2f} %, {figures.folds} folded faces"
    _plot(picture, 0, half, _area_place(octaves), share,
          _area_scale,
          [(x / (2 * AREA_OCTAVES) + 0.5, text) for x, text in AREA_TICKS],
          error, "texture that a face gets, over what is due to it")  # fmt: skip
    stretch = f"Mean shear {figures.angle_mean:.3f}, 99 % within {figures.angle_p99:.2f}"
    _plot(picture, half, WIDTH, _shear_place(shear), share,
          _shear_scale, SHEAR_TICKS, stretch, "shear s1/s2, 1 keeps angles")  # fmt: skip
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
    for top, place, scale in ((0, _area_place(octaves), _area_scale), (half, _shear_place(shear), _shear_scale)):
        count, _ = np.histogram(np.clip(place, 0, 1), BINS, (0, 1), weights=share)
        foot = top + half - 3 * thick
        edges = np.round(np.linspace(0, size, BINS + 1)).astype(int)
        rgb = scale((np.arange(BINS) + 0.5) / BINS)
        for k, height in enumerate(np.round(count / count.max() * (foot - top - thick)).astype(int)):
            picture[foot - height : foot, edges[k] : edges[k + 1] - 1] = (*rgb[k], 1.0)
        picture[foot + thick // 2 : foot + 2 * thick] = np.column_stack([scale(np.linspace(0, 1, size)), np.ones(size)])
    return picture


def _values(readings: Sequence[Reading]):
    """Octaves (m,), shear (m,) and share of the surface in percent (m,) of every face, and the figures of all."""
    V, F, uv = triangles_of(readings)
    octaves, shear = face_distortion(V, F, uv)
    weight = face_areas(V, F)
    return octaves, shear, 100 * weight / weight.sum(), distortion(V, F, uv, overlap=False)


def _area_place(octaves):
    return octaves / (2 * AREA_OCTAVES) + 0.5


def _area_scale(place):
    return area_colours((2 * place - 1) * AREA_OCTAVES)


def _shear_place(shear):
    return np.log(np.maximum(shear, 1)) / np.log(SHEAR_TOP)


def _shear_scale(place):
    return shear_colours(SHEAR_TOP**place)


def _plot(picture, left: int, right: int, value, share, colours: Callable, ticks, title: str, axis: str) -> None:
    """One histogram of values (m,) in [0,1] with weights (m,) in percent, between two columns of the picture."""
    x0, x1, y0, y1 = left + 80, right - 30, 64, HEIGHT - 78
    count, _ = np.histogram(np.clip(value, 0, 1), BINS, (0, 1), weights=share)
    top = _round_up(count.max())
    for k in range(5):
        y = round(y1 - (y1 - y0) * k / 4)
        picture[y, x0:x1] = GREY
        write(picture, f"{top * k / 4:g}", x0 - 10, y + 5, 18, INK, "right")
    edges = np.round(np.linspace(x0, x1, BINS + 1)).astype(int)
    rgb = colours((np.arange(BINS) + 0.5) / BINS)
    for k, height in enumerate(count / top):
        bar = round((y1 - y0) * height)
        if bar:
            # A dark rim keeps pale bars visible on paper.
            picture[y1 - bar : y1, edges[k] : edges[k + 1] - 1] = 0.55 * rgb[k]
            picture[y1 - bar + 1 : y1, edges[k] + 1 : edges[k + 1] - 2] = rgb[k]
    picture[y1 : y1 + 2, x0:x1] = INK
    picture[y1 + 8 : y1 + 16, x0:x1] = colours(np.linspace(0, 1, x1 - x0))
    for place, text in ticks:
        write(picture, text, x0 + place * (x1 - x0), y1 + 36, 18, INK, "middle")
    write(picture, title, (x0 + x1) / 2, 34, 22, INK, "middle")
    write(picture, axis, (x0 + x1) / 2, HEIGHT - 14, 18, INK, "middle")
    write(picture, "% of the surface", x0 - 62, y0 - 14, 16, INK)


def _round_up(value: float) -> float:
    """The next greater of 1, 2, 4, 8 times a power of ten."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(k * power for k in (1, 2, 4, 8, 10, 20) if k * power >= value))
