"""Move points on the sphere without divergence, by stream functions made of local bumps (Dominitz, Tannenbaum 2010).

A stream function psi moves x with the velocity grad psi x x, which keeps every area. With psi a sum of bumps
K(|x - y_k|), each around a centre y_k, it is known exactly everywhere, so the flow keeps areas to the precision of its
integration, whatever the mesh; this is the multiresolution basis of Dominitz, Tannenbaum 2010, section 3.3, on the
sphere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ..linalg.sparse import solve_spd
from ..mesh.geometry import cross3
from ..mesh.spherical_geometry import fibonacci_sphere, normalized

# Radius of a bump, in distances between neighbouring centres.
RADIUS = 2.5
# Radii within which points are looked for, so that the same pairs serve while they move.
SLACK = 1.25
# Of the squared coefficients, relative to the diagonal of their energy.
RIDGE = 1e-2
# The same, relative to the largest entry of that diagonal: for bumps that no point is near.
LEAST_RIDGE = 1e-12


@dataclass(frozen=True)
class BumpBasis:
    """Centres (k,3) of bumps, spread evenly, and their radius."""

    centres: np.ndarray
    radius: float


def bump_basis(count: int) -> BumpBasis:
    """A basis of `count` bumps, centred on a spherical Fibonacci lattice (Gonzalez 2010)."""
    return BumpBasis(centres=fibonacci_sphere(count), radius=RADIUS * np.sqrt(4 * np.pi / count))


@dataclass(frozen=True)
class BumpPairs:
    """Points and centres (p,) each that are, or may soon be, near to each other; point_count: of all points."""

    point: np.ndarray
    centre: np.ndarray
    point_count: int


def bump_pairs(points: np.ndarray, basis: BumpBasis) -> BumpPairs:
    """Pairs of points (n,3) and centres of a basis that may come within its radius while no point moves far."""
    near = cKDTree(points).sparse_distance_matrix(
        cKDTree(basis.centres), SLACK * basis.radius, output_type="coo_matrix", p=2.0
    )
    return BumpPairs(point=near.row.astype(np.int64), centre=near.col.astype(np.int64), point_count=len(points))


def longest_motion(basis: BumpBasis) -> float:
    """How far points may move before their pairs have to be found anew."""
    return (SLACK - 1) * basis.radius


def velocity(points: np.ndarray, basis: BumpBasis, pairs: BumpPairs, coefficients: np.ndarray) -> np.ndarray:
    """Velocity (n,3), tangent to the sphere, of the points (n,3) under bumps with the coefficients (k,)."""
    y = basis.centres[pairs.centre]
    strength = coefficients[pairs.centre] * _slope(points[pairs.point], y, basis.radius)
    pull = np.stack([np.bincount(pairs.point, strength * c, pairs.point_count) for c in y.T], axis=1)
    return cross3(pull, points)


def best_flow(
    points: np.ndarray, mass: np.ndarray, target: np.ndarray, basis: BumpBasis, pairs: BumpPairs
) -> np.ndarray:
    """Coefficients (k,) of the flow nearest to the target velocities (n,3), in the mean over the mass (n,)."""
    x, y = points[pairs.point], basis.centres[pairs.centre]
    v = cross3(y, x) * _slope(x, y, basis.radius)[:, None]
    k, weight = len(basis.centres), np.sqrt(mass)[pairs.point]
    shape = (pairs.point_count, k)
    flows = sp.vstack([sp.csr_matrix((weight * c, (pairs.point, pairs.centre)), shape=shape) for c in v.T]).tocsr()
    energy = (flows.T @ flows).tocsc()
    diagonal = energy.diagonal()
    energy += sp.diags(RIDGE * diagonal + LEAST_RIDGE * diagonal.max() + 1e-300)
    return solve_spd(energy, flows.T @ (np.sqrt(mass)[:, None] * target).T.ravel())


def advect(points: np.ndarray, basis: BumpBasis, pairs: BumpPairs, coefficients: np.ndarray) -> np.ndarray:
    """Move points (n,3) for a time of 1 with the velocity of coefficients (k,): one classical step of Runge and Kutta.

    Nothing may move farther than `longest_motion`.
    """

    def v(x: np.ndarray) -> np.ndarray:
        return velocity(x, basis, pairs, coefficients)

    return normalized(points + runge_kutta_slopes(v, points, 1.0) / 6)


def runge_kutta_slopes(velocity: Callable[[np.ndarray], np.ndarray], points: np.ndarray, time: float) -> np.ndarray:
    """k1 + 2 k2 + 2 k3 + k4 (n,3) of Runge and Kutta's step from unit vectors (n,3): six times the mean velocity."""
    k1 = velocity(points)
    k2 = velocity(normalized(points + time / 2 * k1))
    k3 = velocity(normalized(points + time / 2 * k2))
    k4 = velocity(normalized(points + time * k3))
    return k1 + 2 * k2 + 2 * k3 + k4


def _slope(x: np.ndarray, y: np.ndarray, radius: float) -> np.ndarray:
    """Derivative by <x, y> of Wendland's bump (1 - r)^4 (4 r + 1), r = |x - y| / radius."""
    r = np.linalg.norm(x - y, axis=1) / radius
    return 20 / radius**2 * np.maximum(1 - r, 0) ** 3
