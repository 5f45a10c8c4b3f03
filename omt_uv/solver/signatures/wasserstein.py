"""The Wasserstein distance of signatures, least over rotations and mirroring.

All rotations of an even grid are scored at once by how well smoothed densities agree, before any is refined: refinement
from random starts ends at wrong rotations. The best are refined by assignments and Kabsch's rotation in turn.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..mesh.spherical_geometry import fibonacci_sphere
from ..registration.alignment import rotation_grid, rotation_of_pairs
from .signature import Signature

# Points at which densities are compared, and the width of the kernel that smooths them, in radians.
LATTICE = 500
WIDTH = 0.3
# Rotations that are refined, on so many points, in so many rounds; then once more with all points.
BEST = 5
FEW = 120
ROUNDS = 6
# Weight of the squared difference of curvature next to squared angles.
CURVATURE = 0.15
# Distance of two independent samplings of one surface times the root of the number of points: 0.083 at 400, 0.041 at
# 1,600.
FLOOR = 1.6


@dataclass(frozen=True)
class ShapeDistance:
    """distance: with the floor taken off; raw: without; floor: of two samplings of one surface; rotation (3,3): of the
    first, determinant -1 where mirrored"""

    distance: float
    raw: float
    floor: float
    rotation: np.ndarray


def shape_distance(a: Signature, b: Signature, curvature: float = CURVATURE) -> ShapeDistance:
    """How far apart two signatures are; (k,3) and (k,) each, of the same number of points.

    The square is the mean of squared angles, and of squared differences of curvature times a weight (Su 2015, equation
    3.31, on the sphere). It is the same whichever comes first.
    """
    one, other = _shape_distance(a, b, curvature), _shape_distance(b, a, curvature)
    return one if one.raw <= other.raw else ShapeDistance(other.distance, other.raw, other.floor, other.rotation.T)


def _shape_distance(a: Signature, b: Signature, curvature: float) -> ShapeDistance:
    fields_a, fields_b = _fields(a), _fields(b)
    grid, best = rotation_grid(), list[np.ndarray]()
    for flip in (np.eye(3), np.diag([1.0, 1.0, -1.0])):
        turned = fields_a if flip[2, 2] > 0 else _fields(Signature(a.points @ flip, a.curvature))
        score = ((fields_b[_nearest()] - turned) ** 2).sum(axis=(1, 2))
        best += [grid[k] @ flip for k in np.argsort(score, kind="stable")[:BEST]]
    few = np.linspace(0, len(a.points) - 1, min(FEW, len(a.points))).astype(int)
    short_a, short_b = (Signature(s.points[few], s.curvature[few]) for s in (a, b))
    tried = [_refined(short_a, short_b, rotation, curvature) for rotation in best]
    rotation = min(tried, key=lambda found: found[0])[1]
    square, rotation = _refined(a, b, rotation, curvature)
    floor = FLOOR / np.sqrt(len(a.points))
    return ShapeDistance(float(np.sqrt(max(square - floor**2, 0))), float(np.sqrt(square)), floor, rotation)


def _refined(a: Signature, b: Signature, rotation: np.ndarray, curvature: float) -> tuple[float, np.ndarray]:
    """Least mean cost and its rotation (3,3), by assignments and rotations in turn."""
    bend = curvature * (a.curvature[:, None] - b.curvature[None]) ** 2
    best = np.inf
    found = rotation
    mirrored = bool(np.linalg.det(rotation) < 0)
    for _ in range(ROUNDS):
        cost = np.arccos(np.clip(a.points @ rotation.T @ b.points.T, -1, 1)) ** 2 + bend
        rows, columns = linear_sum_assignment(cost)
        mean = float(cost[rows, columns].mean())
        if mean >= best - 1e-9:
            break
        best, found = mean, rotation
        rotation = rotation_of_pairs(a.points[rows], b.points[columns], mirrored).rotation
    return best, found


def _fields(s: Signature) -> np.ndarray:
    """Density and curvature (l,2) of a signature at the lattice, smoothed."""
    kernel = np.exp((fibonacci_sphere(LATTICE) @ s.points.T - 1) / WIDTH**2)
    kernel /= 2 * np.pi * WIDTH**2 / (4 * np.pi) * len(s.points)
    return np.stack([np.log(kernel.sum(axis=1) + 0.05), kernel @ s.curvature], axis=1)


@functools.lru_cache(maxsize=1)
def _nearest() -> np.ndarray:
    """The point of the lattice (r,l) to which every rotation of the grid takes each."""
    lattice = fibonacci_sphere(LATTICE)
    turned = np.einsum("rab,kb->rka", rotation_grid(), lattice)
    return cKDTree(lattice).query(turned.reshape(-1, 3))[1].reshape(len(turned), LATTICE)


def spectrum(s: Signature, degrees: int = 12) -> np.ndarray:
    """What no rotation or mirroring changes, (2 * degrees,): the power of density and curvature in each degree of
    spherical harmonics."""
    gram = np.clip(s.points @ s.points.T, -1, 1)
    before, now = np.ones_like(gram), gram
    powers = []
    for degree in range(1, degrees + 1):
        powers += [now.mean(), (now * np.outer(s.curvature, s.curvature)).mean()]
        before, now = now, ((2 * degree + 1) * gram * now - degree * before) / (degree + 1)
    return np.sqrt(np.maximum(powers, 0))


def nearest(
    s: Signature, library: list[Signature], top: int, spectra: np.ndarray | None = None
) -> list[tuple[int, ShapeDistance]]:
    """The `top` nearest of a library, nearest first; spectra (l,24) of it, if at hand.

    Spectra choose four times as many as asked for; these alone are compared by transport.
    """
    if spectra is None:
        spectra = np.stack([spectrum(other) for other in library])
    order = np.argsort(((spectra - spectrum(s)) ** 2).sum(axis=1), kind="stable")[: max(4 * top, 8)]
    found = [(int(k), shape_distance(s, library[k])) for k in order]
    return sorted(found, key=lambda pair: (pair[1].raw, pair[0]))[:top]
