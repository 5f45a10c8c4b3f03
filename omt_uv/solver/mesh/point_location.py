"""Locate points in triangulations of the plane or the sphere, by random walks (Devillers, Pion, Teillaud 2002)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .geometry import cross2, cross3
from .topology import twins

# Edges that a walk crosses at most; far more than across a mesh of a million faces.
MOST_STEPS = 2000


def locate(uv: np.ndarray, triangles: np.ndarray, points: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Triangle (k,) and barycentric coordinates (k,3) of points (k,2) in a map without folds (n,2), (m,3).

    Points (k,3) and maps (n,3) are those of the unit sphere. A point outside of the map goes to the boundary triangle
    where its walk ends, coordinates clamped. A step crosses one of the edges that the point lies beyond, chosen at
    random, so that no walk goes round in circles (Devillers, Pion, Teillaud 2002).
    """
    twin = twins(triangles).reshape(-1, 3)
    rng = np.random.default_rng(seed)
    faces = cKDTree(uv[triangles].mean(axis=1)).query(points)[1].astype(np.int64)
    barycentric = np.zeros((len(points), 3))
    active = np.arange(len(points))
    for _ in range(MOST_STEPS):
        b = _barycentric(uv[triangles[faces[active]]], points[active])
        barycentric[active] = b
        # Opposite to corner k is the halfedge k + 1.
        beyond = (b < -1e-12) & (twin[faces[active]][:, [1, 2, 0]] >= 0)
        moving = beyond.any(axis=1)
        active, beyond = active[moving], beyond[moving]
        if len(active) == 0:
            break
        pick = (rng.random(beyond.shape) * beyond).argmax(axis=1)
        faces[active] = twin[faces[active], (pick + 1) % 3] // 3
    barycentric = np.clip(barycentric, 0, 1)
    return faces, barycentric / barycentric.sum(axis=1, keepdims=True)


def _barycentric(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (k,3) of points (k,d) in triangles (k,3,d); none is positive in a folded triangle."""
    a, b, c = (corners[:, k] - points for k in range(3))
    if points.shape[1] == 3:
        # Seen along the point itself.
        parts = np.stack([np.einsum("ki,ki->k", points, cross3(u, v)) for u, v in ((b, c), (c, a), (a, b))], axis=1)
    else:
        parts = np.stack([cross2(b, c), cross2(c, a), cross2(a, b)], axis=1)
    total = parts.sum(axis=1, keepdims=True)
    # In a folded triangle all are negative: the walk goes on.
    return np.where(total != 0, parts / np.where(total != 0, np.abs(total), 1), 1 / 3)
