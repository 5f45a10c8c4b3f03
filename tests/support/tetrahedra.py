"""Bodies of tetrahedra, and their volumes."""

from __future__ import annotations

import numpy as np


def grid_of_tets(n=3, noise=0.0, seed=0):
    """Points of a cube of n^3 cells, six tetrahedra each, all of positive volume."""
    side = np.arange(n + 1)
    points = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3) / n
    number = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    tets = []
    for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        for i in np.ndindex(n, n, n):
            at, corners = list(i), [number[i]]
            for axis in order:
                at[axis] += 1
                corners.append(number[tuple(at)])
            tets.append(corners)
    tets = np.array(tets)
    p = points[tets]
    negative = np.linalg.det(p[:, 1:] - p[:, :1]) < 0
    tets[negative] = tets[negative][:, [0, 2, 1, 3]]
    return points + noise * np.random.default_rng(seed).normal(size=points.shape), tets


def volumes(points, tets):
    """The signed volume (m,) of each."""
    p = points[tets]
    return np.linalg.det(p[:, 1:] - p[:, :1]) / 6
