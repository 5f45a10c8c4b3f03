"""Walls that a flow cannot cross: a ball, or a closed mesh (Hu, Zou, Hua 2014, section 5: the condition s.n = 0)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..counts import BYTES_PER_ELEMENT, check_memory
from ..errors import HandleError, NonFiniteError
from ..mesh.closest_point import spread_points
from ..mesh.geometry import cross3
from ..mesh.spherical_geometry import fibonacci_sphere
from .handles import farthest_points

# Samples of a wall.
SAMPLES = 400


@dataclass(frozen=True)
class FlowDomain:
    """Samples of a wall: points (w,d) and outward normals (w,d); middle (d,) and reach of the domain.

    ball : whether it is a ball, in which points are held exactly
    """

    points: np.ndarray
    normals: np.ndarray
    middle: np.ndarray
    reach: float
    ball: bool = False

    def held(self, points: np.ndarray) -> np.ndarray:
        """The points (k,d), those beyond the wall of a ball on it; a wall of another shape holds by its samples
        alone."""
        if not self.ball:
            return points
        offset = points - self.middle
        distance = np.linalg.norm(offset, axis=1)
        outside = distance > self.reach
        held = points.copy()
        held[outside] = self.middle + offset[outside] * (self.reach / distance[outside])[:, None]
        return held


def ball_domain(middle: np.ndarray, reach: float, samples: int = SAMPLES) -> FlowDomain:
    """A ball, or a disk in the plane, about `middle` (d,) with radius `reach`; samples lie on a Fibonacci lattice.

    Raises
    ------
    NonFiniteError : the middle or the radius is no finite number
    CountError : more samples than this machine has memory for
    """
    check_memory(samples, BYTES_PER_ELEMENT, "A wall of {} samples")
    middle = np.asarray(middle, float)
    if not (np.isfinite(middle).all() and np.isfinite(reach) and reach > 0):
        raise NonFiniteError("The ball has no finite middle and radius", "Give finite numbers, the radius above 0")
    if len(middle) == 2:
        angle = 2 * np.pi * np.arange(samples) / samples
        normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    else:
        normals = fibonacci_sphere(samples)
    return FlowDomain(middle + reach * normals, normals, middle, float(reach), ball=True)


def mesh_domain(vertices: np.ndarray, triangles: np.ndarray, samples: int = SAMPLES) -> FlowDomain:
    """The inside of a closed mesh (n,3), (m,3), faces looking outwards; samples are spread evenly over its faces.

    Raises
    ------
    HandleError : the mesh has no faces with area
    CountError : more samples than this machine has memory for
    """
    check_memory(samples, BYTES_PER_ELEMENT, "A wall of {} samples")
    corner = vertices[triangles]
    normal = cross3(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    if not area.sum() > 0:
        raise HandleError("The mesh that shall hold the flow has no faces", "Choose a closed mesh")
    sound = np.flatnonzero(area > 0)
    spacing = float(np.sqrt(area.sum() / 2 / samples))
    owner, points = spread_points(vertices, triangles[sound], spacing / 3)
    rows = farthest_points(points, 0.0, samples)
    face = sound[owner[rows]]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return FlowDomain(
        points[rows], normal[face] / area[face][:, None], (low + high) / 2, float(np.linalg.norm(high - low) / 2)
    )
