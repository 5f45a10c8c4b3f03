"""Move vertices of a sphere map onto given points, without a change of area, by flows of local stream functions.

A face with a pole inside it has no image in a cylindrical projection, and one with a fourfold point of the octahedral
layout inside it cannot be laid out flat. Where these points are vertices there is no such face.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ..mesh.geometry import cross3
from ..mesh.spherical_geometry import normalized, signed_volumes, spherical_areas
from ..mesh.topology import vertices_around
from ..progress import drain
from ..sphere.stream_functions import runge_kutta_slopes
from ..sphere.untangle import RINGS, straighten_around
from .projections import is_cylindrical

POLES = np.array([[0.0, 0, 1], [0, 0, -1]])
# Where the octahedral layout has only half a turn of angle: midpoints of the sides of its square.
CONES = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
# How many times as far as it moves the vertex a push reaches: far, which keeps the shear around it low, or not so far,
# and where that folds a coarse mesh, no farther than the vertex itself.
REACHES = (12.0, 6.0, 3.0, 0.0)
# How many of the vertices nearest to a point may be the one that is pushed onto it.
MOST_CANDIDATES = 6
# Of Runge and Kutta, in a push.
PUSH_STEPS = 16
# Sine of a distance of which there is no direction.
SAME_POINT = 1e-12
# Distance within which a push is a rotation, in units of what it moves the vertex by.
RIGID = 1.02


def singular_points(projection: str) -> np.ndarray:
    """Points (k,3) of the sphere that have to be vertices for a projection to lay out every face."""
    return POLES if is_cylindrical(projection) else CONES


def move_vertices_onto(points: np.ndarray, triangles: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Push the vertex of points (n,3) nearest to each target (k,3) onto it: points, and vertices (k,), -1 for none.

    Other vertices move only nearby and, but for what a mesh does not resolve, without a change of area. A push that
    would fold a face of triangles (m,3) is not done; then the next nearest vertices are tried. Where all would, as
    among the slivers of a limb, the first one that can be is put there, and the faces around it are straightened.
    """
    limit = 0.5 * _separation(targets)
    found = np.full(len(targets), -1)
    for k, target in enumerate(targets):
        sound = signed_volumes(points, triangles) > 0
        nearest = np.argsort(-(points @ target))[:MOST_CANDIDATES]
        for vertex, reach in product(nearest[~np.isin(nearest, found)], REACHES):
            pushed = push(points, points[vertex], target, reach, limit)
            pushed[vertex] = target
            if (signed_volumes(pushed, triangles)[sound] > 0).all():
                points, found[k] = pushed, vertex
                break
        else:
            corners = _corners_around(points, triangles, target)
            candidates = np.concatenate([corners, nearest[~np.isin(nearest, corners)]])
            points, found[k] = _put_and_straighten(
                points, triangles, target, candidates[~np.isin(candidates, found)], found
            )
    return points, found


def _corners_around(points: np.ndarray, triangles: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Corners of the faces that hold the target, the one that would move least first."""
    p = points[triangles]
    inside = (cross3(p, np.roll(p, -1, axis=1)) @ target >= 0).all(axis=1)
    corners = np.unique(triangles[inside])
    return corners[np.argsort(-(points[corners] @ target), kind="stable")]


def _put_and_straighten(
    points: np.ndarray, triangles: np.ndarray, target: np.ndarray, candidates: np.ndarray, taken: np.ndarray
) -> tuple[np.ndarray, int]:
    """Put the first of the candidates (c,) onto the target around which faces can be straightened: points (n,3), and
    which vertex, -1 for none. Vertices taken (k,) stay."""
    area = np.maximum(spherical_areas(points, triangles), 0)
    before = signed_volumes(points, triangles) > 0
    for vertex in candidates.tolist():
        moved = points.copy()
        moved[vertex] = target
        wrong = before & ~(signed_volumes(moved, triangles) > 0)
        free = vertices_around(triangles, wrong | (triangles == vertex).any(axis=1), len(points), RINGS)
        free[[vertex, *taken[taken >= 0]]] = False
        found = drain(straighten_around(points, triangles, moved, area, free))
        if found is not None and (signed_volumes(found, triangles)[before] > 0).all():
            return found, vertex
    return points, -1


def _separation(targets: np.ndarray) -> float:
    """Least distance in radians between two of unit vectors (k,3)."""
    cosine = targets @ targets.T - 2 * np.eye(len(targets))
    return float(np.arccos(np.clip(cosine.max(), -1, 1)))


def push(points: np.ndarray, start: np.ndarray, end: np.ndarray, reach: float, limit: float) -> np.ndarray:
    """Push unit vectors (n,3) so that `start` (3,) comes to `end` (3,), unless that is farther than `limit` radians.

    Nothing farther from `end` than `reach` times the distance of the two, or than `limit`, moves.

    The flow of the stream function <axis, x> f(r), with r the distance from `end` and f a smooth step from 1 to 0: near
    `end` a rotation about the axis, everywhere free of divergence.
    """
    axis = cross3(start, end)
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, start @ end)
    inner, outer = RIGID * angle, min(reach * angle, limit)
    if sine < SAME_POINT or inner >= outer:
        return points.copy()
    axis /= sine
    result = points.copy()
    near = np.flatnonzero(points @ end > np.cos(outer))
    x, step = points[near], angle / PUSH_STEPS

    def velocity(x: np.ndarray) -> np.ndarray:
        cosine = np.clip(x @ end, -1, 1)
        swirl = cross3(end, x)
        r = np.arctan2(np.linalg.norm(swirl, axis=1), cosine)
        f, slope = _smooth_step(r, inner, outer)
        bend = (x @ axis) * slope / np.maximum(np.sin(r), 1e-12)
        return cross3(axis, x) * f[:, None] - swirl * bend[:, None]

    for _ in range(PUSH_STEPS):
        x = normalized(x + step / 6 * runge_kutta_slopes(velocity, x, step))
    result[near] = x
    return result


def _smooth_step(r: np.ndarray, inner: float, outer: float) -> tuple[np.ndarray, np.ndarray]:
    """A function (n,) that falls from 1 at `inner` to 0 at `outer` with two continuous derivatives, and its slope."""
    s = np.clip((r - inner) / (outer - inner), 0, 1)
    return 1 - s**3 * (10 - 15 * s + 6 * s**2), -30 * (s * (1 - s)) ** 2 / (outer - inner)
