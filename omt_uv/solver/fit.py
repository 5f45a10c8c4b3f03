"""Vertices moved off the surface so that the triangles between them come closer to it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from .closest import ClosestPoint, face_normals, subdivision_centroids, vertex_normals
from .linear import solve_spd

ROUNDS = 2
# Points per triangle: the centroids of 3 x 3 pieces.
PATTERN = 3
# Weight of a smooth displacement against a near one.
FAIRNESS = 0.02


def fit_to_surface(
    points: np.ndarray, triangles: np.ndarray, fixed: np.ndarray, index: ClosestPoint, rounds: int = ROUNDS
) -> np.ndarray:
    """Points (n,3) of a mesh moved along their normals to lower its squared distance to the surface; see `_offsets`."""
    for _ in range(rounds):
        normals = vertex_normals(points, triangles)
        points = points + _offsets(points, triangles, normals, fixed, index)[:, None] * normals
    return points


def _offsets(points, triangles, normals, fixed, index: ClosestPoint) -> np.ndarray:
    """Least squares: point-to-plane distances of samples of the triangles to the surface, (n,)."""
    pattern = subdivision_centroids(PATTERN)
    s, m, n = len(pattern), len(triangles), len(points)
    mine = np.repeat(np.arange(m), s)
    weights = np.tile(pattern, (m, 1))
    samples = np.einsum("kc,kcj->kj", weights, points[triangles[mine]])
    flat = face_normals(points, triangles)[mine]
    found = index(samples, flat)
    away = found.points - samples
    target = np.einsum("ki,ki->k", away, flat)
    area = np.linalg.norm(
        np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]),
        axis=1,
    )
    w = np.sqrt(area / area.mean())[mine]
    entries = weights * np.einsum("kci,ki->kc", normals[triangles[mine]], flat) * w[:, None]
    rows = np.repeat(np.arange(len(mine)), 3)
    A = sp.csr_matrix((entries.ravel(), (rows, triangles[mine].ravel())), shape=(len(mine), n))
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    graph = sp.csr_matrix((np.ones(len(tail)), (tail, head)), shape=(n, n))
    graph = graph + graph.T
    graph.data[:] = 1
    degree = np.asarray(graph.sum(axis=1)).ravel()
    fair = sp.identity(n, format="csr") - sp.diags(1 / np.maximum(degree, 1)) @ graph
    system = (A.T @ A + FAIRNESS * s * (fair.T @ fair) + 1e-9 * sp.identity(n)).tocsc()
    right = A.T @ (target * w)
    free = np.flatnonzero(~fixed)
    offset = np.zeros(n)
    if len(free):
        offset[free] = solve_spd(system[free][:, free].tocsc(), right[free])
    return offset
