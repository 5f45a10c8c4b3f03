"""Judge a match as Su 2015, section 4.3, does: difference of curvature, distortion of areas, and what is flipped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.curvature import mean_curvature
from ..analysis.heat_means import HeatMeans
from ..analysis.saliency import unit_size
from ..mesh.geometry import vertex_areas

# Standard deviation of the mean that curvature is taken over, over the diagonal.
SCALE = 0.02
# Ratios are cut off here, as the seed's are.
MOST = 5.0
BINS = 20


@dataclass(frozen=True)
class MatchFigures:
    """Histograms (BINS,) over ratios from 1 to MOST, shares of the area, and the means of the ratios.

    curvature: max(|c1 / c2|, |c2 / c1|) of the mean curvatures at a vertex and at its image; area: max(J, 1 / J), J the
    share of the area at a vertex over that of its image.
    """

    curvature: np.ndarray
    area: np.ndarray
    mean_curvature: float
    mean_area: float


def match_figures(
    source: tuple[np.ndarray, np.ndarray],
    target: tuple[np.ndarray, np.ndarray],
    image: tuple[np.ndarray, np.ndarray],
    positions: np.ndarray,
) -> MatchFigures:
    """Figures of a map of a source (n,3), (m,3) to a target (k,3), (l,3).

    image : triangles (n,) of the target and barycentric coordinates (n,3) of the source's vertices
    positions : (n,3) where they are
    """
    vertices, triangles = source
    own, other = _curvature(*source), _curvature(*target)
    faces, barycentric = image
    there = np.einsum("nc,nc->n", barycentric, other[target[1][faces]])
    area = vertex_areas(vertices, triangles)
    after = vertex_areas(positions, triangles)
    share, image_share = area / area.sum(), after / after.sum()
    curvature = _ratio(np.abs(own), np.abs(there))
    areas = _ratio(share, image_share)
    return MatchFigures(
        curvature=_histogram(curvature, share),
        area=_histogram(areas, share),
        mean_curvature=float(share @ curvature),
        mean_area=float(share @ areas),
    )


def _curvature(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mean curvature (n,) of a surface of unit size, smoothed a little along it."""
    positions = unit_size(vertices, triangles)
    return HeatMeans(positions, triangles, SCALE).means(mean_curvature(positions, triangles), np.array([SCALE]))[0]


def _ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The greater over the lesser (n,), at most MOST."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.where(high > 0, np.minimum(high / np.maximum(low, 1e-300), MOST), 1.0)


def _histogram(ratio: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Shares (BINS,) of the area."""
    return np.histogram(ratio, BINS, (1.0, MOST), weights=share)[0]
