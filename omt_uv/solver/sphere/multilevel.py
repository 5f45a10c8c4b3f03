"""A map to the sphere without folds for any closed mesh of genus 0, from coarse to fine (Praun, Hoppe 2003).

The mesh is coarsened to a tetrahedron; that is spread over the sphere, and the vertices come back in reverse order. A
vertex that moved into its neighbour j comes back where all sides of its hole are seen from: that is so at j itself, and
therefore on the bisector of the hole's corner at j, close to j. Between levels all vertices relax. Areas are about
right on every level, so limbs of any length keep their place, where a conformal map would leave double precision.
"""

from __future__ import annotations

import numpy as np

from ..errors import PrecisionError
from ..mesh.spherical_geometry import normalized, signed_volumes, triple_products
from ..progress import Progress, Steps
from .coarsen import Level, Round, coarsened
from .newton import seen
from .refine import relax

# Distances from the neighbour, in widths of the hole, at which a vertex that comes back tries to settle.
TRIES = 2.0 ** -np.concatenate([np.arange(0, 5, 0.5), np.arange(5, 24, 2)])
# Up to so many vertices the way is tried again, up to so many times, while a face has a corner farther from its middle
# than the angle with this cosine; every other time meshes of up to REGULAR vertices are taken for regular ones.
FEW, ATTEMPTS, IN_SIGHT, REGULAR = 1200, 8, 0.3, 100


def multilevel_start(vertices: np.ndarray, triangles: np.ndarray, target: np.ndarray) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) of a closed surface (n,3), (m,3), all faces positive, areas roughly the target (m,).

    Also the Newton steps taken. Raises PrecisionError where a vertex finds no place in double precision.
    """
    levels = coarsened(vertices, triangles, target)
    few = next(k for k, level in enumerate(levels) if len(level.vertices) <= FEW or k == len(levels) - 1)
    positions, steps = yield from _few(levels[few:])
    for k, level in enumerate(reversed(levels[:few])):
        yield Progress("Coarse to fine", (k + 1) / (few + 1))
        positions, more = yield from _finer(level, positions)
        steps += more
    return positions, steps


def _few(levels: list[Level]) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) of the finest of a few levels, and the steps taken, over all attempts.

    Where a large face of a coarse level comes to reach around the sphere, it never lets go, and all its descendants are
    slivers of half a turn. Which does is chance, so another way down is tried.
    """
    top, steps, widest = levels[0], 0, -np.inf
    best, failure = None, None
    for attempt in range(ATTEMPTS):
        if attempt > 0:
            levels = coarsened(top.vertices, top.triangles, top.mass, attempt)
        try:
            positions, more = yield from _raised(levels, REGULAR if attempt % 2 else 0)
        except PrecisionError as error:
            failure = error
            continue
        steps += more
        sight = float(seen(positions, top.triangles).least.min())
        if sight > widest:
            best, widest = positions, sight
        if sight >= IN_SIGHT:
            break
    if best is None:
        raise failure or PrecisionError("Faces are too small for double precision on the sphere")
    return best, steps


def _raised(levels: list[Level], regular: int) -> Steps[tuple[np.ndarray, int]]:
    """From the tetrahedron to the finest of the levels, those of up to `regular` vertices taken for regular meshes."""
    positions, steps = _tetrahedron(levels[-1]), 0
    for level in reversed(levels[:-1]):
        positions, more = yield from _finer(level, positions, len(level.vertices) <= regular)
        steps += more
    return positions, steps


def _tetrahedron(level: Level) -> np.ndarray:
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    return corners * (1 if signed_volumes(corners, level.triangles).min() > 0 else -1)


def _finer(level: Level, positions: np.ndarray, regular: bool = False) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) of a level, relaxed, from those of the coarser one, and the steps taken."""
    return (yield from relax(level.vertices, level.triangles, _refilled(level, positions), level.mass, regular))


def _refilled(level: Level, coarse: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) of a level, from those (k,3) of its coarsened mesh."""
    positions = np.zeros((len(level.vertices), 3))
    positions[level.kept] = coarse
    for step in reversed(level.rounds):
        positions[step.removed] = _places(step, positions)
    if not signed_volumes(positions, level.triangles).min() > 0:
        raise PrecisionError("Faces are too small for double precision on the sphere")
    return positions


def _places(step: Round, positions: np.ndarray) -> np.ndarray:
    """Places (r,3) for the vertices that come back: the best of the tries for the smallest of the faces around."""
    r = len(step.removed)
    home = positions[step.parent]
    a, b = positions[step.star[:, 1]], positions[step.star[:, 2]]
    at_home = step.parent[step.owner]
    normal = normalized(np.cross(a, b - a))
    beside = (step.star[:, 1] == at_home) | (step.star[:, 2] == at_home)
    bisector = np.zeros((r, 3))
    np.add.at(bisector, step.owner[beside], normal[beside])
    middle, width = np.zeros((r, 3)), np.zeros(r)
    np.add.at(middle, step.owner, a)
    np.maximum.at(width, step.owner, np.linalg.norm(a - home[step.owner], axis=1))
    best, found = np.full(r, -np.inf), home.copy()
    for direction in (_tangent(middle, home), _tangent(bisector, home)):
        for share in TRIES:
            place = normalized(home + (share * width)[:, None] * direction)
            score = np.full(r, np.inf)
            np.minimum.at(score, step.owner, triple_products(place[step.owner], a, b) / step.mass)
            better = score > best
            best[better], found[better] = score[better], place[better]
    return found


def _tangent(vectors: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Unit tangents (r,3) at unit vectors (r,3) nearest to given vectors."""
    return normalized(vectors - np.einsum("rd,rd->r", vectors, at)[:, None] * at)
