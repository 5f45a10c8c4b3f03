"""Measure saliency, mean curvature that differs from its surroundings, at several scales (Lee, Varshney, Jacobs 2005).

Gaussian means are taken along the surface, by heat, and not within balls in space: they do not leak across thin parts,
and all scales come from one factorisation. Sizes are relative to the spread of the surface about its centroid, which,
unlike a bounding box, does not change when it is turned.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import face_areas
from ..mesh.topology import halfedges
from .curvature import mean_curvature
from .heat_means import HeatMeans

# Scales, in multiples of EPSILON times the diagonal (section 3.1 and 4: epsilon is 0.3 % of it).
SCALES = np.array([2.0, 3.0, 4.0, 5.0, 6.0])
EPSILON = 0.003
# A map that is nowhere larger, over the diagonal, is the mesh and not the shape: a sphere has 3.5.
NOISE = 0.25
# Maxima below this share of the greatest are none.
MINOR = 1e-3
# Neighbours that differ by less are equal, whichever is greater in the last digit.
EQUAL = 1e-9


def saliency(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Saliency (n,) >= 0 of the vertices of a surface (n,3), (m,3), independent of its place, direction and size.

        sum over s of S(|G(H, s) - G(H, 2 s)|),   S(x) = x (max x - mean of local maxima of x)^2,   max x = 1

    with G the Gaussian mean and H the mean curvature. Zero on planes and round spheres.
    """
    return saliency_of(curvature_means(unit_size(positions, triangles), triangles), triangles)


def curvature_means(positions: np.ndarray, triangles: np.ndarray) -> dict[float, np.ndarray]:
    """Gaussian means (n,) of the mean curvature of a surface of unit size (n,3), (m,3), by their scale in EPSILON."""
    heat = HeatMeans(positions, triangles, 6 * EPSILON)
    sigmas = np.unique(np.concatenate([SCALES, 2 * SCALES]))
    return dict(zip(sigmas.tolist(), heat.means(mean_curvature(positions, triangles), EPSILON * sigmas), strict=True))


def saliency_of(means: dict[float, np.ndarray], triangles: np.ndarray) -> np.ndarray:
    """Saliency (n,) of a surface with triangles (m,3) from its `curvature_means`."""
    total = np.zeros(len(means[SCALES[0]]))
    for scale in SCALES.tolist():
        total += _suppressed(np.abs(means[scale] - means[2 * scale]), triangles)
    return total


def unit_size(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Positions (n,3) about the centroid, in units of the diagonal of a box as large as the surface.

    A sphere is 2 sqrt(3) times its spread across the diagonal of its box, and most shapes nearly so.
    """
    used = positions[np.unique(triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    extent = 2 * float((high / 2 - low / 2).max())
    moved = (positions - (low / 2 + high / 2)) / extent
    area = face_areas(moved, triangles)
    centre = moved[triangles].mean(axis=1)
    middle = area @ centre / area.sum()
    # With what is spread within the triangles: a single one has a size, too.
    within = ((moved[triangles] - centre[:, None]) ** 2).sum(axis=(1, 2)) / 12
    spread = np.sqrt(area @ (((centre - middle) ** 2).sum(axis=1) + within) / area.sum())
    return (moved - middle) / (2 * np.sqrt(3) * spread)


def _suppressed(x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A map (n,) scaled to 1 at most and weakened the more the more peaks of the same height it has."""
    top = float(x.max())
    if not top > NOISE:
        return np.zeros(len(x))
    x = x / top
    highest = np.zeros(len(x))
    tail, head = halfedges(triangles)
    np.maximum.at(highest, tail, x[head])
    np.maximum.at(highest, head, x[tail])
    peak = (x >= highest * (1 - EQUAL)) & (x > MINOR) & (x < 1 - EQUAL)
    others = float(x[peak].mean()) if peak.any() else 0.0
    return x * (1 - others) ** 2
