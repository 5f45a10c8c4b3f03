"""Map between plane and unit sphere, and centre maps to the sphere, by Moebius maps (Baden, Crane, Kazhdan 2018)."""

from __future__ import annotations

import numpy as np

from ..errors import PrecisionError

MAX_STEPS = 60  # of Newton's method for the centre


def to_sphere(z: np.ndarray) -> np.ndarray:
    """Inverse stereographic projection of complex numbers (n,) to unit vectors (n,3); 0 is the south pole.

    Counter-clockwise in the plane is counter-clockwise seen from *inside*: mirrored, so that outside sees it so.
    """
    square = z.real**2 + z.imag**2
    points = np.column_stack([2 * z.real, -2 * z.imag, square - 1]) / (1 + square)[:, None]
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def to_plane(points: np.ndarray) -> np.ndarray:
    """Stereographic projection of unit vectors (n,3) from the north pole, (n,) complex; inverts `to_sphere`."""
    x, y, z = points.T
    # Near the south pole 1 - z is exact; near the north pole it is not, but there the plane is infinite.
    return (x - 1j * y) / (1 - z)


def boost(points: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Moebius map of unit vectors (n,3) that moves the point `centre` (3,) of the open ball to 0."""
    apart = points - centre
    moved = (1 - centre @ centre) * apart / (apart**2).sum(axis=1)[:, None] - centre
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)


def centre_on_sphere(points: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) after the Moebius map that brings their mean, weighted by mass (n,), to 0.

    Newton's method on the convex energy whose gradient is the mean (Baden, Crane, Kazhdan 2018); unique up to a
    rotation when no half of the mass lies in one point. Raises PrecisionError where there is such a point.
    """
    mass = mass / mass.sum()
    for _ in range(MAX_STEPS):
        mean = mass @ points
        if np.linalg.norm(mean) < 1e-14:
            return points
        hessian = 2 * (np.eye(3) - (points * mass[:, None]).T @ points)
        if np.linalg.eigvalsh(hessian)[0] < 1e-15:
            break
        step = np.linalg.solve(hessian, mean)
        size = np.linalg.norm(step)
        step = step * min(1.0, 0.5 / size)
        moved = boost(points, step)
        while np.linalg.norm(mass @ moved) >= np.linalg.norm(mean) and size > 1e-12 and np.linalg.norm(step) > 1e-12:
            step /= 2
            moved = boost(points, step)
        if np.linalg.norm(mass @ moved) >= np.linalg.norm(mean):
            return points
        points = moved
    if np.linalg.norm(mass @ points) < 1e-9:
        return points
    raise PrecisionError("The map gathers half of the surface in one point of the sphere")
