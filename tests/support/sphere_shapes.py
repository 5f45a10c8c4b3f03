"""Closed surfaces of genus 0, and meshes of the sphere, for tests of maps to it."""

from __future__ import annotations

import meshes
import numpy as np
from scipy.spatial import ConvexHull

from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)


def blob(subdivisions=3, seed=0, strength=0.4):
    """A sphere with random smooth bumps."""
    V, F = meshes.icosphere(subdivisions)
    wave = np.random.default_rng(seed).normal(0, 2.5, (5, 3))
    return V * (1 + strength * np.sin(V @ wave.T).mean(1))[:, None], F


SHAPES = {
    "tetrahedron": TETRAHEDRON,
    "cube": meshes.cube(),
    "sphere": meshes.icosphere(2),
    "blob": blob(),
    "plate": (blob(3, 1)[0] * [1, 1, 0.05], blob(3, 1)[1]),
    "needle": (blob(3, 2)[0] * [1, 0.2, 0.2], blob(3, 2)[1]),
}


def outward_hull(P):
    """Triangles (m,3) of the convex hull of points (n,3), all of which look outside."""
    F = ConvexHull(P).simplices.astype(np.int64)
    inward = signed_volumes(P, F) < 0
    F[inward] = F[inward][:, [0, 2, 1]]
    return F


def random_sphere(count=500, seed=0, towards=(0.0, 0, 0)):
    """Random points of the unit sphere, denser in one direction, and their hull."""
    P = np.random.default_rng(seed).normal(size=(count, 3))
    P = P / np.linalg.norm(P, axis=1, keepdims=True) + towards
    P /= np.linalg.norm(P, axis=1, keepdims=True)
    return P, outward_hull(P)


def random_rotation(seed=0):
    """A random rotation (3,3)."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def lopsided(P, F, contrast=2.0):
    """Masses (m,) of the faces, 4 pi in all, many times larger on one side."""
    mass = spherical_areas(P, F) * np.exp(contrast * P[F].mean(axis=1) @ [0.2, 0.5, 0.8])
    return mass * (4 * np.pi / mass.sum())


def creature(body=3, length=12, width=1, limbs=6):
    """The surface of a block of unit cubes with straight limbs, two triangles for each square."""
    size = body + 2 * length + 2
    solid = np.zeros((size,) * 3, bool)
    middle = slice(size // 2 - body // 2, size // 2 - body // 2 + body)
    solid[middle, middle, middle] = True
    thin = slice(size // 2 - width // 2, size // 2 - width // 2 + width)
    for limb in range(limbs):
        place = [thin, thin, thin]
        place[limb % 3] = (
            slice(middle.stop, middle.stop + length) if limb < 3 else slice(middle.start - length, middle.start)
        )
        solid[tuple(place)] = True
    squares = []
    for axis in range(3):
        u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        for side in (0, 1):
            neighbour = np.roll(solid, -1 if side else 1, axis=axis)
            base = np.argwhere(solid & ~neighbour) + side * np.eye(3, dtype=int)[axis]
            square = np.stack([base, base + u, base + u + v, base + v], axis=1)
            squares.append(square if side else square[:, ::-1])
    corners = np.concatenate(squares)
    V, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    quads = index.reshape(-1, 4)
    return V.astype(float), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def star(length=12):
    """A cube with six arms, each a row of cubes: conformally, their ends vanish."""
    cells = {(0, 0, 0)}
    for axis in range(3):
        cells |= {tuple(sign * k * (np.arange(3) == axis)) for k in range(1, length) for sign in (-1, 1)}
    quads = []
    for cell in sorted(cells):
        for axis in range(3):
            u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
            for sign in (0, 1):
                step = np.eye(3, dtype=int)[axis]
                if tuple(np.array(cell) + (2 * sign - 1) * step) not in cells:
                    base = np.array(cell) + sign * step
                    quad = [base, base + u, base + u + v, base + v]
                    quads += quad if sign else quad[::-1]
    V, index = np.unique(quads, axis=0, return_inverse=True)
    Q = index.reshape(-1, 4)
    return V.astype(float), np.concatenate([Q[:, [0, 1, 2]], Q[:, [0, 2, 3]]])
