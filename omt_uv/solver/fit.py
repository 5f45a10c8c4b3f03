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
from .geometry import face_areas
from .linear import solve_by_gradients
from .progress import Progress, Steps
from .springs import equilateral, fairness, smallness
from .surface_samples import Samples, area_samples, joined, tip_samples
from .topology import twins
from .voronoi import voronoi_cells

ROUNDS = 7
# Samples of the surface per vertex, and 2 x 2 of every triangle; what the vertices weigh next to these.
SAMPLES = 6
PATTERN = 2
VERTICES = 0.5
# Weights next to the distances: of even displacements, of the centroids along the surface, of no displacement at all.
FAIRNESS = 0.02
CENTROID = 0.35
STILL = 1e-3
# Distances of this many times their mean count double, and up to 1 + FARTHEST^2 times.
FAR, FARTHEST = 3.0, 3.0
# The centroid's weight rises by PRESS where angles are small, and falls by half where a point around is EASY times the
# mean distance away: to come closer to a crest, vertices have to slide onto it.
PRESS = 3.0
EASY, EASIEST = 6.0, 0.05
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
    there, back, home = (Memory(SEARCH_EVERY) for _ in range(3))
    on = home(index, points, vertex_normals(points, triangles))
    for k in range(ROUNDS):
        pairs = _pairs(points, triangles, index, samples, spacing, there, back, on.points)
        cells = voronoi_cells(points, triangles, density[on.faces] ** 2)
        pull = cells.moment / np.maximum(cells.mass, 1e-300)[:, None]
        moved = points + _displacements(points, triangles, draft.fixed, pairs, pull, CLOSE * spacing)
        if not np.isfinite(moved).all():
            break
        points = moved
        on = home(index, points, vertex_normals(points, triangles))
        points = _tethered(points, on.points, TETHER * spacing)
        make_delaunay_embedded(points, triangles, twin, draft.locked)
        yield Progress("Fit", (k + 1) / ROUNDS)
    return replace(draft, points=points, triangles=triangles)


def _tethered(points: np.ndarray, on: np.ndarray, longest: float) -> np.ndarray:
    """Points (n,3) no farther than that from their closest ones on the surface (n,3).

    Few distances see a vertex at a tip, and what they say in a straight line may lead far out.
    """
    way = points - on
    distance = np.sqrt(np.einsum("ni,ni->n", way, way))
    return on + way * np.minimum(1, longest / np.maximum(distance, 1e-300))[:, None]


def _pairs(points, triangles, index: ClosestPoint, samples: Samples, spacing: float, there, back: Memory, on) -> Pairs:
    """Closest points of the samples on the mesh, and of points of the mesh on the surface; each way weighs one half.

    on (n,3): the closest points of the vertices
    """
    near = there(ClosestPoint(points, triangles, spacing), samples.points, samples.normals)
    pattern = subdivision_centroids(PATTERN)
    owner = np.repeat(np.arange(len(triangles)), len(pattern))
    bary = np.tile(pattern, (len(triangles), 1))
    places = np.einsum("kc,kcj->kj", bary, points[triangles[owner]])
    far = back(index, places, face_normals(points, triangles)[owner]).points
    n, area = len(points), face_areas(points, triangles)
    corner = np.zeros(n, np.int64)
    corner[triangles.ravel()] = np.arange(triangles.size)
    at = VERTICES * np.bincount(triangles.ravel(), np.repeat(area / 3, 3), n)
    area = np.concatenate([area[owner] / len(pattern), at])
    return Pairs(
        np.concatenate([near.faces, owner, corner // 3]),
        np.concatenate([near.barycentric, bary, np.eye(3)[corner % 3]]),
        np.concatenate([samples.points - near.points, far - places, on - points]),
        np.concatenate([samples.area / samples.area.sum(), area / area.sum()]) / 2,
    )


def _displacements(points, triangles, fixed, pairs: Pairs, pull, close: float) -> np.ndarray:
    n = len(points)
    distance = np.sqrt(np.einsum("ki,ki->k", pairs.way, pairs.way))
    usual = np.sqrt(np.average(distance**2, weights=pairs.weight)) + 1e-300
    direction = pairs.way / np.maximum(distance, 1e-300)[:, None]
    direction = np.where((distance < close)[:, None], face_normals(points, triangles)[pairs.faces], direction)
    root = np.sqrt(pairs.weight * n * (1 + np.minimum(distance / (FAR * usual), FARTHEST) ** 2))
    k = len(root)
    entries = pairs.barycentric[:, :, None] * direction[:, None] * root[:, None, None]
    columns = 3 * triangles[pairs.faces][:, :, None] + np.arange(3)
    rows = np.repeat(np.arange(k), 9)
    A = sp.csr_matrix((entries.ravel(), (rows, columns.ravel())), shape=(k, 3 * n))
    normals = vertex_normals(points, triangles)
    along = np.eye(3) - normals[:, :, None] * normals[:, None]
    bad = smallness(points, triangles)
    ease = _ease(triangles, pairs.faces, distance / usual, n)
    pressed = _worst(triangles, bad, n)
    hold = CENTROID * (1 + PRESS * pressed) * ease
    stiffness, force = equilateral(points, triangles, bad)
    # Shapes change along the surface alone.
    flat = _blocks(along)
    system = A.T @ A + _blocks(hold[:, None, None] * along + STILL * np.eye(3)) + flat @ stiffness @ flat
    system = (system + FAIRNESS * fairness(triangles, n)).tocsr()
    right = A.T @ (np.einsum("ki,ki->k", direction, pairs.way) * root)
    right += (hold[:, None] * np.einsum("nij,nj->ni", along, pull)).ravel() + flat @ force
    free = np.flatnonzero(np.repeat(~fixed, 3))
    offset = np.zeros(3 * n)
    if len(free):
        offset[free] = solve_by_gradients(system[free][:, free], right[free])
    return offset.reshape(n, 3)


def _ease(triangles: np.ndarray, faces: np.ndarray, off: np.ndarray, n: int) -> np.ndarray:
    """Share of the centroid's weight that is left at every vertex, (n,), points of `faces` (k,) being `off` (k,)."""
    farthest = np.zeros(len(triangles))
    np.maximum.at(farthest, faces, off)
    return np.maximum(1 / (1 + (_worst(triangles, farthest, n) / EASY) ** 2), EASIEST)


def _worst(triangles: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """The largest of the values (m,) of the triangles around every vertex, (n,)."""
    worst = np.zeros(n)
    np.maximum.at(worst, triangles.ravel(), np.repeat(values, 3))
    return worst


def _blocks(blocks: np.ndarray) -> sp.bsr_matrix:
    """The matrix (3n,3n) with these blocks (n,3,3) on its diagonal."""
    n = len(blocks)
    return sp.bsr_matrix((blocks, np.arange(n), np.arange(n + 1)), shape=(3 * n, 3 * n))
