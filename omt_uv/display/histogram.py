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
# What is written below the axes, at octaves, and at places along the axis.
AREA_TICKS = ((-2.0, "1/4"), (-1.0, "1/2"), (0.0, "as due"), (1.0, "2x"), (2.0, "4x"))
SHEAR_TICKS = ((0.0, "1"), (0.5, "2"), (1.0, "4"))


@dataclass(frozen=True)
class _Axis:
    """What a histogram counts: colours (k,3) of places (k,) along its axis in [0,1], ticks, and its name."""

    colours: Callable[[np.ndarray], np.ndarray]
    ticks: Sequence[tuple[float, str]]
    name: str


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
    left, right = picture[:, : WIDTH // 2], picture[:, WIDTH // 2 :]
    area_ticks = [(float(_area_place(x)), text) for x, text in AREA_TICKS]
    area = _Axis(_area_scale, area_ticks, "texture that a face gets, over what is due to it")
    _plot(
        left,
        _area_place(octaves),
        share,
        area,
        f"Area error {100 * figures.area_l1:.2f} %, {figures.folds} folded faces",
    )
    title = f"Mean shear {figures.angle_mean:.3f}, 99 % within {figures.angle_p99:.2f}"
    _plot(right, _shear_place(shear), share, _Axis(_shear_scale, SHEAR_TICKS, "shear s1/s2, 1 keeps angles"), title)
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
    """Octaves (m,), shear (m,) and share of the surface in percent (m,) of every triangle, the first two
    those of its polygon, and the figures of all."""
    found = triangles_of(readings)
    V, F, uv, polygons = found.positions, found.triangles, found.uv, found.polygons
    octaves, shear = face_distortion(V, F, uv, polygons)
    weight = polygon_areas(V, F, polygons)
    return octaves, shear, 100 * weight / weight.sum(), distortion(V, F, uv, overlap=False, polygons=polygons)


def _area_place(octaves):
    """Places along the axis, in [0,1] as far as it reaches, of octaves."""
    return octaves / (2 * AREA_OCTAVES) + 0.5


def _area_scale(place):
    """Colours (k,3) of places (k,) along the axis of areas."""
    return area_colours((2 * place - 1) * AREA_OCTAVES)


def _shear_place(shear):
    """Places along the axis, in [0,1] as far as it reaches, of shear."""
    return np.log(np.maximum(shear, 1)) / np.log(SHEAR_TOP)


def _shear_scale(place):
    """Colours (k,3) of places (k,) along the axis of shear."""
    return shear_colours(SHEAR_TOP**place)


def _plot(picture: np.ndarray, place: np.ndarray, share: np.ndarray, axis: _Axis, title: str) -> None:
    """Draw the histogram of places (m,) in [0,1] with shares (m,) in percent into a picture (h,w,3)."""
    height, width = picture.shape[:2]
    x0, x1, y0, y1 = 80, width - 30, 64, height - 78
    count, _ = np.histogram(np.clip(place, 0, 1), BINS, (0, 1), weights=share)
    top = _round_up(count.max())
    for k in range(5):
        y = round(y1 - (y1 - y0) * k / 4)
        picture[y, x0:x1] = GREY
        write(picture, f"{top * k / 4:g}", x0 - 10, y + 5, 18, INK, "right")
    edges = np.round(np.linspace(x0, x1, BINS + 1)).astype(int)
    rgb = axis.colours((np.arange(BINS) + 0.5) / BINS)
    for k, part in enumerate(count / top):
        bar = round((y1 - y0) * part)
        if bar:
            # A dark edge keeps pale bars visible on paper.
            picture[y1 - bar : y1, edges[k] : edges[k + 1] - 1] = 0.55 * rgb[k]
            picture[y1 - bar + 1 : y1, edges[k] + 1 : edges[k + 1] - 2] = rgb[k]
    picture[y1 : y1 + 2, x0:x1] = INK
    picture[y1 + 8 : y1 + 16, x0:x1] = axis.colours(np.linspace(0, 1, x1 - x0))
    for tick, text in axis.ticks:
        write(picture, text, x0 + tick * (x1 - x0), y1 + 36, 18, INK, "middle")
    write(picture, title, (x0 + x1) / 2, 34, 22, INK, "middle")
    write(picture, axis.name, (x0 + x1) / 2, height - 14, 18, INK, "middle")
    write(picture, "% of the surface", x0 - 62, y0 - 14, 16, INK)


def _round_up(value: float) -> float:
    """The next greater of 1, 2, 4, 8 times a power of ten."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(k * power for k in (1, 2, 4, 8, 10, 20) if k * power >= value))
