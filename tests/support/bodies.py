"""Closed bodies in space: a ball of triangles, one with limbs, and one that is twisted."""

from __future__ import annotations

from itertools import pairwise

import numpy as np


def icosphere(levels: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n,3) of the unit sphere and triangles (m,3), an icosahedron divided `levels` times."""
    g = (1 + 5**0.5) / 2
    points = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)], float)
    points = np.concatenate([points, points[:, [2, 0, 1]], points[:, [1, 2, 0]]])
    points /= np.linalg.norm(points[0])
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = np.isclose(distance, np.sort(np.unique(distance.round(9)))[1])
    i, j, k = np.nonzero(near[:, :, None] & near[:, None, :] & near[None, :, :])
    faces = np.stack([i, j, k], axis=1)
    faces = faces[(faces[:, 0] < faces[:, 1]) & (faces[:, 1] < faces[:, 2])]
    corner = points[faces]
    inwards = np.einsum("mi,mi->m", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    for _ in range(levels):
        points, faces = divided(points, faces)
        points = points / np.linalg.norm(points, axis=1)[:, None]
    return points, faces


def divided(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every triangle (m,3) of points (n,3) in four."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    ends, inverse = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = len(points) + inverse.ravel().reshape(3, -1)
    parts = [[faces[:, 0], ab, ca], [faces[:, 1], bc, ab], [faces[:, 2], ca, bc], [ab, bc, ca]]
    return np.concatenate([points, points[ends].mean(axis=1)]), np.concatenate([np.stack(p, axis=1) for p in parts])


def limbed(levels: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """A closed body with six blunt limbs, without a plane of symmetry."""
    points, faces = icosphere(levels)
    x, y, z = points.T
    radius = 1 + 0.5 * (x**4 + y**4 + z**4 - 0.6) + 0.1 * x * y + 0.07 * z
    return points * radius[:, None], faces


def bowl(rings: int, sectors: int, thick: float) -> tuple[np.ndarray, np.ndarray]:
    """A closed bowl of a radius of 1, whose wall is `thick`, with a narrow mouth."""
    polar = np.linspace(0, 0.85 * np.pi, rings + 1)[1:]
    polar = np.concatenate([polar, polar[::-1]])
    radius = np.repeat([1.0, 1 - thick], rings)
    turn = 2 * np.pi * np.arange(sectors) / sectors
    ring = np.stack([np.outer(radius * np.sin(polar), f(turn)) for f in (np.cos, np.sin)], axis=2)
    depth = np.repeat(-radius * np.cos(polar), sectors).reshape(len(polar), sectors, 1)
    V = np.concatenate([np.concatenate([ring, depth], axis=2).reshape(-1, 3), [[0, 0, -1], [0, 0, thick - 1]]])
    k, after = np.arange(sectors), (np.arange(sectors) + 1) % sectors
    last = (len(polar) - 1) * sectors
    F = [np.column_stack([after, k, 0 * k + len(V) - 2])]
    for low in sectors * np.arange(len(polar) - 1):
        up = low + sectors
        F += [np.column_stack([low + k, low + after, up + k]), np.column_stack([low + after, up + after, up + k])]
    return V, np.concatenate([*F, np.column_stack([last + k, last + after, 0 * k + len(V) - 1])])


def hourglass(rings: int, sectors: int) -> tuple[np.ndarray, np.ndarray]:
    """Two bulbs that a closed surface joins through a common line: with all faces wound alike, one is inside out."""
    polar = np.pi * (np.arange(rings) + 1) / (rings + 1)
    turn = 2 * np.pi * np.arange(sectors) / sectors
    wide, thick = np.sin(polar)[:, None], np.sin(2 * polar)[:, None]
    ring = np.stack([wide * np.cos(turn), thick * np.sin(turn), -np.cos(polar)[:, None] + 0 * wide * turn], axis=2)
    V = np.concatenate([ring.reshape(-1, 3), [[0, 0, -1], [0, 0, 1]]])
    k, after = np.arange(sectors), (np.arange(sectors) + 1) % sectors
    F = [np.column_stack([after, k, 0 * k + rings * sectors])]
    for low in sectors * np.arange(rings - 1):
        up = low + sectors
        F += [np.column_stack([low + k, low + after, up + k]), np.column_stack([low + after, up + after, up + k])]
    top = (rings - 1) * sectors
    return V, np.concatenate([*F, np.column_stack([top + k, top + after, 0 * k + len(V) - 1])])


def turned(profile, sides: int) -> tuple[np.ndarray, list[list[int]]]:
    """Positions (n,3) and polygons of a surface of revolution about z: quads between rows, triangles around poles.

    profile (k,2) : distance from the axis, 0 at poles, and height
    """
    turn = 2 * np.pi * np.arange(sides) / sides
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    V, rows = [], []
    for r, z in profile:
        points = np.column_stack([r * around, np.full(sides, z)]) if r > 0 else np.array([[0.0, 0.0, z]])
        rows.append(np.arange(len(points)).repeat(sides // len(points)) + sum(map(len, V)))
        V.append(points)
    polygons = []
    for low, high in pairwise(rows):
        quads = np.stack([low, np.roll(low, -1), np.roll(high, -1), high], axis=1)
        polygons += [list(dict.fromkeys(quad)) for quad in quads.tolist()]
    return np.concatenate(V), polygons
