"""Flows on the sphere without divergence: stream functions of local bumps in several sizes, and what they do to a cost.

A stream function psi moves x with the velocity grad psi x x, which keeps every area. With psi a sum of bumps
K(|x - y_k|), each around a centre y_k, it is known exactly everywhere, so the flow keeps areas to the precision of its
integration, whatever the mesh; this is the multiresolution basis of Dominitz, Tannenbaum 2010, section 3.3, on the
sphere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ..linalg.sparse import solve_spd

# Radius of a bump in units of the distance between the centres, and how much farther points are looked for, so that
# the same pairs serve while they move.
RADIUS, SLACK = 2.5, 1.25
# Weight of the coefficients themselves, relative to the diagonal of their energy.
RIDGE = 1e-2


@dataclass(frozen=True)
class Level:
    """Centres (k,3) of bumps, spread evenly, and their radius."""

    centres: np.ndarray
    radius: float


def level(count: int) -> Level:
    """A level of `count` bumps, centred on a spherical Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + np.sqrt(5)) * k
    r = np.sqrt(1 - z**2)
    centres = np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    return Level(centres, RADIUS * np.sqrt(4 * np.pi / count))


@dataclass(frozen=True)
class Pairs:
    """Points and centres (p,) each that are, or may soon be, near to each other, and how many points there are."""

    point: np.ndarray
    centre: np.ndarray
    count: int


def pairs(points: np.ndarray, at: Level) -> Pairs:
    """Pairs of points (n,3) and centres of a level that may come within its radius while no point moves far."""
    near = cKDTree(points).sparse_distance_matrix(
        cKDTree(at.centres), SLACK * at.radius, output_type="coo_matrix", p=2.0
    )
    return Pairs(near.row.astype(np.int64), near.col.astype(np.int64), len(points))


def allowance(at: Level) -> float:
    """How far points may move before their pairs have to be found anew."""
    return (SLACK - 1) * at.radius


def velocity(points: np.ndarray, at: Level, close: Pairs, coefficients: np.ndarray) -> np.ndarray:
    """Velocity (n,3), tangent to the sphere, of the points (n,3) under bumps with the coefficients (k,)."""
    y = at.centres[close.centre]
    strength = coefficients[close.centre] * _slope(points[close.point], y, at.radius)
    pull = np.stack([np.bincount(close.point, strength * c, close.count) for c in y.T], axis=1)
    return np.cross(pull, points)


def best_flow(points: np.ndarray, mass: np.ndarray, wish: np.ndarray, at: Level, close: Pairs) -> np.ndarray:
    """Coefficients (k,) of the flow nearest to the velocities wished for (n,3), in the mean over the mass (n,)."""
    x, y = points[close.point], at.centres[close.centre]
    v = np.cross(y, x) * _slope(x, y, at.radius)[:, None]
    k, weight = len(at.centres), np.sqrt(mass)[close.point]
    shape = (close.count, k)
    basis = sp.vstack([sp.csr_matrix((weight * c, (close.point, close.centre)), shape=shape) for c in v.T]).tocsr()
    energy = (basis.T @ basis).tocsc()
    diagonal = energy.diagonal()
    energy += sp.diags(RIDGE * diagonal + 1e-12 * diagonal.max() + 1e-300)
    return solve_spd(energy, basis.T @ (np.sqrt(mass)[:, None] * wish).T.ravel())


def transported(points: np.ndarray, at: Level, close: Pairs, coefficients: np.ndarray) -> np.ndarray:
    """The points (n,3) after a time of 1 under bumps with the coefficients (k,): one step of Runge and Kutta.

    Nothing may move farther than the `allowance`.
    """

    def v(x: np.ndarray) -> np.ndarray:
        return velocity(x, at, close, coefficients)

    k1 = v(points)
    k2 = v(_unit(points + k1 / 2))
    k3 = v(_unit(points + k2 / 2))
    k4 = v(_unit(points + k3))
    return _unit(points + (k1 + 2 * k2 + 2 * k3 + k4) / 6)


def _unit(x: np.ndarray) -> np.ndarray:
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def _slope(x: np.ndarray, y: np.ndarray, radius: float) -> np.ndarray:
    """Derivative by <x, y> of Wendland's bump (1 - r)^4 (4 r + 1), r = |x - y| / radius."""
    r = np.linalg.norm(x - y, axis=1) / radius
    return 20 / radius**2 * np.maximum(1 - r, 0) ** 3
