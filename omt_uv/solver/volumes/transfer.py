"""Find points in tetrahedra, and carry data of the inside from one map to another."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .tet_mesh import gradients

# Tetrahedra that are looked at for a point, nearest centres first, and how many more where none of these has it.
NEAREST = 12
MORE = 160
# Points that are looked for together.
BLOCK = 4096
# Barycentric coordinates below zero by less are inside.
SLACK = 1e-9


class TetLocation:
    """Points in tetrahedra (m,4) with vertices at positions (n,3): in which one, and with which barycentric
    coordinates.

    A point outside of all belongs to the one that it is least outside of, among those near.
    """

    def __init__(self, positions: np.ndarray, tets: np.ndarray):
        self.positions, self.tets = positions, tets
        self._gradient = gradients(positions, tets)
        self._corner = positions[tets[:, 0]]
        self._tree = cKDTree(positions[tets].mean(axis=1))

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tetrahedra (k,) and barycentric coordinates (k,4) of points (k,3)."""
        blocks = [self._find(points[k : k + BLOCK]) for k in range(0, len(points), BLOCK)]
        if not blocks:
            return np.zeros(0, np.int64), np.zeros((0, 4))
        owner, weights = (np.concatenate(part) for part in zip(*blocks, strict=True))
        return owner, weights

    def _find(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        owner, weights = self._best(points, NEAREST)
        lost = np.flatnonzero(weights.min(axis=1) < -SLACK)
        for start in range(0, len(lost), BLOCK // 16):
            rows = lost[start : start + BLOCK // 16]
            owner[rows], weights[rows] = self._best(points[rows], MORE)
        return owner, weights

    def _best(self, points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        _, near = self._tree.query(points, k=min(count, len(self.tets)))
        near = near.reshape(len(points), -1)
        offset = points[:, None] - self._corner[near]
        weights = np.einsum("kcai,kci->kca", self._gradient[near], offset)
        weights[..., 0] += 1
        best = weights.min(axis=2).argmax(axis=1)
        rows = np.arange(len(points))
        return near[rows, best], weights[rows, best]

    def values(self, points: np.ndarray, field: np.ndarray) -> np.ndarray:
        """A field (n,...) at vertices, linear in between, at points (k,3), or at the nearest inside."""
        owner, weights = self(points)
        weights = np.maximum(weights, 0.0)
        weights /= weights.sum(axis=1, keepdims=True)
        return np.einsum("ka,ka...->k...", weights, field[self.tets[owner]])
