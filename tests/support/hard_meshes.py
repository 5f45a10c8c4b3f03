"""Meshes that are hard on a solver by their shape or their number, as positions (n,3) and polygons (f,k) or lists.

Sponges and voxels have many handles, strips and fans graphs that are paths and stars, soups thousands of pieces.
"""

from __future__ import annotations

import numpy as np

# Corners of the unit cube's sides, counter-clockwise from outside, and to which neighbour each side looks.
SIDES = {
    (-1, 0, 0): [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)],
    (1, 0, 0): [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
    (0, -1, 0): [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
    (0, 1, 0): [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
    (0, 0, -1): [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)],
    (0, 0, 1): [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def voxel_surface(filled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sides of filled cells (a,b,c) bool that no other cell covers, vertices shared wherever they coincide."""
    around = np.pad(filled, 1)
    quads = []
    for side, corners in SIDES.items():
        bare = around & ~np.roll(around, [-s for s in side], axis=(0, 1, 2))
        quads.append((np.argwhere(bare) - 1)[:, None] + np.array(corners))
    corners = np.concatenate(quads).reshape(-1, 3)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return points.astype(float), index.reshape(-1, 4)


def sponge(level: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """The surface of a Menger sponge."""
    middle = np.add.outer(np.add.outer(np.arange(3) == 1, np.arange(3) == 1), (np.arange(3) == 1).astype(int))
    filled = np.ones((1, 1, 1), bool)
    for _ in range(level):
        filled = np.kron(filled, middle < 2)
    return voxel_surface(filled.astype(bool))


def voxel_blob(size: int = 12, density: float = 0.5, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The surface of random cells, smoothed a little."""
    noise = np.random.default_rng(seed).random((size,) * 3)
    for axis in range(3):
        noise = noise + np.roll(noise, 1, axis)
    return voxel_surface(noise > np.quantile(noise, 1 - density))


def klein_bottle(around: int = 48, across: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """The figure-8 immersion of the Klein bottle, quads."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(k) / k for k in (around, across)), indexing="ij")
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    V = np.stack([r * np.cos(u), r * np.sin(u), z], axis=2).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))

    def vertex(i, j):
        # Once around, the figure 8 has turned by half a turn: v goes to -v.
        return i % around * across + np.where(i == around, -j, j) % across

    return V, np.column_stack([vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)])
