"""Vertices moved so that the triangles between them come closer to the surface.

A round takes the closest points of samples of both the surface and the mesh, and moves the vertices so that the
distances along the lines between them vanish in the least squares sense (Hoppe, DeRose, Duchamp, McDonald, Stuetzle
1993; Chen, Medioni 1992), while vertices stay near the centroids of their cells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from .closest import ClosestPoint, Memory, face_normals, subdivision_centroids, vertex_normals
from .draft import Draft
from .embedded_flips import make_delaunay_embedded
from .geometry import angles_from_lengths, face_areas, halfedge_lengths
from .linear import solve_by_gradients
from .progress import Progress, Steps
from .surface_samples import Samples, area_samples, joined, tip_samples
from .topology import twins
from .voronoi import voronoi_cells

ROUNDS = 7
# Samples of the surface per vertex, and 2 x 2 of every triangle.
SAMPLES = 6
PATTERN = 2
# Weights next to the distances: of even displacements, of the centroids along the surface, of no displacement at all.
FAIRNESS = 0.02
CENTROID = 0.35
STILL = 1e-3
# Distances of this many times their mean count double, and up to 1 + FARTHEST^2 times.
FAR, FARTHEST = 3.0, 3.0
# Where angles fall below the first the centroid's weight rises, by PRESS for every step to the second.
SMALL, SMALLER = np.radians(42.0), np.radians(34.0)
PRESS = 3.0
# Vertices stay within this share of an edge of the surface.
TETHER = 0.15
# Rounds after which closest points are searched for again, and not only looked for near the last ones.
SEARCH_EVERY = 4
# Distances below this share of an edge have no direction but the normal's.
CLOSE = 1e-3


@dataclass(frozen=True)
class Pairs:
    """Points of the mesh, by triangle (k,) and barycentric coordinates (k,3), the way (k,3) to the surface, weights."""

    faces: np.ndarray
    barycentric: np.ndarray
    way: np.ndarray
    weight: np.ndarray


def fit_to_surface(draft: Draft, index: ClosestPoint, density: np.ndarray, spacing: float) -> Steps[Draft]:
    """A mesh near a surface, edges about `spacing` long, with less squared distance between the two.

    density (m,) of the surface's triangles, for the cells.
    """
    points = draft.points
    samples = joined(area_samples(index, SAMPLES * len(points), density), tip_samples(index, len(points)))
    triangles = draft.triangles.copy()
    twin = twins(triangles)
    near = index.nearest_face(points)
    there, back, home = (Memory(SEARCH_EVERY) for _ in range(3))
    for k in range(ROUNDS):
        pairs = _pairs(points, triangles, index, samples, spacing, there, back)
        cells = voronoi_cells(points, triangles, density[near] ** 2)
        pull = cells.moment / np.maximum(cells.mass, 1e-300)[:, None]
        moved = points + _displacements(points, triangles, draft.fixed, pairs, pull, CLOSE * spacing)
        if not np.isfinite(moved).all():
            break
        points = moved
        points, near = _tethered(points, triangles, index, TETHER * spacing, home)
        make_delaunay_embedded(points, triangles, twin, draft.locked)
        yield Progress("Fit", (k + 1) / ROUNDS)
    return replace(draft, points=points, triangles=triangles)


def _tethered(points, triangles, index: ClosestPoint, longest: float, home: Memory) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) no farther than that from the surface, and the triangles (n,) nearest to them.

    Few distances see a vertex at a tip, and what they say in a straight line may lead far out.
    """
    on = home(index, points, vertex_normals(points, triangles))
    way = points - on.points
    distance = np.sqrt(np.einsum("ni,ni->n", way, way))
    return on.points + way * np.minimum(1, longest / np.maximum(distance, 1e-300))[:, None], on.faces


def _pairs(points, triangles, index: ClosestPoint, samples: Samples, spacing: float, there, back: Memory) -> Pairs:
    """Closest points of the samples on the mesh, and of points of the mesh on the surface; each way weighs one half."""
    near = there(ClosestPoint(points, triangles, spacing), samples.points, samples.normals)
    pattern = subdivision_centroids(PATTERN)
    owner = np.repeat(np.arange(len(triangles)), len(pattern))
    bary = np.tile(pattern, (len(triangles), 1))
    places = np.einsum("kc,kcj->kj", bary, points[triangles[owner]])
    far = back(index, places, face_normals(points, triangles)[owner]).points
    area = face_areas(points, triangles)[owner]
    return Pairs(
        np.concatenate([near.faces, owner]),
        np.concatenate([near.barycentric, bary]),
        np.concatenate([samples.points - near.points, far - places]),
        np.concatenate([samples.area / samples.area.sum(), area / area.sum()]) / 2,
    )


def _displacements(points, triangles, fixed, pairs: Pairs, pull, close: float) -> np.ndarray:
    n = len(points)
    distance = np.sqrt(np.einsum("ki,ki->k", pairs.way, pairs.way))
    direction = pairs.way / np.maximum(distance, 1e-300)[:, None]
    direction = np.where((distance < close)[:, None], face_normals(points, triangles)[pairs.faces], direction)
    far = distance / (FAR * np.sqrt(np.average(distance**2, weights=pairs.weight)) + 1e-300)
    root = np.sqrt(pairs.weight * n * (1 + np.minimum(far, FARTHEST) ** 2))
    k = len(root)
    entries = pairs.barycentric[:, :, None] * direction[:, None] * root[:, None, None]
    columns = 3 * triangles[pairs.faces][:, :, None] + np.arange(3)
    rows = np.repeat(np.arange(k), 9)
    A = sp.csr_matrix((entries.ravel(), (rows, columns.ravel())), shape=(k, 3 * n))
    normals = vertex_normals(points, triangles)
    along = np.eye(3) - normals[:, :, None] * normals[:, None]
    hold = _hold(points, triangles)
    blocks = hold[:, None, None] * along + STILL * np.eye(3)
    slide = sp.bsr_matrix((blocks, np.arange(n), np.arange(n + 1)), shape=(3 * n, 3 * n))
    system = (A.T @ A + slide + FAIRNESS * _fairness(triangles, n)).tocsr()
    right = A.T @ (np.einsum("ki,ki->k", direction, pairs.way) * root)
    right += (hold[:, None] * np.einsum("nij,nj->ni", along, pull)).ravel()
    free = np.flatnonzero(np.repeat(~fixed, 3))
    offset = np.zeros(3 * n)
    if len(free):
        offset[free] = solve_by_gradients(system[free][:, free], right[free])
    return offset.reshape(n, 3)


def _hold(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Weight of the centroid at every vertex, (n,): more at triangles with small angles."""
    angle = angles_from_lengths(halfedge_lengths(points, triangles).reshape(-1, 3)).min(axis=1)
    bad = np.clip((SMALL - angle) / (SMALL - SMALLER), 0, 2)
    worst = np.zeros(len(points))
    np.maximum.at(worst, triangles.ravel(), np.repeat(bad, 3))
    return CENTROID * (1 + PRESS * worst)


def _fairness(triangles: np.ndarray, n: int) -> sp.csr_matrix:
    """Squared difference of every displacement (3n,) from the mean of its neighbours'."""
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    graph = sp.csr_matrix((np.ones(2 * len(tail)), (np.r_[tail, head], np.r_[head, tail])), shape=(n, n))
    graph.data[:] = 1
    degree = np.maximum(np.diff(graph.indptr), 1)
    difference = sp.identity(n) - sp.diags(1 / degree) @ graph
    return sp.kron(difference.T @ difference, sp.identity(3))
