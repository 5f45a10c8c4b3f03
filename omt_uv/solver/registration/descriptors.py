"""Describe the places of a surface by functions that do not change when it is turned or meshed otherwise.

Gaussian means of the mean curvature at several scales along the surface, as saliency has them (Lee, Varshney, Jacobs
2005), and the distance from the centroid, each scaled to a spread of one.
"""

from __future__ import annotations

import numpy as np

from ..analysis.curvature import mean_curvature
from ..analysis.heat_means import HeatMeans
from ..analysis.saliency import unit_size
from ..mesh.geometry import vertex_areas

# Standard deviations of the means over the diagonal.
SCALES = np.array([0.02, 0.04, 0.08])
# Values beyond this many spreads are no more telling.
MOST_SPREADS = 3.0


def descriptors(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Functions (n,4) of the vertices of a surface (n,3), (m,3)."""
    positions = unit_size(vertices, triangles)
    heat = HeatMeans(positions, triangles, float(SCALES[1]))
    means = heat.means(mean_curvature(positions, triangles), SCALES)
    values = np.column_stack([*means, np.linalg.norm(positions, axis=1)])
    area = vertex_areas(positions, triangles)
    share = area / area.sum()
    values = values - share @ values
    spread = np.sqrt(share @ values**2)
    return np.clip(values / np.maximum(spread, 1e-12), -MOST_SPREADS, MOST_SPREADS)
