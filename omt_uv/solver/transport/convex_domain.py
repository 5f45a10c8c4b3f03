"""Clip cells by a convex domain exactly, the disk by its arcs, polygons by their sides, with Green's theorem.

A domain has its centroid at 0. Area, first and second moment of a cell are integrals along its boundary: straight
segments (`segment_integrals`) and stretches of the domain's own boundary, given by antiderivatives along the boundary
parameter s (`boundary_integrals`). The four integrals are, as rows,

    2 area = int x dy - y dx,  int x = int x^2/2 dy,  int y = -int y^2/2 dx,  int x^2+y^2 = int (x^3 dy - y^3 dx)/3
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..mesh.geometry import cross2, dot2, lengths


def segment_integrals(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The four integrals along straight segments from p (k,2) to q (k,2), (4,k)."""
    (px, py), (qx, qy) = p.T, q.T
    dx, dy = qx - px, qy - py
    return np.stack(
        [
            px * qy - py * qx,
            dy * (px * px + px * qx + qx * qx) / 6,
            -dx * (py * py + py * qy + qy * qy) / 6,
            (dy * (px + qx) * (px * px + qx * qx) - dx * (py + qy) * (py * py + qy * qy)) / 12,
        ]
    )


class Domain(Protocol):
    """What the power diagram needs to know of a convex domain."""

    area: float
    period: float  # of the boundary parameter

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points (k,2) lie inside, (k,) bool."""

    def clip(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters t (k,), (k,) where the lines origin + t direction enter and leave; enter > leave if they miss."""

    def boundary_parameter(self, points: np.ndarray) -> np.ndarray:
        """Parameter s (k,) of points (k,2) on the boundary, counter-clockwise in [0, period)."""

    def boundary_point(self, s: np.ndarray) -> np.ndarray:
        """Points (k,2) of the boundary at the parameters s (k,)."""

    def boundary_integrals(self, s: np.ndarray) -> np.ndarray:
        """The four integrals along the boundary from parameter 0 to s, (4,k)."""

    def total_integrals(self) -> np.ndarray:
        """The four integrals once around, (4,)."""

    def map_boundary(self, share: np.ndarray) -> np.ndarray:
        """Boundary points (k,2) at shares (k,) in [0, 1) of the boundary's length."""


class Disk:
    """The disk of the given radius about 0; the boundary parameter is the angle."""

    def __init__(self, radius: float = 1.0):
        self.radius = radius
        self.area = np.pi * radius**2
        self.period = 2 * np.pi

    def contains(self, points):
        """Which points (k,2) lie inside or on the circle, (k,) bool."""
        return dot2(points, points) <= self.radius**2

    def clip(self, origin, direction):
        """Parameters t (k,), (k,) where lines from origin (k,2) along unit directions (k,2) enter and leave.

        Where a line misses the disk or only touches it, enter > leave.
        """
        middle = -dot2(origin, direction)
        offset = cross2(origin, direction)
        half = np.sqrt(np.maximum(self.radius**2 - offset**2, 0))
        return middle - half, np.where(np.abs(offset) < self.radius, middle + half, middle - half - 1)

    def boundary_parameter(self, points):
        """Angle s (k,) of points (k,2), in radians from the first axis, modulo 2 pi."""
        return np.arctan2(points[:, 1], points[:, 0]) % (2 * np.pi)

    def boundary_point(self, s):
        """Points (k,2) of the circle at the angles s (k,)."""
        return self.radius * np.stack([np.cos(s), np.sin(s)], axis=1)

    def boundary_integrals(self, s):
        """The four integrals along the circle from angle 0 to s (k,), (4,k)."""
        r, cos, sin = self.radius, np.cos(s), np.sin(s)
        return np.stack(
            [
                r**2 * s,
                r**3 * (sin - sin**3 / 3) / 2,
                r**3 * (2 / 3 - cos + cos**3 / 3) / 2,
                r**4 * (3 * s / 4 + np.sin(4 * s) / 16) / 3,
            ]
        )

    def total_integrals(self):
        """The four integrals once around the circle, (4,)."""
        return np.array([2 * self.area, 0.0, 0.0, np.pi * self.radius**4 / 2])

    def map_boundary(self, share):
        """Points (k,2) of the circle at shares (k,) in [0, 1) of its length."""
        return self.boundary_point(2 * np.pi * share)


class ConvexPolygon:
    """A convex polygon, corners (k,2) counter-clockwise; the boundary parameter is the length from corner 0."""

    def __init__(self, corners: np.ndarray):
        side = np.roll(corners, -1, axis=0) - corners
        twice = cross2(corners, np.roll(corners, -1, axis=0))
        middle = (corners + np.roll(corners, -1, axis=0)) / 3
        self.corners = corners - (twice[:, None] * middle).sum(axis=0) / twice.sum()
        self.area = float(twice.sum() / 2)
        self.length = lengths(side)
        self.tangent = side / self.length[:, None]
        self.normal = np.stack([self.tangent[:, 1], -self.tangent[:, 0]], axis=1)
        self.start = np.concatenate([[0.0], np.cumsum(self.length)])
        self.period = float(self.start[-1])
        pieces = segment_integrals(self.corners, np.roll(self.corners, -1, axis=0))
        self._cumulative = np.concatenate([np.zeros((4, 1)), np.cumsum(pieces, axis=1)], axis=1)
        self._reach = (self.normal * self.corners).sum(axis=1)

    def contains(self, points):
        """Which points (k,2) lie inside or on a side, (k,) bool."""
        return (points @ self.normal.T <= self._reach).all(axis=1)

    def clip(self, origin, direction):
        """Parameters t (k,), (k,) where lines from origin (k,2) along directions (k,2) enter and leave.

        Where a line misses the polygon, enter > leave. Directions may have any length but 0.
        """
        enter, leave = np.full(len(origin), -np.inf), np.full(len(origin), np.inf)
        for normal, reach in zip(self.normal, self._reach, strict=True):
            speed, room = direction @ normal, reach - origin @ normal
            with np.errstate(divide="ignore", invalid="ignore"):
                t = room / speed
            enter = np.where(speed < 0, np.maximum(enter, t), enter)
            leave = np.where(speed > 0, np.minimum(leave, t), leave)
            leave = np.where((speed == 0) & (room < 0), -np.inf, leave)
        return enter, leave

    def boundary_parameter(self, points):
        """Length s (k,) from corner 0, in [0, period), to the point of the boundary nearest to points (k,2)."""
        along = ((points[:, None] - self.corners) * self.tangent).sum(axis=2)
        along = np.clip(along, 0, self.length)
        foot = self.corners + along[..., None] * self.tangent
        side = ((points[:, None] - foot) ** 2).sum(axis=2).argmin(axis=1)
        s = self.start[side] + np.take_along_axis(along, side[:, None], axis=1)[:, 0]
        return np.where(s >= self.period, 0.0, s)

    def boundary_point(self, s):
        """Points (k,2) of the boundary at the lengths s (k,) from corner 0, modulo the period."""
        s = s % self.period
        side = np.clip(np.searchsorted(self.start, s, side="right") - 1, 0, len(self.corners) - 1)
        return self.corners[side] + (s - self.start[side])[:, None] * self.tangent[side]

    def boundary_integrals(self, s):
        """The four integrals along the sides from corner 0 to s (k,) in [0, period], (4,k)."""
        side = np.clip(np.searchsorted(self.start, s, side="right") - 1, 0, len(self.corners) - 1)
        point = self.corners[side] + (s - self.start[side])[:, None] * self.tangent[side]
        return self._cumulative[:, side] + segment_integrals(self.corners[side], point)

    def total_integrals(self):
        """The four integrals once around the polygon, (4,)."""
        return self._cumulative[:, -1]

    def map_boundary(self, share):
        """Points (k,2) of the boundary at shares (k,) in [0, 1) of its length, from corner 0."""
        return self.boundary_point(share * self.period)


class Rectangle(ConvexPolygon):
    """The rectangle of the given width and height about 0, corner 0 at the lower left."""

    def __init__(self, width: float = 1.0, height: float = 1.0):
        x, y = width / 2, height / 2
        super().__init__(np.array([[-x, -y], [x, -y], [x, y], [-x, y]]))
        self.width, self.height = width, height
