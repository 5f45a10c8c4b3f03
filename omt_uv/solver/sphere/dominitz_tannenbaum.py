"""Map a sphere to itself with prescribed areas, by Moser's flow and gradient flow (Dominitz, Tannenbaum 2010).

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
from .stream_functions import BumpBasis, BumpPairs, advect, best_flow, bump_basis, bump_pairs, longest_motion, velocity

# Flows that Moser's map is made of, each a share of the way in the logarithm of the density: much milder than one.
MOSER_STAGES = 8
# Bumps of the stream functions, coarse to fine; bases finer than the mesh are left out.
BUMP_COUNTS = (16, 60, 240, 960)
# Points that a bump has to move for its basis to be used.
POINTS_PER_BUMP = 40
# Steps with one basis.
STEPS = 10
# Share of the cost that a step has to take off for another one to follow.
GAIN = 2e-4
# Halvings of a step that does not lower the cost.
HALVINGS = 6
# Share of the longest motion that the fastest point takes.
MOTION = 0.9
# Least mass of a face for Moser's flow, relative to the mean.
LEAST_MASS = 1e-9
# Rounding error of the cost, relative to it.
ROUNDING = 1e-12
# Share of the time that Moser's flow takes, roughly.
MOSER_TIME = 0.5


@dataclass(frozen=True)
class SphereFlow:
    """A map of the sphere: positions (n,3), unit vectors; moser (n,3): those after Moser's flow.

    costs: of the transport, after Moser's flow and every step of the gradient flow; drift: sum |change of a face's
    share of the sphere| during the latter; status; iterations: its steps.
    """

    positions: np.ndarray
    moser: np.ndarray
    costs: tuple[float, ...]
    drift: float
    status: str
    iterations: int


def flow_map(conformal: np.ndarray, triangles: np.ndarray, mass: np.ndarray) -> Steps[SphereFlow]:
    """Carry a conformal map (n,3) of triangles (m,3) to the sphere along to one where each has its mass (m,) of area.

    First Moser's flow, which makes areas right; then the gradient flow of sum mass |x - y|^2 / 2, projected to flows
    without divergence, which keeps them.

    Raises
    ------
    PrecisionError : see `moser_flow.moser_map`

    References
    ----------
    Dominitz, Tannenbaum 2010, section 3
    """
    mass = 4 * np.pi * mass / mass.sum()
    moser = yield from part_of(_moser_in_stages(conformal, triangles, mass), 0.0, MOSER_TIME)
    weight = np.bincount(triangles.ravel(), np.repeat(mass / 3, 3), len(conformal))
    positions, costs = yield from part_of(reduce_cost(moser, conformal, triangles, weight), MOSER_TIME, 1 - MOSER_TIME)
    before, after = spherical_areas(moser, triangles), spherical_areas(positions, triangles)
    drift = float(np.abs(after - before).sum() / (4 * np.pi))
    return SphereFlow(
        positions=positions,
        moser=moser,
        costs=tuple(costs),
        drift=drift,
        status="converged",
        iterations=len(costs) - 1,
    )


def _moser_in_stages(points: np.ndarray, triangles: np.ndarray, mass: np.ndarray) -> Steps[np.ndarray]:
    """Unit vectors (n,3) whose triangles (m,3) have their mass (m,), but for the errors of Moser's flow."""
    floor = LEAST_MASS * mass.mean()
    first = np.maximum(spherical_areas(points, triangles), floor)
    for k in range(1, MOSER_STAGES + 1):
        share = k / MOSER_STAGES
        goal = first ** (1 - share) * np.maximum(mass, floor) ** share
        stage = yield from part_of(moser_map(points, triangles, goal), (k - 1) / MOSER_STAGES, 1 / MOSER_STAGES)
        points = stage.positions
    return points


def reduce_cost(
    points: np.ndarray, origin: np.ndarray, triangles: np.ndarray, weight: np.ndarray
) -> Steps[tuple[np.ndarray, list[float]]]:
    """Positions (n,3) of least cost that flows of all bases lead to from unit vectors (n,3), and the costs on the way.

    origin (n,3): where the points come from; weight (n,): their masses.
    """
    costs = [transport_cost(points, origin, weight)]
    counts = [n for n in BUMP_COUNTS if n * POINTS_PER_BUMP <= len(points)] or BUMP_COUNTS[:1]
    for index, count in enumerate(counts):
        basis = bump_basis(count)
        for k in range(STEPS):
            yield Progress("Gradient flow", (index + k / STEPS) / len(counts))
            pairs = bump_pairs(points, basis)
            # The slope of the cost is -origin, as far as it is tangent.
            target = origin - (origin * points).sum(axis=1, keepdims=True) * points
            coefficients = best_flow(points, weight, target, basis, pairs)
            moved = _line_search(points, origin, triangles, weight, basis, pairs, coefficients)
            cost = transport_cost(moved, origin, weight)
            if cost > costs[-1] * (1 - ROUNDING):
                break
            points, gain = moved, 1 - cost / costs[-1]
            costs.append(cost)
            if gain < GAIN:
                break
    return points, costs


def _line_search(points, origin, triangles, weight, basis: BumpBasis, pairs: BumpPairs, coefficients) -> np.ndarray:
    """The points after the longest of some times that lowers the cost and folds no more faces."""
    fastest = np.linalg.norm(velocity(points, basis, pairs, coefficients), axis=1).max()
    if fastest == 0:
        return points
    time = min(1.0, MOTION * longest_motion(basis) / fastest)
    folds = (signed_volumes(points, triangles) <= 0).sum()
    cost = transport_cost(points, origin, weight)
    for _ in range(HALVINGS):
        moved = advect(points, basis, pairs, coefficients * time)
        if transport_cost(moved, origin, weight) < cost and (signed_volumes(moved, triangles) <= 0).sum() <= folds:
            return moved
        time /= 2
    return points


def transport_cost(points: np.ndarray, origin: np.ndarray, weight: np.ndarray) -> float:
    """Mean of |x - y|^2 / 2 over the weights (n,), of points and origins (n,3)."""
    return float(weight @ (1 - (points * origin).sum(axis=1)) / weight.sum())
