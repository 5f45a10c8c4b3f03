"""Interpolate velocities by a divergence-free field of radial basis functions (Narcowich, Ward 1994).

The kernel is (grad grad^T - I Lap) psi with psi = exp(-lambda r^2); in d dimensions and over 2 lambda,

    Phi(x) = psi(|x|) [ (d - 1) I + 2 lambda (x x^T - |x|^2 I) ],

positive definite, and every column of it is free of divergence. What is asked of the field are components along given
directions at given places: all of them at a handle, the one along the normal at a wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..errors import HandleError

# How much sharper the second kernel is, where there is one: a fifth of the radius.
SHARPER = 25.0
# Added to the diagonal, relative to it; rounding alone may make the matrix of many close places indefinite.
RIDGE = 1e-12
# Corrections of the coefficients by what the field misses.
CORRECTIONS = 2
# What may be missed, relative to the greatest value.
MISSED = 1e-7


@dataclass(frozen=True)
class Conditions:
    """Components of the field that are given: along directions (r,d) at places number `place` (r,) of points (p,d)."""

    points: np.ndarray
    place: np.ndarray
    directions: np.ndarray


@dataclass(frozen=True)
class FlowField:
    """A field without divergence, sum_i Phi(x - x_i) c_i: centres x_i (p,d), coefficients c_i (p,d), and lambda.

    near : share of a kernel that is `SHARPER` beside the first
    """

    centres: np.ndarray
    coefficients: np.ndarray
    sharpness: float
    near: float = 0.0

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Velocities (k,d) at points (k,d)."""
        lam, d, c = self.sharpness, points.shape[1], self.coefficients
        augmented = np.column_stack([points, np.square(points).sum(axis=1), np.ones(len(points))])
        # -lambda |x - x_i|^2 and (x - x_i).c_i as products of matrices.
        exponent, along = augmented @ self._exponent, points @ c.T
        along -= np.einsum("pd,pd->p", self.centres, c)
        psi = np.exp(exponent)
        along *= psi
        exponent *= 2
        exponent += d - 1
        exponent *= psi
        velocity = exponent @ c
        velocity += 2 * lam * (points * along.sum(axis=1)[:, None] - along @ self.centres)
        return velocity + self._narrow(points) if self.near else velocity

    @cached_property
    def _narrow(self) -> FlowField:
        """What the sharper kernel adds."""
        return FlowField(self.centres, self.near * self.coefficients, SHARPER * self.sharpness)

    @cached_property
    def _exponent(self) -> np.ndarray:
        """What (x, |x|^2, 1) is multiplied with for -lambda |x - x_i|^2, (d + 2, p)."""
        lam, x = self.sharpness, self.centres
        ones = np.full((1, len(x)), -lam)
        return np.concatenate([2 * lam * x.T, ones, -lam * np.square(x).sum(axis=1)[None]])


def conditions(handles: np.ndarray, walls: np.ndarray, normals: np.ndarray) -> Conditions:
    """All components at handles (h,d), then those along normals (w,d) at walls (w,d)."""
    h, d = handles.shape
    place = np.concatenate([np.repeat(np.arange(h), d), h + np.arange(len(walls))])
    directions = np.concatenate([np.tile(np.eye(d), (h, 1)), normals])
    return Conditions(np.concatenate([handles, walls]), place, directions)


def kernel_matrix(given: Conditions, sharpness: float) -> np.ndarray:
    """The symmetric matrix (r,r) of conditions against conditions."""
    p, a = given.points, given.directions
    offset = p[:, None, :] - p[None, :, :]
    square = np.einsum("ijd,ijd->ij", offset, offset)
    psi = np.exp(-sharpness * square)
    rows, columns = given.place[:, None], given.place[None, :]
    square, psi = square[rows, columns], psi[rows, columns]
    # a_r . (y_r - y_s), and the same from the other side.
    mine = a @ p.T
    first = mine[np.arange(len(a)), given.place][:, None] - mine[:, given.place]
    second = -first.T
    return psi * ((p.shape[1] - 1 - 2 * sharpness * square) * (a @ a.T) + 2 * sharpness * first * second)


def interpolated_field(given: Conditions, values: np.ndarray, sharpness: float, near: float = 0.0) -> FlowField:
    """The smoothest field without divergence that has values (r,) for its conditions; near: see `FlowField`.

    Raises
    ------
    HandleError : the conditions contradict each other, in double precision
    """
    matrix = kernel_matrix(given, sharpness)
    if near:
        matrix = matrix + near * kernel_matrix(given, SHARPER * sharpness)
    loaded = matrix + RIDGE * np.trace(matrix) / max(len(matrix), 1) * np.eye(len(matrix))
    try:
        factor = cho_factor(loaded, lower=True, overwrite_a=True, check_finite=False)
    except LinAlgError as error:
        raise HandleError("Handles are too close to one another for this radius") from error
    weights = cho_solve(factor, values, check_finite=False)
    for _ in range(CORRECTIONS):
        weights += cho_solve(factor, values - matrix @ weights, check_finite=False)
    missed = np.abs(values - matrix @ weights).max(initial=0.0)
    if not missed <= MISSED * np.abs(values).max(initial=0.0):
        raise HandleError("Handles are too close to one another for this radius, and move apart")
    coefficients = np.zeros_like(given.points)
    np.add.at(coefficients, given.place, weights[:, None] * given.directions)
    return FlowField(given.points, coefficients, sharpness, near)
