"""Find where a cut should reach: the points that a flat map would distort most (Ben-Chen, Gotsman, Bunin 2008).

With the logarithm u of its length scale held at 0 on the boundary, a flat conformal metric solves
Laplacian(u) = curvature to first order (Ben-Chen, Gotsman, Bunin 2008, equation 5). Ears, limbs and noses, which hold
much curvature far from the boundary, are where |u| peaks; a cut to the peak takes it away.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..linalg.sparse import solve_spd
from ..mesh.geometry import (
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    halfedge_lengths,
    laplacian_from_lengths,
    vertex_areas,
)
from ..mesh.topology import halfedges
from .component import NOISE, CutComponent
from .cut_graph import cut_boundary, cut_classes

# A further cut does not pay where the lengths of a flat map are predicted to be off by a factor of e^0.5 at most,
# in the mean square over the surface.
BEARABLE = 0.5**2


def log_scale(component: CutComponent, cut: np.ndarray) -> np.ndarray:
    """Predicted |log scale| (n,) of a flat map of the component cut open along edges (e,) bool; the largest of copies.

    On a closed surface without a cut its mean is 0, and it is largest at the sharpest extremity.
    """
    classes = cut_classes(component, cut)
    n = int(classes.max()) + 1
    tail, head = halfedges(classes)
    boundary = cut_boundary(component, cut)
    fixed = np.zeros(n, dtype=bool)
    fixed[tail[boundary]] = fixed[head[boundary]] = True
    length = halfedge_lengths(component.positions, component.triangles).reshape(-1, 3)
    curvature = angle_defects(classes, angles_from_lengths(length), np.flatnonzero(fixed), n)
    matrix = laplacian_from_lengths(length, classes, n, LEAST_STIFFNESS)
    if not fixed.any():
        curvature = curvature - curvature.mean()
        fixed[int(np.argmin(curvature))] = True
    u = np.zeros(n)
    u[~fixed] = solve_spd(matrix[~fixed][:, ~fixed].tocsc(), curvature[~fixed])
    at_vertex = np.zeros(component.vertex_count)
    np.maximum.at(at_vertex, component.triangles.ravel(), np.abs(u)[classes.ravel()])
    return at_vertex


def spread(component: CutComponent, scale: np.ndarray) -> float:
    """Mean square over the surface of a log scale (n,)."""
    area = vertex_areas(component.positions, component.triangles)
    return float(area @ scale**2 / area.sum())


def first_tips(component: CutComponent) -> np.ndarray:
    """The sharpest extremity of a sphere and the vertex farthest from it, (2,); (3,) if they are neighbours.

    A slit of a single edge would not open anything.
    """
    scale = log_scale(component, np.zeros(len(component.pair), dtype=bool))
    tips = farthest(component, np.array([peak(scale * component.tip_factor())]), 1)
    neighbours = (np.sort(component.ends, axis=1) == np.sort(tips)).all(axis=1).any()
    return farthest(component, tips, 1) if neighbours else tips


def farthest(component: CutComponent, points: np.ndarray, more: int) -> np.ndarray:
    """The points (k,) and `more` others, each as far from those before it as the edges go."""
    for _ in range(more):
        points = np.append(points, peak(edge_distance(component, points) * component.tip_factor()))
    return points


def edge_distance(component: CutComponent, vertices: np.ndarray) -> np.ndarray:
    """Cost (n,) of the cheapest path from the vertices (k,)."""
    return dijkstra(component.graph, indices=vertices, min_only=True)


def peak(value: np.ndarray) -> int:
    """Vertex of the largest value (n,) >= 0; on symmetric models rounding shall not choose between equals."""
    return int(np.argmax(value * (1 + NOISE * np.random.default_rng(0).random(len(value)))))
