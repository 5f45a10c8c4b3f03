"""The Wasserstein distance of signatures, least over rotations and mirroring.

All rotations of an even grid are scored at once by how well densities and curvatures agree in spherical harmonics,
before any is refined: refinement from random starts ends at wrong rotations. The best that are far apart are refined
by assignments and Kabsch's rotation in turn, of few points first. Markers leave no rotation to look for: disks are
compared as they lie.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..errors import LandmarkError
from ..mesh.spherical_geometry import fibonacci_sphere, normalized
from ..registration.alignment import rotation_grid, rotation_of_pairs
from .harmonics import DEGREES, by_degree, grid_matrices, harmonics, refined_agreement
from .signature import CURVATURE, Signature, pair_costs

# Points of the sphere at which densities are smoothed, and the width of the kernel, in radians.
LATTICE = 500
WIDTH = 0.25
# So many of the grid's rotations are turned on to the best agreement nearby; the best of them that are apart, by more
# than this angle in radians, are refined once on few points, the foremost on all points, and the best of these in so
# many rounds more.
TRIED = 24
BEST = 6
FEW = 200
FINALISTS = 2
LAST_ROUNDS = 2
APART = 0.35
# What costs more than the best by this factor is not looked at further.
CLEARLY = 1.1
# Places of the disk at which smoothed densities are kept, and the width of the kernel, as a share of its radius.
PLACES = 99
DISK_WIDTH = 0.2
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
    degrees from 1, of the logarithm of its density and of its curvature; on a disk, what both are at even places."""

    full: Signature
    few: Signature
    coefficients: np.ndarray


def prepared(s: Signature, coefficients: np.ndarray | None = None) -> Prepared:
    """What a signature is compared by, at hand for many comparisons; coefficients (s,c), where they are known."""
    if s.on_disk:
        return Prepared(s, s, _values_on_disk(s) if coefficients is None else coefficients)
    return Prepared(s, _fewer(s), _coefficients(s) if coefficients is None else coefficients)


def _coefficients(s: Signature) -> np.ndarray:
    lattice, parts = _lattice()
    kernel = np.exp((lattice @ s.points.T - 1) / WIDTH**2)
    kernel *= 2 / (WIDTH**2 * len(s.points))
    values = np.stack([np.log(kernel.sum(axis=1) + 0.05), kernel @ s.curvature], axis=1)
    return np.concatenate([part.T @ values for part in parts]) * (4 * np.pi / LATTICE)


@functools.lru_cache(maxsize=1)
def _lattice() -> tuple[np.ndarray, list[np.ndarray]]:
    """Even points of the sphere, and the harmonics of all degrees from 1 there."""
    lattice = fibonacci_sphere(LATTICE)
    return lattice, harmonics(lattice)[1:]


def _values_on_disk(s: Signature) -> np.ndarray:
    k = np.arange(PLACES) + 0.5
    ring, angle = np.sqrt(k / PLACES), np.pi * (1 + np.sqrt(5)) * k
    places = np.stack([ring * np.cos(angle), ring * np.sin(angle)], axis=1)
    away = ((places[:, None] - s.points) ** 2).sum(axis=2)
    kernel = np.exp(-away / (2 * DISK_WIDTH**2)) / (2 * DISK_WIDTH**2 * len(s.points))
    return np.stack([np.log(kernel.sum(axis=1) + 0.05), kernel @ s.curvature], axis=1)


def _fewer(s: Signature) -> Signature:
    """Few points that stand for about as many others each: neighbours on the lattice that the points come from."""
    if len(s.points) <= FEW:
        return s
    owner = _owners(len(s.points))
    count = np.bincount(owner, minlength=FEW)
    mean = [np.bincount(owner, column, FEW) / count for column in (*s.points.T, s.curvature)]
    return Signature(normalized(np.stack(mean[:3], axis=1)), mean[3], s.floor)


@functools.lru_cache(maxsize=4)
def _owners(count: int) -> np.ndarray:
    """Which of few even points is nearest to each of `count`."""
    return cKDTree(fibonacci_sphere(FEW)).query(fibonacci_sphere(count))[1]


def shape_distance(a: Signature, b: Signature, curvature: float = CURVATURE) -> ShapeDistance:
    """How far apart two signatures are; (k,3) and (k,) each, of the same number of points.

    The square is the mean of squared angles, and of squared differences of curvature times a weight (Su 2015, equation
    3.31, on the sphere). It is the same whichever comes first.
    """
    return distance_of(prepared(a), prepared(b), curvature)


def distance_of(a: Prepared, b: Prepared, curvature: float = CURVATURE) -> ShapeDistance:
    """`shape_distance` of signatures that are prepared."""
    # Always the same way round.
    if a.full.points.tobytes() > b.full.points.tobytes():
        found = _told(b, a, *_least(b, a, curvature))
        return ShapeDistance(found.distance, found.raw, found.floor, found.rotation.T)
    return _told(a, b, *_least(a, b, curvature))


def _foremost(tried: list) -> list:
    """Those that cost least, without what costs clearly more, the best first."""
    order = sorted(tried, key=lambda found: found[0])[:FINALISTS]
    return [found for found in order if found[0] <= CLEARLY * order[0][0]]


def _told(a: Prepared, b: Prepared, square: float, rotation: np.ndarray) -> ShapeDistance:
    floor = np.sqrt((a.full.floor**2 + b.full.floor**2) / 2)
    least = float(np.sqrt(max(square - floor**2, 0)))
    return ShapeDistance(least, float(np.sqrt(square)), float(floor), rotation)


def _least(
    a: Prepared, b: Prepared, curvature: float, agreements: np.ndarray | None = None
) -> tuple[float, np.ndarray]:
    """The least mean cost and its rotation (3,3); agreements (2,r), where they are known."""
    if a.full.on_disk != b.full.on_disk:
        raise LandmarkError("One shape has markers and the other has none", "Give both markers, or neither")
    if a.full.on_disk:
        return _least_on_disk(a.full, b.full, curvature)
    first = starts(a, b, curvature, agreements)[:BEST]
    tried = _foremost([_refined(a.few, b.few, start, curvature, 1) for start in first])
    tried = _foremost([_refined(a.full, b.full, onward, curvature, 1) for _, _, onward in tried])
    square, rotation, onward = tried[0]
    last = _refined(a.full, b.full, onward, curvature, LAST_ROUNDS)
    return last[:2] if last[0] < square else (square, rotation)


def _least_on_disk(a: Signature, b: Signature, curvature: float) -> tuple[float, np.ndarray]:
    """The least mean cost as they lie, or mirrored across the line through the markers; and that as a matrix (3,3)."""
    found = []
    for sides in ([1, 1, 1], [1, -1, 1]):
        cost = pair_costs(Signature(a.points * sides[:2], a.curvature), b, curvature)
        found.append((float(cost[linear_sum_assignment(cost)].mean()), np.diag(sides).astype(float)))
    return min(found, key=lambda pair: pair[0])


def starts(a: Prepared, b: Prepared, curvature: float = CURVATURE, agreements: np.ndarray | None = None) -> np.ndarray:
    """Rotations (r,3,3), mirrored or not, under which two signatures agree best; apart, the best first. Agreements
    (2,r) with the rotations of the grid and their mirror images, where they are known."""
    grid = rotation_grid()
    first, second = a.coefficients, b.coefficients * [1, np.sqrt(curvature / CURVATURE)]
    if agreements is None:
        agreements = _agreements(first, second[None])[:, 0]
    found, score = [], []
    for sign, agreement in zip((1, -1), agreements, strict=True):
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
) -> tuple[float, np.ndarray, np.ndarray]:
    """Least mean cost, its rotation (3,3), and the one to go on with, by assignments and rotations in turn."""
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
    return best, found, rotation


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
    if s.on_disk:
        away = ((coefficients - mine.coefficients) ** 2).sum(axis=(1, 2))
        chosen = np.argsort(away, kind="stable")[: max(BY_SPECTRUM * top, FEWEST)]
        others = [prepared(library[int(k)], coefficients[k]) for k in chosen]
        found = [_told(mine, other, *_least(mine, other, CURVATURE)) for other in others]
    else:
        chosen, agreements = _agreeing(mine, coefficients, top)
        others = [prepared(library[int(k)], coefficients[k].astype(float)) for k in chosen]
        pairs = zip(others, agreements, strict=True)
        found = [_told(mine, other, *_least(mine, other, CURVATURE, known)) for other, known in pairs]
    listed = zip(chosen.tolist(), found, strict=True)
    return sorted(listed, key=lambda pair: (pair[1].raw ** 2 - pair[1].floor ** 2, pair[0]))[:top]


def _agreeing(mine: Prepared, coefficients: np.ndarray, top: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows (k,) of coefficients (l,s,2) that look most alike, and their agreements (k,2,r) on the grid."""
    away = ((spectrum(coefficients) - spectrum(mine.coefficients)) ** 2).sum(axis=1)
    order = np.argsort(away, kind="stable")[: max(BY_SPECTRUM * top, FEWEST)]
    targets = coefficients[order].astype(float)
    agreements = _agreements(mine.coefficients, targets)
    # The least squared difference of the functions, but for what is the same for all.
    away = (targets**2).sum(axis=(1, 2)) - 2 * agreements.max(axis=(0, 2))
    best = np.argsort(away, kind="stable")[: max(round(BY_AGREEMENT * top), FEWEST)]
    return order[best], agreements[:, best].transpose(1, 0, 2)
