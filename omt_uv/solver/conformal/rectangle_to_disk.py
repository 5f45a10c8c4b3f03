"""Map a rectangle conformally to the unit disk, exactly, by Jacobi's elliptic sine (DLMF 22)."""

from __future__ import annotations

import numpy as np

from ..errors import PrecisionError
from ..mesh.geometry import halfedge_lengths, lengths

# Longer side over shorter: the image of a longer rectangle has its ends squeezed below double precision.
MAX_ASPECT = 8.0
MAX_ROUNDS = 1000  # of Moebius maps, when a disk is centred
# A mean this near to the middle of the unit disk is there.
CENTRED = 1e-3


def rectangle_to_disk(points: np.ndarray, height: float) -> np.ndarray:
    """Map points (n,2) of the rectangle [0,1] x [0,height] conformally to the unit disk, its centre to 0.

    sn maps the rectangle [-K, K] x [0, K'] to the upper half plane; a Cayley map brings that to the disk.
    With the longer side as the height the nome q is at most exp(-2 pi), and three terms of the theta
    series are exact to double precision (DLMF 20.2, 22.2.4).

    Raises
    ------
    PrecisionError : the rectangle is too long for its image to be resolved
    """
    z = points[:, 0] + 1j * points[:, 1]
    if height < 1:
        # A quarter turn makes the other side the height.
        z = (1j * z + height) / height
        height = 1 / height
    if height > MAX_ASPECT:
        raise PrecisionError(f"The conformal map leaves double precision: its modulus is {height:.3g}")
    v = np.pi * np.append(z - 0.5, 0.5j * height)
    q = np.exp(-2 * np.pi * height)
    order = np.arange(4)
    sign = (-1.0) ** order
    odd = q ** (order * (order + 1)) * sign
    even = np.where(order == 0, 1, 2 * sign * q ** (order**2))
    numerator = sum(c * np.sin((2 * k + 1) * v) for k, c in enumerate(odd))
    denominator = sum(c * np.cos(2 * k * v) for k, c in enumerate(even))
    # Homogeneous coordinates: the middle of the upper side is mapped to infinity first.
    centre = numerator[-1] / denominator[-1]
    top, bottom = numerator[:-1], denominator[:-1]
    w = (top - centre * bottom) / (top - np.conj(centre) * bottom)
    return np.stack([w.real, w.imag], axis=1)


def centre_in_disk(points: np.ndarray, mass: np.ndarray, tolerance: float = 1e-10) -> np.ndarray:
    """Move points (n,2) of the unit disk by a Moebius map so that their mean with mass (n,) is 0.

    Repeating "send the mean to 0" converges to the conformal barycentre (Douady, Earle 1986).
    """
    z = points[:, 0] + 1j * points[:, 1]
    share = mass / mass.sum()
    for _ in range(MAX_ROUNDS):
        mean = share @ z
        if abs(mean) < tolerance:
            break
        z = (z - mean) / (1 - np.conj(mean) * z)
    return np.stack([z.real, z.imag], axis=1)


def centred_sites(
    sites: np.ndarray, mass: np.ndarray, triangles: np.ndarray, loop: np.ndarray, least: float
) -> np.ndarray:
    """Sites (n,2) of a mesh (m,3) in the disk, its loop (b,) on the circle, moved by a Moebius map so that what has
    most mass (n,) is in the middle, if neighbours stay farther apart than `least`.

    The transport then has less to move, and a magnified region meets the circle on all sides at once.
    """
    if np.linalg.norm(mass @ sites) < CENTRED * mass.sum():
        return sites
    centred = centre_in_disk(sites, mass)
    centred[loop] /= lengths(centred[loop])[:, None]
    return centred if halfedge_lengths(centred, triangles).min() >= least else sites
