"""Project the unit sphere to the unit square and back: equirectangular, Lambert cylindrical, octahedral equal-area.

North is +Z, the central meridian -Y, which is the front in Blender, and east +X, so that a map seen from outside is not
mirrored. Equal-area means a constant Jacobian: the square's unit of area for the sphere's 4 pi.
"""

from __future__ import annotations

import numpy as np

# Longitude and latitude, both evenly spaced.
EQUIRECT = "equirect"
# Longitude and height: equal-area (Lambert 1772).
LAMBERT = "lambert"
# Octants to triangles: equal-area (Clarberg 2008).
OCTAHEDRAL = "octahedral"
PROJECTIONS = (EQUIRECT, LAMBERT, OCTAHEDRAL)
# Of pictures alone: longitude times cos(latitude), so that a flat picture is nowhere pinched (Dominitz, Tannenbaum
# 2010, section 5; Snyder 1987).
SINUSOIDAL = "sinusoidal"
PICTURES = (*PROJECTIONS, SINUSOIDAL)


def check_projection(projection: str) -> None:
    """Raise ValueError unless `projection` is one of PROJECTIONS."""
    _check(projection, PROJECTIONS)


def _check(projection: str, allowed: tuple[str, ...]) -> None:
    if projection not in allowed:
        raise ValueError(f"projection must be one of {', '.join(allowed)}, not {projection!r}")


def is_cylindrical(projection: str) -> bool:
    """Whether u is the longitude, so that the square's left and right side are one meridian."""
    return projection in (EQUIRECT, LAMBERT, SINUSOIDAL)


def to_plane(points: np.ndarray, projection: str) -> np.ndarray:
    """UV (..., 2) in the unit square of unit vectors (..., 3), in the layout of a picture, too: see PICTURES."""
    _check(projection, PICTURES)
    if projection == OCTAHEDRAL:
        return 0.5 * (octahedral_to_plane(points) + 1)
    # Of columns with strides numpy has another last digit whenever what it finds comes to lie right behind them.
    x, y, z = np.ascontiguousarray(np.moveaxis(points, -1, 0))
    u = 0.5 + np.arctan2(x, -y) / (2 * np.pi)
    if projection == SINUSOIDAL:
        u = 0.5 + (u - 0.5) * np.hypot(x, y) / np.sqrt(x * x + y * y + z * z)
    v = 0.5 * (1 + z) if projection == LAMBERT else 0.5 + np.arctan2(z, np.hypot(x, y)) / np.pi
    return np.stack([u, np.clip(v, 0, 1)], axis=-1)


def to_sphere(uv: np.ndarray, projection: str) -> np.ndarray:
    """Unit vectors (..., 3) of UV (..., 2).

    Outside the square the layout continues as it does across its sides: for cylinders u is periodic; for the
    octahedron a side is glued to itself about its midpoint.
    """
    check_projection(projection)
    if projection == OCTAHEDRAL:
        return octahedral_to_sphere(2 * uv - 1)
    longitude = 2 * np.pi * (uv[..., 0] - 0.5)
    v = np.clip(uv[..., 1], 0, 1)
    if projection == LAMBERT:
        z, r = 2 * v - 1, 2 * np.sqrt(v * (1 - v))
    else:
        z, r = np.sin(np.pi * (v - 0.5)), np.cos(np.pi * (v - 0.5))
    return np.stack([r * np.sin(longitude), -r * np.cos(longitude), z], axis=-1)


def octahedral_to_plane(points: np.ndarray) -> np.ndarray:
    """The equal-area octahedral map (Clarberg 2008) of unit vectors (..., 3) to [-1, 1]^2, (..., 2).

    The northern hemisphere is the square on the midpoints of the sides; the southern one is folded out over its sides,
    so that the south pole is all four corners.
    """
    x, y, z = np.moveaxis(points, -1, 0)
    # sqrt(1 - |z|) without cancellation at the poles.
    r = np.hypot(x, y) / np.sqrt(1 + np.abs(z))
    b = r * np.arctan2(np.abs(y), np.abs(x)) * (2 / np.pi)
    a = r - b
    south = z < 0
    a, b = np.where(south, 1 - b, a), np.where(south, 1 - a, b)
    return np.stack([np.where(x < 0, -a, a), np.where(y < 0, -b, b)], axis=-1)


def octahedral_to_sphere(square: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3) of points (..., 2) of [-1, 1]^2; points outside are first brought in, `wrap_octahedral`."""
    square = wrap_octahedral(square)
    a, b = np.abs(square[..., 0]), np.abs(square[..., 1])
    depth = 1 - (a + b)
    r = 1 - np.abs(depth)
    angle = np.pi / 4 * (1 + np.divide(b - a, r, out=np.zeros_like(r), where=r > 0))
    s = r * np.sqrt(2 - r**2)
    x = np.where(square[..., 0] < 0, -1, 1) * s * np.cos(angle)
    y = np.where(square[..., 1] < 0, -1, 1) * s * np.sin(angle)
    return np.stack([x, y, np.where(depth < 0, -1, 1) * (1 - r**2)], axis=-1)


def wrap_octahedral(square: np.ndarray) -> np.ndarray:
    """The point of [-1, 1]^2 that a point (..., 2) of the plane stands for.

    The plane is tiled by copies, every one turned by pi about the midpoint of the side it shares with its neighbour.
    """
    tile = np.floor((square + 1) / 2)
    turned = (tile.sum(axis=-1) % 2 == 1)[..., None]
    local = square - 2 * tile
    return np.where(turned, -local, local)
