"""Find the axis of a surface of revolution: all of its normals meet it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import cross3, dot3

# A surface turns about an axis if its normals pass it by no more than this share of their distance from it, in the root
# mean square, and others by so many times as much, and more than the second share: a sphere has no axis of its own.
PASSES = 0.05
OTHERS = 4.0
PASSES_OTHERS = 0.03
# Of lengths that differ by less, over themselves, rounding chooses none.
EVEN = 1e-6


@dataclass(frozen=True)
class Axis:
    """A line through a point (3,), along a unit vector (3,)."""

    point: np.ndarray
    direction: np.ndarray

    def height(self, points: np.ndarray) -> np.ndarray:
        """How far points (n,3) are along the axis, (n,)."""
        return (points - self.point) @ self.direction

    def radius(self, points: np.ndarray) -> np.ndarray:
        """Distance of points (n,3) from the axis, (n,)."""
        return np.linalg.norm(cross3(points - self.point, np.broadcast_to(self.direction, points.shape)), axis=1)

    def plane(self, points: np.ndarray) -> np.ndarray:
        """Places (n,2) of points (n,3) in a plane across the axis, which is at 0."""
        across = np.linalg.svd(self.direction[None])[2][1:]
        return (points - self.point) @ across.T


def axis_of_revolution(positions: np.ndarray, triangles: np.ndarray, polygon: np.ndarray) -> Axis | None:
    """The axis that a surface (n,3), (m,3) turns about; None where there is none, or more than one, as for a sphere.

    polygon (m,) : that triangles belong to, from 0: a quad of a turned body looks at the axis, its halves do not.

    Source: Pottmann, Wallner 2001, Computational Line Geometry, section 4.1: the normals of a surface of revolution lie
    in a linear complex, whose axis is found by least squares.
    """
    corners = positions[triangles]
    normal = cross3(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area = np.sqrt(dot3(normal, normal))
    size = np.bincount(polygon, area)
    normal = np.stack([np.bincount(polygon, x) for x in normal.T], axis=1)
    middle = np.stack([np.bincount(polygon, area * x) for x in corners.mean(axis=1).T], axis=1)
    flat = size > 0
    normal, middle, size = normal[flat] / size[flat, None], middle[flat] / size[flat, None], size[flat]
    if not len(size):
        return None
    centre = size @ middle / size.sum()
    arm = middle - centre
    turn = cross3(arm, normal)
    # What a turn about a moves along the normals is turn . a + normal . m, for the best shift m.
    aa, am, mm = ((size[:, None] * one).T @ other for one, other in ((turn, turn), (turn, normal), (normal, normal)))
    shift = np.linalg.pinv(mm, rcond=1e-9, hermitian=True) @ am.T
    least, directions = np.linalg.eigh(aa - am @ shift)
    direction = directions[:, 0]
    # Either way is as good: the one that goes on along the axis of space that it is nearest to.
    near = np.abs(direction) >= (1 - EVEN) * np.abs(direction).max()
    direction = direction * np.sign(direction[near][0])
    move = -shift @ direction
    axis = Axis(centre + np.cross(direction, move), direction)
    passed = dot3(cross3(np.broadcast_to(direction, middle.shape), middle - axis.point), normal)
    away = size @ axis.radius(middle) ** 2
    off, others = np.sqrt(
        np.array([size @ passed**2, max(least[1], 0.0)]) / np.maximum([away, size @ dot3(arm, arm)], 1e-300)
    )
    return axis if off <= min(PASSES, others / OTHERS) and others >= PASSES_OTHERS else None


def has_axis(positions: np.ndarray, triangles: np.ndarray, polygons: np.ndarray) -> bool:
    """Whether triangles (m,3) of positions (n,3) turn about an axis, by the polygons (m,) that they belong to."""
    return axis_of_revolution(positions, triangles, np.unique(polygons, return_inverse=True)[1].ravel()) is not None
