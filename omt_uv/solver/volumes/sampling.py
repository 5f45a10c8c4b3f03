"""Sample fields of bodies at places that correspond, and points inside with equal volumes around them.

The ball is divided into shells of equal volume, and every shell by the triangles of a divided icosahedron (Hu, Zou,
Hua 2014, section 6): place number k of one body corresponds to that of every other one.
"""

from __future__ import annotations

import numpy as np

from ..counts import BYTES_PER_ELEMENT, check_memory, quadrupled, real
from .shells import icosphere
from .transfer import TetLocation


def ball_index(levels: int, shells: int) -> np.ndarray:
    """Places (s,3) in the unit ball, shell after shell from the middle, each on the 20 * 4^levels faces of an
    icosahedron. Raises CountError for more than this machine has memory for."""
    check_memory(20 * real(shells) * quadrupled(levels), BYTES_PER_ELEMENT, "An index of about {} places")
    vertices, triangles = icosphere(levels)
    centre = vertices[triangles].mean(axis=1)
    centre /= np.linalg.norm(centre, axis=1)[:, None]
    # Half of the volume of a shell is below its middle.
    radii = np.cbrt((2 * np.arange(shells) + 1) / (2 * shells))
    return (radii[:, None, None] * centre).reshape(-1, 3)


def sampled_field(positions: np.ndarray, tets: np.ndarray, field: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values of a field (n,...) of a body at places (s,3) of its ball map; positions (n,3) of its tetrahedra (m,4)
    there."""
    return TetLocation(positions, tets).values(places, field)


def interior_points(
    points: np.ndarray, positions: np.ndarray, tets: np.ndarray, count: int, seed: int = 0
) -> np.ndarray:
    """Points (count,3) inside a body, evenly dense: an even lattice of the ball, taken back by the map.

    points (n,3), tetrahedra (m,4), and positions (n,3) in the ball; seed turns the lattice

    Raises
    ------
    CountError : more than this machine has memory for
    """
    check_memory(count, BYTES_PER_ELEMENT, "A lattice of {} points")
    rng = np.random.default_rng(seed)
    shift = rng.uniform(size=3)
    k = np.arange(count)[:, None]
    # The additive recurrence of the plastic number's cubic relative fills the cube evenly (Roberts 2018).
    ratio = 1.2207440846057596
    u = (shift + (k + 1) * ratio ** -np.arange(1.0, 4.0)) % 1.0
    z, angle = 2 * u[:, 0] - 1, 2 * np.pi * u[:, 1]
    ring = np.sqrt(1 - z**2)
    ball = np.cbrt(u[:, 2])[:, None] * np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    return TetLocation(positions, tets).values(ball, points)
