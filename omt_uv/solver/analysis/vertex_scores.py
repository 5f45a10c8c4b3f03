"""Score vertices to paint with: saliency, curvature, sharp edges, distance; and make soft weights of scores."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..errors import EmptyMeshError, NoSelectionError, WeightError
from ..mesh.geometry import vertex_areas
from ..mesh.surface import with_loose_placed
from ..mesh.topology import halfedges, pair_keys, pair_up, previous_halfedge
from . import curvature
from .heat_means import HeatMeans
from .saliency import EPSILON, saliency, unit_size

# Scores there are.
KINDS = ("saliency", "gaussian", "mean", "sharpness", "distance")
# Curvature is averaged over so much of the diagonal: single vertices are noise.
SMOOTH = 3 * EPSILON
# Saliency jumps from vertex to vertex where the sign of its differences changes, and densities that jump shear.
SMOOTH_SALIENCY = 5 * EPSILON
# Densities of curvature, on a surface of unit size, below which there is none: planes have so much by the rounding of
# single precision. Round spheres have 12 and 3.5.
NO_CURVATURE = {"gaussian": 1e-3, "mean": 0.03}
# Scores that differ by less than this share of the largest are the same.
SAME = 1e-6


def vertex_score(
    kind: str, positions: np.ndarray, triangles: np.ndarray, selected: np.ndarray | None = None
) -> np.ndarray:
    """Score (n,) of the vertices of a surface (n,3), (m,3); greater is more. `selected` (n,) bool is for "distance".

    Raises
    ------
    EmptyMeshError : no triangles, or nothing selected to be near to
    NonFiniteError : a vertex of a triangle is nowhere
    """
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {kind!r}")
    if not len(triangles):
        raise EmptyMeshError("There are no faces to weigh", "Add some faces")
    positions = with_loose_placed(positions, triangles)
    if kind == "saliency":
        found = saliency(positions, triangles)
        means = HeatMeans(unit_size(positions, triangles), triangles, SMOOTH_SALIENCY)
        return means.means(found * means.area, np.array([SMOOTH_SALIENCY]))[0]
    if kind == "sharpness":
        return curvature.sharpness(positions, triangles)
    if kind == "distance":
        if selected is None or not selected[triangles].any():
            raise NoSelectionError("No vertex is selected to be near to")
        return -distance(positions, triangles, np.flatnonzero(selected))
    positions = unit_size(positions, triangles)
    amount = {"gaussian": curvature.gaussian_curvature, "mean": curvature.mean_curvature}[kind](positions, triangles)
    found = HeatMeans(positions, triangles, SMOOTH).means(np.abs(amount), np.array([SMOOTH]))[0]
    return found if found.max() > NO_CURVATURE[kind] else np.zeros(len(positions))


def soft_weights(values: np.ndarray, area: np.ndarray, low: float, high: float, invert: bool = False) -> np.ndarray:
    """Weights (n,) in [0,1] from scores (n,): 0 on the share `low` of the area (n,) with the least score, 1 above the
    share `high`, and a smooth step between; `invert` for the contrary.

    Raises
    ------
    WeightError : a range that is none, or scores that are the same everywhere
    """
    if not 0 <= low < high <= 1:
        raise WeightError(
            f"From {low:g} to {high:g} is no range", "Give two numbers between 0 and 1, the smaller first"
        )
    used = area > 0
    finite = used & np.isfinite(values)
    v, a = values[finite], area[finite]
    if not len(v) or np.ptp(v) <= SAME * np.abs(v).max():
        raise WeightError("The score is the same everywhere", "Choose another kind for this mesh")
    order = np.argsort(v, kind="stable")
    below = np.cumsum(a[order]) / a.sum()
    first, last = (float(v[order][min(np.searchsorted(below, q), len(v) - 1)]) for q in (low, high))
    if not last > first:
        # Most of the surface has one score, such as the flat faces of a machine.
        first, last = (first, float(v.max())) if v.max() > first else (float(v.min()), last)
    t = np.clip((np.where(np.isfinite(values), values, v.min()) - first) / (last - first), 0, 1)
    weights = t * t * (3 - 2 * t)
    return 1 - weights if invert else weights


def distance(positions: np.ndarray, triangles: np.ndarray, sources: np.ndarray) -> np.ndarray:
    """Distance (n,) along the surface from the nearest of the vertices `sources` (k,), infinite where there is no way.

    Shortest paths along edges and straight across pairs of triangles, less than a tenth too long on even meshes.
    """
    n = len(positions)
    tail, head = halfedges(triangles)
    a, b, across = _across(positions, triangles)
    rows, columns = np.concatenate([tail, a]), np.concatenate([head, b])
    length = np.concatenate([np.linalg.norm(positions[tail] - positions[head], axis=1), across])
    low, high = np.minimum(rows, columns), np.maximum(rows, columns)
    order = np.lexsort((length, high, low))
    low, high, length = low[order], high[order], length[order]
    first = np.concatenate([[True], (low[1:] != low[:-1]) | (high[1:] != high[:-1])])
    graph = csr_matrix((length[first], (low[first], high[first])), shape=(n, n))
    return dijkstra(graph, directed=False, indices=sources, min_only=True)


def _across(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of vertices opposite to a common edge, (p,), (p,), and their distance when both triangles are laid flat,
    where the straight line crosses the edge."""
    tail, head = halfedges(triangles)
    first, second = pair_up(pair_keys(tail, head))
    i, j = tail[first], head[first]
    opposite = [triangles.ravel()[previous_halfedge(h)] for h in (first, second)]
    edge = positions[j] - positions[i]
    length = np.maximum(np.linalg.norm(edge, axis=1), np.finfo(float).tiny)
    x, y = [], []
    for k in opposite:
        side = positions[k] - positions[i]
        along = (side * edge).sum(axis=1) / length
        x.append(along)
        y.append(np.sqrt(np.maximum((side**2).sum(axis=1) - along**2, 0)))
    total = np.maximum(y[0] + y[1], np.finfo(float).tiny)
    crossing = (x[0] * y[1] + x[1] * y[0]) / total
    inside = (crossing > 0) & (crossing < length)
    return opposite[0][inside], opposite[1][inside], np.hypot(x[0] - x[1], total)[inside]


def scaled_vertex_areas(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Area (n,) of every vertex of a surface (n,3), (m,3) scaled to unit size, finite at any scale."""
    return vertex_areas(unit_size(positions, triangles), triangles)
