"""The Wasserstein distance of signatures, least over rotations and mirroring.

All rotations of an even grid are scored at once by how well densities and curvatures agree in spherical harmonics,
before any is refined: refinement from random starts ends at wrong rotations. The best that are far apart are refined
by assignments and Kabsch's rotation in turn, of few points first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..mesh.spherical_geometry import fibonacci_sphere, normalized
from ..registration.alignment import rotation_grid, rotation_of_pairs
from .harmonics import DEGREES, by_degree, grid_matrices, harmonics, refined_agreement
from .signature import CURVATURE, Signature, pair_costs

# Points of the sphere at which densities are smoothed, and the width of the kernel, in radians.
LATTICE = 500
WIDTH = 0.25
# So many of the grid's rotations are turned on to the best agreement nearby; the best of them that are apart, by more
# than this angle in radians, are refined on few points, and the best of these with all points, in so many rounds.
TRIED = 24
BEST = 6
FEW = 200
ROUNDS = 2
FINALISTS = 3
LAST_ROUNDS = 3
APART = 0.35
# A search looks at so many by the best agreement of the grid, and at so many by transport, for each that is asked for,
# and at no fewer than these.
BY_SPECTRUM = 10
BY_AGREEMENT = 1.2
FEWEST = 5


@dataclass(frozen=True)
class ShapeDistance:
    """distance: with the floor taken off; raw: without; floor: of two quantisations of one surface, as measured for
    these two; rotation (3,3): of the first, determinant -1 where mirrored"""

    distance: float
    raw: float
    floor: float
    rotation: np.ndarray


@dataclass(frozen=True)
class Prepared:
    """What a signature is compared by: itself, few points in its place, and its coefficients (s,c) in harmonics of all
    degrees from 1, of the logarithm of its density and of its curvature."""

    full: Signature
    few: Signature
    coefficients: np.ndarray


def prepared(s: Signature) -> Prepared:
    """What a signature is compared by, at hand for many comparisons."""
    lattice = fibonacci_sphere(LATTICE)
    kernel = np.exp((lattice @ s.points.T - 1) / WIDTH**2)
    kernel *= 2 / (WIDTH**2 * len(s.points))
    values = np.stack([np.log(kernel.sum(axis=1) + 0.05), kernel @ s.curvature], axis=1)
    parts = harmonics(lattice)[1:]
    return Prepared(s, _fewer(s), np.concatenate([part.T @ values for part in parts]) * (4 * np.pi / LATTICE))


def _fewer(s: Signature) -> Signature:
    """Few points that stand for about as many others each: neighbours on the lattice that the points come from."""
    if len(s.points) <= FEW:
        return s
    owner = cKDTree(fibonacci_sphere(FEW)).query(fibonacci_sphere(len(s.points)))[1]
    count = np.bincount(owner, minlength=FEW)
    mean = [np.bincount(owner, column, FEW) / count for column in (*s.points.T, s.curvature)]
    return Signature(normalized(np.stack(mean[:3], axis=1)), mean[3], s.floor)


def shape_distance(a: Signature, b: Signature, curvature: float = CURVATURE) -> ShapeDistance:
    """How far apart two signatures are; (k,3) and (k,) each, of the same number of points.

    The square is the mean of squared angles, and of squared differences of curvature times a weight (Su 2015, equation
    3.31, on the sphere). It is the same whichever comes first.
    """
    return distance_of(prepared(a), prepared(b), curvature)


def distance_of(a: Prepared, b: Prepared, curvature: float = CURVATURE) -> ShapeDistance:
    """`shape_distance` of signatures that are prepared."""
    # Always the same way round.
    swapped = a.full.points.tobytes() > b.full.points.tobytes()
    one, other = (b, a) if swapped else (a, b)
    tried = [_refined(one.few, other.few, start, curvature, ROUNDS) for start in starts(one, other, curvature)[:BEST]]
    tried = sorted(tried, key=lambda found: found[0])[:FINALISTS]
    tried = [_refined(one.full, other.full, rotation, curvature, 1) for _, rotation in tried]
    rotation = min(tried, key=lambda found: found[0])[1]
    square, rotation = _refined(one.full, other.full, rotation, curvature, LAST_ROUNDS)
    floor = np.sqrt((a.full.floor**2 + b.full.floor**2) / 2)
    return ShapeDistance(
        float(np.sqrt(max(square - floor**2, 0))),
        float(np.sqrt(square)),
        float(floor),
        rotation.T if swapped else rotation,
    )


def starts(a: Prepared, b: Prepared, curvature: float = CURVATURE) -> np.ndarray:
    """Rotations (r,3,3), mirrored or not, under which two signatures agree best; apart, the best first."""
    grid = rotation_grid()
    first, second = a.coefficients, b.coefficients * [1, np.sqrt(curvature / CURVATURE)]
    found, score = [], []
    for sign, agreement in zip((1, -1), _agreements(first, second[None])[:, 0], strict=True):
        picked = _apart(grid, agreement, TRIED // 2)
        source = first * (sign ** _degrees())[:, None]
        rotations, value = refined_agreement(source, second, grid[picked], picked)
        kept = _apart(rotations, value, len(value))
        found.append(sign * rotations[kept])
        score.append(value[kept])
    return np.concatenate(found)[np.argsort(-np.concatenate(score), kind="stable")]


def _apart(rotations: np.ndarray, score: np.ndarray, most: int) -> np.ndarray:
    """Rows of the rotations (r,3,3) of the best scores (r,), none close to a better one."""
    left, chosen = np.argsort(-score, kind="stable")[: 40 * most], list[int]()
    while len(left) and len(chosen) < most:
        chosen.append(int(left[0]))
        # The trace of a rotation is 1 + 2 cos of its angle.
        cosine = (np.einsum("rab,ab->r", rotations[left], rotations[left[0]]) - 1) / 2
        left = left[cosine <= np.cos(APART)]
    return np.array(chosen)


def _degrees() -> np.ndarray:
    """The degree of each coefficient."""
    return np.repeat(np.arange(1, DEGREES + 1), 2 * np.arange(1, DEGREES + 1) + 1)


def _agreements(source: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Inner products (2,t,r) of functions of coefficients (s,c) under every rotation of the grid with others (t,s,c);
    and the same after an inversion, which turns the sign of odd degrees."""
    even, odd = np.zeros((2, len(targets), len(rotation_grid())), np.float32)
    column = row = 0
    for first in by_degree(source):
        size = len(first)
        both = targets[:, row : row + size] @ first.T
        part = both.reshape(len(targets), -1).astype(np.float32) @ grid_matrices()[:, column : column + size**2].T
        if size // 2 % 2:
            odd += part
        else:
            even += part
        row, column = row + size, column + size**2
    return np.stack([even + odd, even - odd])


def _refined(
    a: Signature, b: Signature, rotation: np.ndarray, curvature: float, rounds: int
) -> tuple[float, np.ndarray]:
    """Least mean cost and its rotation (3,3), by assignments and rotations in turn."""
    best, found = np.inf, rotation
    mirrored = bool(np.linalg.det(rotation) < 0)
    for _ in range(rounds):
        cost = pair_costs(Signature(a.points @ rotation.T, a.curvature), b, curvature)
        rows, columns = linear_sum_assignment(cost)
        mean = float(cost[rows, columns].mean())
        if mean >= best - 1e-9:
            break
        best, found = mean, rotation
        rotation = rotation_of_pairs(a.points[rows], b.points[columns], mirrored).rotation
    return best, found


def spectrum(coefficients: np.ndarray) -> np.ndarray:
    """What no rotation or mirroring changes of coefficients (...,s,c), (..., c * DEGREES): the power of density and
    curvature in each degree of spherical harmonics."""
    first = np.cumsum([0, *(2 * degree + 1 for degree in range(1, DEGREES))])
    power = np.sqrt(np.add.reduceat(np.square(coefficients, dtype=float), first, axis=-2))
    return power.reshape(*power.shape[:-2], -1)


def nearest(
    s: Signature, library: Sequence[Signature], top: int, coefficients: np.ndarray | None = None
) -> list[tuple[int, ShapeDistance]]:
    """The `top` nearest of a library, nearest first; coefficients (l,s,2) of all of it, if at hand.

    Spectra choose several times as many as asked for, and of these those that agree best under a rotation of the grid;
    these alone are compared by transport.
    """
    mine = prepared(s)
    if coefficients is None:
        coefficients = np.stack([prepared(other).coefficients for other in library])
    away = ((spectrum(coefficients) - spectrum(mine.coefficients)) ** 2).sum(axis=1)
    order = np.argsort(away, kind="stable")[: max(BY_SPECTRUM * top, FEWEST)]
    targets = coefficients[order].astype(float)
    # The least squared difference of the functions, but for what is the same for all.
    away = (targets**2).sum(axis=(1, 2)) - 2 * _agreements(mine.coefficients, targets).max(axis=(0, 2))
    chosen = order[np.argsort(away, kind="stable")[: max(round(BY_AGREEMENT * top), FEWEST)]]
    found = [(int(k), distance_of(mine, prepared(library[int(k)]))) for k in chosen]
    return sorted(found, key=lambda pair: (pair[1].raw ** 2 - pair[1].floor ** 2, pair[0]))[:top]
