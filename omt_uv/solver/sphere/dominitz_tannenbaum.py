"""The area-preserving maps of Dominitz and Tannenbaum (2010) on the sphere, a road of its own to the optimal one.

From a conformal map, Moser's flow makes areas right; then a gradient flow of the transport cost, without divergence so
that they stay right, takes out what was moved in vain. The cost is the mass times |x - y|^2 / 2 between the conformal
and the present place of every point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.spherical_geometry import signed_volumes, spherical_areas
from ..progress import Progress, Steps, part_of
from .moser_flow import moser_map
from .stream_functions import Level, Pairs, allowance, best_flow, level, pairs, transported, velocity

# Moser's map is made in so many parts, each a share of the way in the logarithm of the density: much milder than one.
STAGES = 8
# Bumps of the stream functions, coarse to fine; levels finer than the mesh are left out.
LEVELS = (16, 60, 240, 960)
POINTS_PER_BUMP = 40
# Steps on one level, and the share of the cost that another one has to take off.
STEPS, GAIN = 10, 2e-4
MOSER = 0.5


@dataclass(frozen=True)
class SphereFlow:
    """positions (n,3); moser (n,3) after the first part; costs: of the transport, after the first part and every step;
    drift: sum |change of a face's share of the sphere| during the second part; status; iterations: steps of it."""

    positions: np.ndarray
    moser: np.ndarray
    costs: tuple[float, ...]
    drift: float
    status: str
    iterations: int


def flow_map(conformal: np.ndarray, triangles: np.ndarray, mass: np.ndarray) -> Steps[SphereFlow]:
    """Carry a conformal map (n,3) to the sphere along to one that gives every triangle its mass (m,) of area.

    Raises
    ------
    PrecisionError : see `moser.moser_map`
    """
    mass = 4 * np.pi * mass / mass.sum()
    moser = yield from part_of(_areas(conformal, triangles, mass), 0.0, MOSER)
    weight = np.bincount(triangles.ravel(), np.repeat(mass / 3, 3), len(conformal))
    positions, costs = yield from part_of(descent(moser, conformal, triangles, weight), MOSER, 1 - MOSER)
    before, after = spherical_areas(moser, triangles), spherical_areas(positions, triangles)
    drift = float(np.abs(after - before).sum() / (4 * np.pi))
    return SphereFlow(positions, moser, tuple(costs), drift, "converged", len(costs) - 1)


def _areas(points: np.ndarray, triangles: np.ndarray, mass: np.ndarray) -> Steps[np.ndarray]:
    floor = 1e-9 * mass.mean()
    first = np.maximum(spherical_areas(points, triangles), floor)
    for k in range(1, STAGES + 1):
        share = k / STAGES
        aim = first ** (1 - share) * np.maximum(mass, floor) ** share
        points = (yield from part_of(moser_map(points, triangles, aim), (k - 1) / STAGES, 1 / STAGES)).positions
    return points


def descent(
    points: np.ndarray, origin: np.ndarray, triangles: np.ndarray, weight: np.ndarray
) -> Steps[tuple[np.ndarray, list[float]]]:
    """Positions (n,3) of least cost that flows of all levels lead to, and the costs on the way."""
    costs = [_cost(points, origin, weight)]
    levels = [n for n in LEVELS if n * POINTS_PER_BUMP <= len(points)] or LEVELS[:1]
    for number, count in enumerate(levels):
        at = level(count)
        for k in range(STEPS):
            yield Progress("Gradient flow", (number + k / STEPS) / len(levels))
            close = pairs(points, at)
            # The slope of the cost is -origin, as far as it is tangent.
            wish = origin - (origin * points).sum(axis=1, keepdims=True) * points
            coefficients = best_flow(points, weight, wish, at, close)
            moved = _stepped(points, origin, triangles, weight, at, close, coefficients)
            cost = _cost(moved, origin, weight)
            if cost > costs[-1] * (1 - 1e-12):
                break
            points, gain = moved, 1 - cost / costs[-1]
            costs.append(cost)
            if gain < GAIN:
                break
    return points, costs


def _stepped(points, origin, triangles, weight, at: Level, close: Pairs, coefficients) -> np.ndarray:
    """The points after the longest of some times that lowers the cost and folds no more faces."""
    fastest = np.linalg.norm(velocity(points, at, close, coefficients), axis=1).max()
    if fastest == 0:
        return points
    time = min(1.0, 0.9 * allowance(at) / fastest)
    folds = (signed_volumes(points, triangles) <= 0).sum()
    cost = _cost(points, origin, weight)
    for _ in range(6):
        moved = transported(points, at, close, coefficients * time)
        if _cost(moved, origin, weight) < cost and (signed_volumes(moved, triangles) <= 0).sum() <= folds:
            return moved
        time /= 2
    return points


def _cost(points: np.ndarray, origin: np.ndarray, weight: np.ndarray) -> float:
    return float(weight @ (1 - (points * origin).sum(axis=1)) / weight.sum())
