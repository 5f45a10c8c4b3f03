"""Find where a cut should reach: the points that a flat map would distort most (Ben-Chen, Gotsman, Bunin 2008).

With the logarithm u of its length scale held at 0 on the boundary, a flat conformal metric solves
Laplacian(u) = curvature to first order (Ben-Chen, Gotsman, Bunin 2008, equation 5). Ears, limbs and noses, which hold
much curvature far from the boundary, are where |u| peaks; a cut to the peak takes it away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..conformal.disk_map import conformal_disk
from ..errors import PrecisionError
from ..linalg.sparse import solve_spd
from ..mesh.geometry import (
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    face_areas,
    halfedge_lengths,
    laplacian_from_lengths,
    signed_areas,
    vertex_areas,
)
from ..mesh.topology import halfedges
from ..progress import drain
from .component import NOISE, CutComponent
from .cut_graph import cut_boundary, cut_classes

# A further cut does not pay where the lengths of a flat map are predicted to be off by a factor of e^0.5 at most,
# in the mean square over the surface.
BEARABLE = 0.5**2


def log_scale(component: CutComponent, cut: np.ndarray) -> np.ndarray:
    """Predicted |log scale| (n,) of a flat map of the component cut open along edges (e,) bool; the largest of copies.

    On a closed surface without a cut its mean is 0, and it is largest at the sharpest extremity.
    """
    # What a cut parts is held at 0 on either side: all that is solved for lies inside, as it was before the cut.
    curvature, fixed = component.curvature, component.on_boundary()
    fixed[component.ends[cut].ravel()] = True
    if not fixed.any():
        curvature = curvature - curvature.mean()
        fixed = np.arange(len(curvature)) == np.argmin(curvature)
    return np.abs(_solved(component.laplacian, curvature, fixed))


def outline_spread(component: CutComponent, cut: np.ndarray) -> float:
    """Predicted mean square over the surface of the log scale of a flat map of the component, cut to a disk along edges
    (e,) bool, onto a round disk: the curvature of its boundary goes where the circle is as long as it."""
    metric = _Metric.of(component, cut)
    n, area = len(metric.curvature), face_areas(component.positions, component.triangles)
    around = np.bincount(metric.ends.ravel(), np.repeat(metric.end_lengths, 2), n)
    curvature = metric.curvature - 2 * np.pi * around / around.sum()
    u = _solved(metric.matrix, curvature - curvature.mean(), np.arange(n) == 0)
    share = np.bincount(metric.classes.ravel(), np.repeat(area, 3), n) / (3 * area.sum())
    return float(share @ (u - share @ u) ** 2)


def disk_spread(component: CutComponent, cut: np.ndarray) -> float:
    """What `outline_spread` predicts, of the conformal map itself; infinite where that leaves double precision."""
    classes = cut_classes(component, cut)
    positions = np.zeros((int(classes.max()) + 1, 3))
    positions[classes] = component.positions[component.triangles]
    try:
        uv = drain(conformal_disk(positions, classes)).uv
    except PrecisionError:
        return np.inf
    area, mapped = face_areas(positions, classes), np.abs(signed_areas(uv, classes))
    if not (mapped > 0).all():
        return np.inf
    scale, share = np.log(mapped / area) / 2, area / area.sum()
    return float(share @ (scale - share @ scale) ** 2)


@dataclass(frozen=True)
class _Metric:
    """A component cut open: its vertices as classes (m,3), their curvature (n,), the boundary's edges by their ends
    (b,2) and how long they are (b,), and the Laplacian (n,n)."""

    classes: np.ndarray
    curvature: np.ndarray
    ends: np.ndarray
    end_lengths: np.ndarray
    matrix: csr_matrix

    @staticmethod
    def of(component: CutComponent, cut: np.ndarray) -> _Metric:
        """That of a component cut open along edges (e,) bool."""
        classes = cut_classes(component, cut)
        n, length = int(classes.max()) + 1, halfedge_lengths(component.positions, component.triangles)
        boundary = cut_boundary(component, cut)
        ends = np.column_stack([side[boundary] for side in halfedges(classes)])
        open_there, sides = np.zeros(n, dtype=bool), length.reshape(-1, 3)
        open_there[ends] = True
        return _Metric(
            classes=classes,
            curvature=angle_defects(classes, angles_from_lengths(sides), np.flatnonzero(open_there), n),
            ends=ends,
            end_lengths=length[boundary],
            matrix=laplacian_from_lengths(sides, classes, n, LEAST_STIFFNESS),
        )


def _solved(laplacian: csr_matrix, curvature: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """The log scale (n,) that flattens a curvature (n,), 0 where it is fixed (n,) bool."""
    u = np.zeros(len(curvature))
    u[~fixed] = solve_spd(laplacian[~fixed][:, ~fixed].tocsc(), curvature[~fixed])
    return u


def spread(component: CutComponent, scale: np.ndarray) -> float:
    """Mean square over the surface of a log scale (n,); 0 where it has no area."""
    area = vertex_areas(component.positions, component.triangles)
    return float(area @ scale**2 / max(area.sum(), 1e-300))


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
