"""Find what corresponds by functional maps: surfaces that differ by bending have nearly the same eigenfunctions.

A map of points is a small matrix C between the first eigenfunctions of the Laplacians (Ovsjanikov, Ben-Chen, Solomon,
Butscher, Guibas 2012). Points to matrix and matrix to points in turn, with a few functions more each time, make a rough
correspondence an exact one (Melzi, Ren, Rodola, Sharma, Wonka, Ovsjanikov 2019), wherever it started, as nothing stands
in its way: it need not be without folds in between.

Descriptors are functions, too: Gaussian means of the mean curvature at several scales along the surface, as saliency
has them (Lee, Varshney, Jacobs 2005), and the distance from the centroid, each scaled to a spread of one. They do not
change when a surface is turned or meshed otherwise.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh

from ..analysis.curvature import mean_curvature
from ..analysis.heat_means import HeatMeans
from ..analysis.saliency import unit_size
from ..linalg.sparse import Factor
from ..mesh.geometry import halfedge_lengths, laplacian_from_lengths, vertex_areas

# Eigenfunctions in the first round, in the last one, and how many more there are each time.
FEWEST = 12
MOST = 80
GROWTH = 4
# Shift of the spectrum of a surface of area 1, below its first value, 0.
SHIFT = 1e-2
# Weight of all landmarks together next to that of all points.
LANDMARK_WEIGHT = 0.2
# Points whose distances from all others are in memory at once.
CHUNK = 250
# Standard deviations of the descriptors' means over the diagonal.
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


def eigenfunctions(vertices: np.ndarray, triangles: np.ndarray, count: int = MOST) -> np.ndarray:
    """The first eigenfunctions (n,count) of the Laplacian of a surface (n,3), (m,3), of mean square 1 over its area.

    Fewer where there are not so many vertices. Their signs are any.
    """
    n = len(vertices)
    area = vertex_areas(vertices, triangles)
    mass = np.maximum(area, 1e-12 * area.max()) / area.sum()
    length = halfedge_lengths(vertices, triangles).reshape(-1, 3)
    stiffness = laplacian_from_lengths(length / np.sqrt(area.sum()), triangles, n, least=0)
    # Symmetric: M^-1/2 L M^-1/2, whose inverse is applied by one factor.
    root = np.sqrt(mass)
    factor = Factor(stiffness + SHIFT * sp.diags(mass))
    inverse = LinearOperator((n, n), matvec=lambda x: root * factor.solve(root * x.ravel()), dtype=float)
    start = np.cos(np.arange(n))
    value, vector = eigsh(inverse, min(count, n // 2), which="LA", v0=start, tol=1e-6)
    return vector[:, np.argsort(-value)] / root[:, None]


def refined_correspondence(
    source: np.ndarray, target: np.ndarray, start: np.ndarray, landmarks: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Rows (k,) of the target that correspond to points of the source, from a rough correspondence (k,).

    source (k,c), target (l,c): eigenfunctions at points of each; landmarks: values (j,c) of each at pairs
    """
    first, second = landmarks
    weight = np.sqrt(LANDMARK_WEIGHT * len(source) / max(len(first), 1))
    found = start
    for count in range(min(FEWEST, source.shape[1]), source.shape[1] + 1, GROWTH):
        rows = np.concatenate([target[found, :count], weight * second[:, :count]])
        images = np.concatenate([source[:, :count], weight * first[:, :count]])
        # source = target @ matrix, in the least squares.
        matrix = np.linalg.lstsq(rows, images, rcond=None)[0]
        found = _nearest(source[:, :count], target[:, :count] @ matrix)
    return found


def _nearest(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Rows (k,) of others (l,c) nearest to points (k,c): in so many dimensions no tree is faster than all products."""
    square = (others**2).sum(axis=1)
    parts = np.array_split(points, -(-len(points) // CHUNK))
    return np.concatenate([(square - 2 * (part @ others.T)).argmin(axis=1) for part in parts])
