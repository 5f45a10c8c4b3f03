"""Map any closed mesh of genus 0 to the sphere without folds, from coarse to fine (Praun, Hoppe 2003).

The mesh is coarsened to a tetrahedron; that is spread over the sphere, and the vertices come back in reverse order. A
vertex that moved into its neighbour j comes back where all sides of its hole are seen from: that is so at j itself, and
therefore on the bisector of the hole's corner at j, close to j. Between levels all vertices relax. Areas are about
right on every level, so limbs of any length keep their place, where a conformal map would leave double precision.
"""

from __future__ import annotations

import numpy as np

from ..errors import PrecisionError
from ..mesh.geometry import cross3, lengths
from ..mesh.spherical_geometry import normalized, signed_volumes, triple_products
from ..progress import Progress, Steps
from .coarsen import CollapseRound, SphereLevel, collapse_to_tetrahedron
from .newton import project_faces
from .refine import relax

# Distances from the neighbour, as shares of the width of the hole, at which a vertex that comes back tries to settle.
TRIED_DISTANCES = 2.0 ** -np.concatenate([np.arange(0, 5, 0.5), np.arange(5, 24, 2)])
# Vertices of a level up to which the way there is tried again.
MOST_RETRIED = 1200
# Ways that are tried.
MOST_ATTEMPTS = 8
# Cosine of the distance from the middle of a face to its farthest corner below which another way is tried.
LEAST_COSINE = 0.3
# Vertices of a level up to which every other attempt takes its faces for equilateral ones.
REGULAR = 100


def multilevel_start(vertices: np.ndarray, triangles: np.ndarray, target: np.ndarray) -> Steps[tuple[np.ndarray, int]]:
    """Map a closed surface (n,3), (m,3) to unit vectors (n,3), all faces positive, areas roughly the target (m,).

    Also the Newton steps taken.

    Raises
    ------
    PrecisionError : a vertex finds no place in double precision
    """
    levels = collapse_to_tetrahedron(vertices, triangles, target)
    few = next(k for k, level in enumerate(levels) if len(level.vertices) <= MOST_RETRIED or k == len(levels) - 1)
    positions, steps = yield from _best_of_attempts(levels[few:])
    for k, level in enumerate(reversed(levels[:few])):
        yield Progress("Coarse to fine", (k + 1) / (few + 1))
        positions, more = yield from _prolonged(level, positions)
        steps += more
    return positions, steps


def _best_of_attempts(levels: list[SphereLevel]) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) of the finest of some small levels, and the steps taken, over all attempts.

    Where a large face of a coarse level comes to reach around the sphere, it never lets go, and all its descendants are
    slivers of half a turn. Which does is chance, so another way down is tried.
    """
    top, steps, widest = levels[0], 0, -np.inf
    best, failure = None, None
    for attempt in range(MOST_ATTEMPTS):
        if attempt > 0:
            levels = collapse_to_tetrahedron(top.vertices, top.triangles, top.mass, attempt)
        try:
            positions, more = yield from _from_tetrahedron(levels, REGULAR if attempt % 2 else 0)
        except PrecisionError as error:
            failure = error
            continue
        steps += more
        cosine = float(project_faces(positions, top.triangles).least_cosine.min())
        if cosine > widest:
            best, widest = positions, cosine
        if cosine >= LEAST_COSINE:
            break
    if best is None:
        raise failure or PrecisionError("Faces are too small for double precision on the sphere")
    return best, steps


def _from_tetrahedron(levels: list[SphereLevel], regular: int) -> Steps[tuple[np.ndarray, int]]:
    """From the tetrahedron to the finest of the levels, those of up to `regular` vertices taken for regular meshes."""
    positions, steps = _tetrahedron(levels[-1]), 0
    for level in reversed(levels[:-1]):
        positions, more = yield from _prolonged(level, positions, len(level.vertices) <= regular)
        steps += more
    return positions, steps


def _tetrahedron(level: SphereLevel) -> np.ndarray:
    """Unit vectors (4,3) of a regular tetrahedron, its faces positive."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    return corners * (1 if signed_volumes(corners, level.triangles).min() > 0 else -1)


def _prolonged(level: SphereLevel, positions: np.ndarray, regular: bool = False) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) of a level, relaxed, from those of the coarser one, and the steps taken."""
    return (yield from relax(level.vertices, level.triangles, _reinserted(level, positions), level.mass, regular))


def _reinserted(level: SphereLevel, coarse: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) of a level, from those (k,3) of its coarsened mesh."""
    positions = np.zeros((len(level.vertices), 3))
    positions[level.kept] = coarse
    for step in reversed(level.rounds):
        positions[step.removed] = _best_places(step, positions)
    if not signed_volumes(positions, level.triangles).min() > 0:
        raise PrecisionError("Faces are too small for double precision on the sphere")
    return positions


def _best_places(step: CollapseRound, positions: np.ndarray) -> np.ndarray:
    """Places (r,3) for the vertices that come back: of those tried, the best for the smallest of the faces around."""
    r = len(step.removed)
    parent = positions[step.parent]
    a, b = positions[step.star[:, 1]], positions[step.star[:, 2]]
    at_parent = step.parent[step.owner]
    normal = normalized(cross3(a, b - a))
    beside = (step.star[:, 1] == at_parent) | (step.star[:, 2] == at_parent)
    bisector = np.zeros((r, 3))
    np.add.at(bisector, step.owner[beside], normal[beside])
    middle, width = np.zeros((r, 3)), np.zeros(r)
    np.add.at(middle, step.owner, a)
    np.maximum.at(width, step.owner, lengths(a - parent[step.owner]))
    best, found = np.full(r, -np.inf), parent.copy()
    for direction in (_tangent(middle, parent), _tangent(bisector, parent)):
        for share in TRIED_DISTANCES:
            place = normalized(parent + (share * width)[:, None] * direction)
            score = np.full(r, np.inf)
            np.minimum.at(score, step.owner, triple_products(place[step.owner], a, b) / step.mass)
            better = score > best
            best[better], found[better] = score[better], place[better]
    return found


def _tangent(vectors: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Unit tangents (r,3) at unit vectors (r,3) nearest to given vectors."""
    return normalized(vectors - np.einsum("rd,rd->r", vectors, at)[:, None] * at)
