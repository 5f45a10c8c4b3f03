"""Carry landmarks to their places within the sphere or the disk, and all else along, without a fold.

The domain flows in small steps. In each, a smooth field takes every landmark part of the way that is left: Gaussian
kernels at the landmarks, with coefficients from one linear system (as Hu, Zou, Hua 2014, section 5, whose field is
steady and contradicts itself where paths cross; a system a step does not). A smooth flow folds nothing; where the mesh
is too coarse for it, vertices stay behind. Then the mesh relaxes, with the landmarks held where they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..progress import Progress, Steps
from .carriers import InPlace
from .surface_newton import LOOSE, Deformation, minimise_on, without_folds

# Radians, or radii of the disk, that a landmark goes in a step at most, if it never has to stay behind.
STRIDE = 0.03
# Steps at least and at most.
FEWEST = 4
MOST = 80
# More steps for landmarks that had to stay behind, and the distance from which they are put into their places.
MORE = 40
NEAR = 1e-6
# Newton steps after each step of the flow, and at the end.
RELAXING_STEPS = 2
LAST_STEPS = 20
# Width of the kernels over the mean distance of a landmark from the nearest other, and the widest.
WIDTH = 1.0
WIDEST = 1.0
# Added to the diagonal of the kernels' matrix.
RIDGE = 1e-8


@dataclass(frozen=True)
class Drawn:
    """Where the vertices came to lie, which landmarks (k,) bool are in their places, and the Newton steps taken."""

    placed: InPlace
    met: np.ndarray
    steps: int


def draw_landmarks(problem: Deformation, placed: InPlace, vertices: np.ndarray, targets: InPlace) -> Steps[Drawn]:
    """Carry landmarks, vertices (k,), to their places on the carrier, (k,) of them.

    A landmark that cannot be met without a fold stays ahead of its place.
    """
    way = np.linalg.norm(targets.positions - placed.positions[vertices], axis=1).max(initial=0)
    count = int(np.clip(np.ceil(way / STRIDE), FEWEST, MOST))
    held = replace(problem, held=problem.held.copy())
    held.held[vertices] = True
    steps = 0
    for k in range(count + MORE):
        yield Progress("Landmarks", min(k / count, 1.0))
        move = targets.positions - placed.positions[vertices]
        left = float(np.linalg.norm(move, axis=1).max(initial=0))
        if left < NEAR:
            break
        # What had to stay behind has all of its way left in the end.
        field = _field(placed.positions, vertices, move / max(count - k, 1))
        field[problem.held] = 0
        moved = problem.carrier.move(placed, field)
        placed = without_folds(problem, placed, moved)
        placed, more = yield from minimise_on(held, placed, RELAXING_STEPS, LOOSE, "Landmarks")
        steps += more
    placed, met = put_landmarks(problem, placed, vertices, targets)
    placed, more = yield from minimise_on(held, placed, LAST_STEPS, LOOSE, "Landmarks")
    return Drawn(placed, met, steps + more)


def _field(positions: np.ndarray, vertices: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Vectors (n,3) at positions (n,3) that are `move` (k,3) at the vertices (k,): Gaussian kernels there."""
    at = positions[vertices]
    square = ((at[:, None] - at) ** 2).sum(axis=2)
    nearest = np.sqrt((square + np.diag(np.full(len(at), np.inf))).min(axis=1))
    spacing = float(np.mean(nearest[np.isfinite(nearest)])) if len(at) > 1 else WIDEST
    width = min(WIDTH * spacing, WIDEST)
    kernel = np.exp(-square / width**2) + RIDGE * np.eye(len(at))
    factor = np.linalg.solve(kernel, move)
    return np.exp(-((positions[:, None] - at) ** 2).sum(axis=2) / width**2) @ factor


def put_landmarks(
    problem: Deformation, placed: InPlace, vertices: np.ndarray, targets: InPlace
) -> tuple[InPlace, np.ndarray]:
    """The landmarks put into their places one by one, where that folds nothing, and which (k,) bool that are."""
    landmarks = vertices.tolist()
    met = np.zeros(len(landmarks), bool)
    triangles = problem.faces.triangles
    triangles = triangles[np.isin(triangles, vertices).any(axis=1)]
    for k, vertex in enumerate(landmarks):
        around = triangles[(triangles == vertex).any(axis=1)]
        trial = InPlace(*(part.copy() for part in vars(placed).values()))
        for part, place in zip(vars(trial).values(), vars(targets).values(), strict=True):
            part[vertex] = place[k]
        if not problem.carrier.folded(trial, around).any():
            placed, met[k] = trial, True
    return placed, met
