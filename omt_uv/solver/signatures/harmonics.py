"""Functions on the sphere in real spherical harmonics, and what rotations make of them (Kazhdan, Funkhouser,
Rusinkiewicz 2003, for their powers)."""

from __future__ import annotations

import functools

import numpy as np

from ..mesh.spherical_geometry import fibonacci_sphere
from ..registration.alignment import DIRECTIONS, TURNS, rotation_grid, small_rotations

# Degrees that are compared; details below 180 degrees over it go unseen.
DEGREES = 9
# Small rotations of each level, the greatest angle of the first in radians, and what the next ones are smaller by.
NEARBY = 80
ANGLE = 0.2
SHRINKING = 0.5
LEVELS = 5
# Points from which the matrices of rotations are found: more than there are harmonics of one degree.
SAMPLES = 80


def harmonics(points: np.ndarray, degrees: int = DEGREES) -> list[np.ndarray]:
    """Orthonormal real harmonics at unit vectors (n,3): of each degree l from 0 an array (n, 2 l + 1).

    Orders m go from -l to l, as in x + i y to the power m, whose imaginary parts come first.
    """
    x, y, z = points.T
    power = np.ones(len(z), complex)
    # By order: the polynomials of z of all degrees, without the powers of x and y.
    columns: list[dict[int, np.ndarray]] = [{} for _ in range(degrees + 1)]
    first = np.full(len(z), np.sqrt(1 / (4 * np.pi)))
    for m in range(degrees + 1):
        if m:
            first = first * np.sqrt((2 * m + 1) / (2 * m))
            power = power * (x + 1j * y)
        before, now = np.zeros(len(z)), first
        for degree in range(m, degrees + 1):
            if degree > m:
                rise = np.sqrt((4 * degree**2 - 1) / (degree**2 - m**2))
                fall = np.sqrt(max((degree - 1) ** 2 - m**2, 0) / (4 * (degree - 1) ** 2 - 1))
                before, now = now, rise * (z * now - fall * before)
            if m:
                columns[degree][m], columns[degree][-m] = (np.sqrt(2) * now * part for part in (power.real, power.imag))
            else:
                columns[degree][0] = now
    return [np.stack([column[m] for m in range(-d, d + 1)], axis=1) for d, column in enumerate(columns)]


@functools.lru_cache(maxsize=1)
def grid_matrices() -> np.ndarray:
    """What each rotation R of the grid does to harmonics, Y(R x) = D(R) Y(x): all D of degrees from 1, flat, (r, s)."""
    grid = rotation_grid().reshape(DIRECTIONS, TURNS, 3, 3)
    bases, turns = grid[:, 0], grid[0, 0].T @ grid[0]
    at = fibonacci_sphere(SAMPLES)
    inverse = [np.linalg.pinv(part) for part in harmonics(at)]
    blocks = []
    of_bases, of_turns = (_matrices(rotations, at, inverse) for rotations in (bases, turns))
    for base, turn in zip(of_bases, of_turns, strict=True):
        both = np.einsum("dab,tbc->dtac", base, turn)
        blocks.append(both.reshape(DIRECTIONS * TURNS, -1).astype(np.float32))
    return np.concatenate(blocks[1:], axis=1)


@functools.lru_cache(maxsize=1)
def small_matrices() -> list[tuple[np.ndarray, list[np.ndarray]]]:
    """Of every level, small rotations (r,3,3), the identity first, and their D (r, 2 l + 1, 2 l + 1) from degree 1."""
    at = fibonacci_sphere(SAMPLES)
    inverse = [np.linalg.pinv(part) for part in harmonics(at)]
    rng = np.random.default_rng(0)
    levels = []
    for level in range(LEVELS):
        near = small_rotations(rng, NEARBY, ANGLE * SHRINKING**level)
        rotations = np.concatenate([np.eye(3)[None], near])
        levels.append((rotations, _matrices(rotations, at, inverse)[1:]))
    return levels


def by_degree(coefficients: np.ndarray) -> list[np.ndarray]:
    """Coefficients (s,c) of all degrees from 1, as an array (2 l + 1, c) of each."""
    return np.split(coefficients, np.cumsum([2 * degree + 1 for degree in range(1, DEGREES)]))


def refined_agreement(
    source: np.ndarray, target: np.ndarray, rotations: np.ndarray, picked: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (r,3,3) turned further to where functions agree best, and how much (r,).

    source, target : coefficients (s,c); picked (r,) : rows of the rotations in the grid
    """
    matrices = grid_matrices()[picked]
    column, turned = 0, []
    goal = by_degree(target)
    for part in by_degree(source):
        size = len(part)
        turned.append(matrices[:, column : column + size**2].reshape(-1, size, size) @ part)
        column += size**2
    for near, blocks in small_matrices():
        score = np.zeros((len(near), len(rotations)))
        for block, part, g in zip(blocks, turned, goal, strict=True):
            both = g @ part.transpose(0, 2, 1)
            score += block.reshape(len(near), -1) @ both.reshape(len(rotations), -1).T
        best = score.argmax(axis=0)
        rotations = near[best] @ rotations
        turned = [block[best] @ part for block, part in zip(blocks, turned, strict=True)]
    return rotations, score[best, np.arange(len(best))]


def _matrices(rotations: np.ndarray, at: np.ndarray, inverse: list[np.ndarray]) -> list[np.ndarray]:
    """D (r, 2 l + 1, 2 l + 1) of rotations (r,3,3), of every degree l."""
    turned = harmonics(np.einsum("rab,kb->rka", rotations, at).reshape(-1, 3))
    return [
        np.einsum("mk,rkn->rnm", inv, part.reshape(len(rotations), len(at), -1))
        for inv, part in zip(inverse, turned, strict=True)
    ]
