"""Meshes of polygons, each cut into triangles from any of its corners."""

from __future__ import annotations

import meshes
import numpy as np


def cut(polygons, turn=0):
    """Triangles (m,3), and the polygon (m,) of each: fans from corner `turn` of every polygon."""
    triangles, owner = [], []
    for k, polygon in enumerate(polygons):
        p = np.roll(polygon, -(turn % len(polygon)))
        triangles += [(p[0], p[i], p[i + 1]) for i in range(1, len(p) - 1)]
        owner += [k] * (len(p) - 2)
    return np.array(triangles), np.array(owner)


def wavy(V):
    """The plane (n,2) or (n,3) as a surface without a plane polygon, and a smooth map (n,2) of it without folds."""
    x, y = V[:, 0], V[:, 1]
    surface = np.column_stack([x, y, 0.3 * np.sin(5 * x + 1) * np.cos(4 * y) + 0.1 * x * y])
    return surface, np.column_stack([x + 0.08 * np.sin(3 * y + x), y + 0.06 * np.cos(4 * x - y)])


def wavy_quads(columns=9, rows=7):
    """Positions (n,3), quads (f,4) and a map (n,2)."""
    V, Q = meshes.quad_grid(columns, rows)
    return (*wavy(V)[:1], Q, wavy(V)[1])


def wavy_mixed(columns=6, rows=5):
    """Positions (n,3), polygons of three to eight corners, and a map (n,2): all are convex in it."""
    points, polygons = [], []
    for k, (i, j) in enumerate(np.ndindex(columns, rows)):
        angle = 2 * np.pi * np.arange(3 + k % 6) / (3 + k % 6) + k
        polygons.append(len(points) + np.arange(len(angle)))
        points += list(np.column_stack([i + 0.45 * np.cos(angle), j + 0.45 * np.sin(angle)]) / columns)
    surface, uv = wavy(np.array(points))
    return surface, polygons, uv


def slit_across(count: int = 6):
    """Quads of a strip of 7 x `count` on a bump, those in the middle across the plane x = 0. The first two of these
    hang on the right alone; their corners to the left are the last three vertices."""
    x, y = np.meshgrid(np.arange(8) - 3.5, np.arange(count + 1.0), indexing="ij")
    V = np.stack([x, y, np.exp(-(x**2) / 8)], axis=-1).reshape(-1, 3)
    corner = ((count + 1) * np.arange(7)[:, None] + np.arange(count)).ravel()
    Q = np.column_stack([corner, corner + count + 1, corner + count + 2, corner + 1])
    n, first = len(V), 3 * count
    V = np.concatenate([V, V[3 * (count + 1) + np.arange(3)]])
    Q[first, [0, 3]] = n, n + 1
    Q[first + 1, [0, 3]] = n + 1, n + 2
    return V, Q


def with_limbs(seed, limbs=6, longest=4):
    """A cube of 24 quads out of which crooked limbs were extruded, as a modeller begins: positions (n,3), quads."""
    rng, grid = np.random.default_rng(seed), np.arange(-1, 2)
    polygons = []
    for axis, side in np.ndindex(3, 2):
        for i, j in np.ndindex(2, 2):
            square = np.array([[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]])[:: 2 * side - 1]
            corner = np.full((4, 3), 2 * side - 1)
            corner[:, [(axis + 1) % 3, (axis + 2) % 3]] = grid[square]
            polygons.append(corner)
    places, index = np.unique(np.concatenate(polygons), axis=0, return_inverse=True)
    V, F = list(places / np.linalg.norm(places, axis=1)[:, None]), index.reshape(-1, 4).tolist()
    for _ in range(limbs):
        face = int(rng.integers(len(F)))
        for _ in range(int(rng.integers(1, longest + 1))):
            old, p, n = F[face], np.array([V[i] for i in F[face]]), len(V)
            normal = np.cross(p[2] - p[0], p[3] - p[1])
            way = normal / np.linalg.norm(normal) + 0.4 * rng.normal(size=3)
            middle = p.mean(axis=0)
            V += list(middle + (p - middle) * rng.uniform(0.6, 1.1) + way * rng.uniform(0.3, 0.9))
            F += [[old[k], old[(k + 1) % 4], n + (k + 1) % 4, n + k] for k in range(4)]
            F[face] = [n, n + 1, n + 2, n + 3]
    return np.array(V), F
