"""Rotate a sphere map to its axes or to markers, by least squares (Kabsch 1976).

Rotations are the only motions of the sphere that change neither angles nor areas.

North is +Z, the central meridian -Y, east +X, as in `projections.py`.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import face_areas, nearest_rotations, vertex_areas
from ..mesh.spherical_geometry import signed_volumes

NORTH = np.array([0.0, 0, 1])
# Markers closer than this, on the unit sphere, to each other or to the opposite point give no direction.
LEAST_DISTANCE = 1e-6


class MarkerError(ValueError):
    """Markers of pole and meridian that give no direction."""


def along_axes(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Rotation (3,3) that brings unit vectors (n,3) nearest to the directions of the surface's vertices (n,3).

    Least squares over the surface between the images and the positions seen from its centre of area (Kabsch 1976): what
    is high on the surface lies north, what is in front of it at the central meridian. A surface that looks inwards is
    seen from inside, where east is on the other side.
    """
    weight = vertex_areas(vertices, triangles)
    area = face_areas(vertices, triangles)
    centre = (area[:, None] * vertices[triangles].mean(axis=1)).sum(axis=0) / area.sum()
    directions = vertices - centre
    if signed_volumes(directions, triangles).sum() < 0:
        directions = directions * [-1, 1, 1]
    return nearest_rotation(points, directions, weight)


def nearest_rotation(points: np.ndarray, directions: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Rotation R (3,3) with the largest sum of weight (n,) * <R points, directions>, (n,3) both (Kabsch 1976)."""
    return nearest_rotations((directions * weight[:, None]).T @ points)


def by_markers(pole: np.ndarray, meridian: np.ndarray | None = None, side: np.ndarray | None = None) -> np.ndarray:
    """Rotation (3,3) that brings `pole` (3,) to the north, and then turns `meridian` (3,) to the central meridian.

    With `side` (3,) as well, a point on the eastern side, the turn is the best for both. Without either, the rotation
    is the shortest one that brings the pole to the north.

    Raises
    ------
    MarkerError : the meridian's marker, or the side's, is at a pole; or the side's is in the west
    """
    tilt = _shortest_rotation(_direction(pole), NORTH)
    if meridian is None:
        return tilt
    turn = _equator_angle(tilt @ _direction(meridian), "meridian")
    if side is not None:
        east = _equator_angle(tilt @ _direction(side), "side")
        if np.sin(np.angle(east / turn)) <= 0:
            raise MarkerError(
                "The marker of the eastern side lies west of the meridian. Pick one on the other side; "
                "a map of a surface is never mirrored."
            )
        turn = turn + east / 1j
    a = -np.angle(turn)
    return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]) @ tilt


def _equator_angle(point: np.ndarray, name: str) -> complex:
    """cos(latitude) * exp(i longitude), longitude 0 at the central meridian and growing to the east."""
    value = complex(-point[1], point[0])
    if abs(value) < LEAST_DISTANCE:
        raise MarkerError(f"The marker of the {name} lies at a pole of the map. Pick one that is farther from it.")
    return value


def _shortest_rotation(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Rotation (3,3) from one unit vector to another about the axis normal to both."""
    axis, cosine = np.cross(start, end), float(start @ end)
    if cosine < -1 + 1e-12:
        axis = _direction(np.cross(start, [1.0, 0, 0] if abs(start[0]) < 0.9 else [0, 1.0, 0]))
        return 2 * np.outer(axis, axis) - np.eye(3)
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + K + K @ K / (1 + cosine)


def _direction(x: np.ndarray) -> np.ndarray:
    """Unit vector (3,) of the mean x (3,) of a marker's vertices. Raises MarkerError where they have none."""
    length = np.linalg.norm(x)
    if not length > LEAST_DISTANCE:
        raise MarkerError("The vertices of a marker are all around the sphere and have no middle. Mark fewer of them.")
    return x / length
