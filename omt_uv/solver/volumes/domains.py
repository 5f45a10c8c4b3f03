"""Bodies that a volume is mapped to: which way their boundary lets a vertex slide, and how it is brought back there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..mesh.geometry import cross3

BALL = "ball"
CUBE = "cube"
DOMAINS = (BALL, CUBE)


@dataclass(frozen=True)
class BallDomain:
    """The unit ball: boundary vertices (b,) slide along the sphere."""

    boundary: np.ndarray
    sliding: ClassVar[int] = 2

    def start(self, sphere: np.ndarray) -> np.ndarray:
        """Boundary places (b,3) for unit vectors (b,3)."""
        return sphere

    def frames(self, points: np.ndarray) -> np.ndarray:
        """Axes (n,3,3), as columns, at points (n,3); at the boundary the last is the one along which nothing moves."""
        axes = np.tile(np.eye(3), (len(points), 1, 1))
        normal = points[self.boundary] / np.linalg.norm(points[self.boundary], axis=1)[:, None]
        side = cross3(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
        side /= np.linalg.norm(side, axis=1)[:, None]
        axes[self.boundary] = np.stack([side, cross3(normal, side), normal], axis=2)
        return axes

    def bending(self, slope: np.ndarray, points: np.ndarray) -> np.ndarray:
        """What the curvature of the boundary adds to the second derivative (b,), for a gradient (n,3) at points
        (n,3)."""
        inwards = -np.einsum("bi,bi->b", slope[self.boundary], points[self.boundary])
        return np.maximum(inwards, 0.0)

    def retract(self, points: np.ndarray) -> np.ndarray:
        """Points (n,3) with those of the boundary back on it."""
        result = points.copy()
        edge = points[self.boundary]
        result[self.boundary] = edge / np.linalg.norm(edge, axis=1)[:, None]
        return result


@dataclass(frozen=True)
class CubeDomain:
    """The cube from -1 to 1: a boundary vertex slides within the side that it starts on; `side` (b,) its axis."""

    boundary: np.ndarray
    side: np.ndarray
    sliding: ClassVar[int] = 2

    def start(self, sphere: np.ndarray) -> np.ndarray:
        """Boundary places (b,3) for unit vectors (b,3)."""
        return cube_points(sphere)

    def frames(self, points: np.ndarray) -> np.ndarray:
        """Axes (n,3,3), as columns; at the boundary the last is across its side."""
        axes = np.tile(np.eye(3), (len(points), 1, 1))
        order = np.array([[1, 2, 0], [2, 0, 1], [0, 1, 2]])[self.side]
        axes[self.boundary] = np.eye(3)[:, order].transpose(1, 0, 2)
        return axes

    def bending(self, slope: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Sides are flat: nothing (b,)."""
        return np.zeros(len(self.boundary))

    def retract(self, points: np.ndarray) -> np.ndarray:
        """Points (n,3) with those of the boundary on their sides, none of them beyond an edge."""
        result = points.copy()
        result[self.boundary] = np.clip(points[self.boundary], -1.0, 1.0)
        return result


@dataclass(frozen=True)
class HeldDomain:
    """A body whose boundary vertices (b,) stay where they are."""

    boundary: np.ndarray
    sliding: ClassVar[int] = 0

    def frames(self, points: np.ndarray) -> np.ndarray:
        """Axes (n,3,3) of space."""
        return np.tile(np.eye(3), (len(points), 1, 1))

    def bending(self, slope: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Nothing (b,)."""
        return np.zeros(len(self.boundary))

    def retract(self, points: np.ndarray) -> np.ndarray:
        """The points (n,3), of whose boundary nothing has moved."""
        return points


Domain = BallDomain | CubeDomain | HeldDomain


def on_cube(points: np.ndarray) -> np.ndarray:
    """Points (k,3) of the unit ball along their rays in the cube from -1 to 1: what the middle sees, it sees then."""
    return points * (np.linalg.norm(points, axis=1) / np.maximum(np.abs(points).max(axis=1), 1e-300))[:, None]


def cube_points(sphere: np.ndarray) -> np.ndarray:
    """Points (k,3) on the cube from -1 to 1 for unit vectors (k,3), even in angles: areas within 1.4 of equal."""
    axis = np.abs(sphere).argmax(axis=1)
    ray = sphere / np.abs(sphere).max(axis=1)[:, None]
    points = 4 / np.pi * np.arctan(ray)
    rows = np.arange(len(sphere))
    points[rows, axis] = np.sign(sphere[rows, axis])
    return points
