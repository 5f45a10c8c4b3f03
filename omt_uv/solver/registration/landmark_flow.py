"""Carry landmarks to their places within the sphere or the disk, and all else along, without a fold.

The domain flows in small steps. In each, a smooth field takes every landmark part of the way that is left: Gaussian
kernels at the landmarks, with coefficients from one linear system (as Hu, Zou, Hua 2014, section 5, whose field is
steady and contradicts itself where paths cross; a system a step does not). A smooth flow folds nothing; where the mesh
is too coarse for it, vertices stay behind. Then the mesh relaxes, with the landmarks held where they are.

Many points whose places are known roughly are followed by a flow that is smoother than they are: wide kernels first,
and a ridge, so that a point which is wrong, or which the others contradict, bends little.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.spherical_geometry import normalized
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
# Widths of the kernels that follow many points, one after the other, and what is added to their diagonal, as a share of
# how many points they reach.
FOLLOWING = (0.6, 0.4)
SMOOTHNESS = 0.3
# How much nearer or farther two points get, relative to their distance, in a step, and in all steps that are left to do
# where a width has done what it can; steps of a width at most.
BEND = 0.3
STILL = 0.02
MOST_FOLLOWING = 40
# Vertices that are moved at once, times points.
CHUNK = 1 << 21


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


def follow_points(domain: np.ndarray, points: np.ndarray, places: np.ndarray) -> Steps[np.ndarray]:
    """Unit vectors (n,3) carried by a smooth flow that takes the points (k,) of them near to places (k,3).

    Where triangles are large next to what the flow bends, they may fold.
    """
    for width in FOLLOWING:
        for k in range(MOST_FOLLOWING):
            yield Progress("Functional maps", k / MOST_FOLLOWING)
            at = domain[points]
            kernel = _kernel(at, at, width)
            ridge = SMOOTHNESS * np.median(kernel.sum(axis=1))
            factor = np.linalg.solve(kernel + ridge * np.eye(len(at)), _geodesics(at, places))
            bend = _bend(at, kernel @ factor, width)
            if bend < STILL:
                break
            share = min(1.0, BEND / bend)
            parts = np.array_split(domain, -(-len(domain) * len(at) // CHUNK))
            domain = np.concatenate([_moved(part, share * (_kernel(part, at, width) @ factor)) for part in parts])
    return domain


def _kernel(at: np.ndarray, points: np.ndarray, width: float) -> np.ndarray:
    """Gaussian kernels (n,k) of unit vectors (k,3), at unit vectors (n,3)."""
    return np.exp(-np.maximum(2 - 2 * at @ points.T, 0) / width**2)


def _geodesics(at: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Tangents (k,3) at unit vectors (k,3) that lead to others (k,3), as long as the way is."""
    cosine = np.einsum("kd,kd->k", at, places)
    along = places - cosine[:, None] * at
    sine = np.linalg.norm(along, axis=1)
    return along * (np.arctan2(sine, cosine) / np.maximum(sine, 1e-12))[:, None]


def _bend(at: np.ndarray, field: np.ndarray, width: float) -> float:
    """The greatest difference of a field (k,3) at two of the points (k,3), over their distance, or half of the width
    where they are nearer."""
    square = np.maximum(2 - 2 * at @ at.T, (width / 2) ** 2)
    size = (field**2).sum(axis=1)
    return float(np.sqrt(np.maximum((size[:, None] + size - 2 * field @ field.T) / square, 0).max()))


def _moved(at: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) moved along a field (n,3), as far as it is tangent."""
    return normalized(at + field - np.einsum("nd,nd->n", at, field)[:, None] * at)
