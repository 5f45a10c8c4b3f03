"""Gather vertices where faces would cut off what they are to cover: a wrap has as many vertices as it has.

A match distorts little, so that a neck that the source has not gets few faces, and they are flat: a stub of the target
may stand out between three vertices. Vertices around faces that are off the target go to the mean of the centroids of
their faces, weighed by how much each is off, as a moving mesh follows a monitor function (Winslow 1966; Huang, Russell
2011), within the domain, where nothing folds; all else stays.
"""

from __future__ import annotations

import numpy as np

from ..mesh.closest_point import ClosestPoint
from ..mesh.geometry import face_areas, face_normals, halfedge_lengths
from ..mesh.topology import vertices_around
from ..progress import Progress, Steps
from .carriers import InPlace
from .domains import Case
from .surface_newton import in_space

# Rounds of measuring, at most; moves in each; rings of vertices around faces that are off, one more every few rounds.
ROUNDS = 12
MOVES = 4
RINGS = 3
WIDER_EVERY = 4
# Rounds in which vertices at folds stay.
RESTORING = 30


def gathered(case: Case, placed: InPlace, closeness: float) -> Steps[InPlace]:
    """Places (n) of the source's vertices with its faces nearer to the target than `closeness`, a share of its
    diagonal, as far as that goes. Landmarks, the boundary, and what is not near faces that are off stay."""
    pair = case.pair
    own = pair.split.parent < pair.source.count
    held = np.zeros(len(pair.vertices), bool)
    held[pair.landmarks] = held[pair.loop] = True
    distance = _Distance(case)
    off = np.zeros(len(pair.triangles))
    rows, best, least = np.flatnonzero(own), placed, np.inf
    for k in range(ROUNDS):
        yield Progress("Gathering", k / ROUNDS)
        off[rows] = distance(placed.positions, pair.triangles[rows]) / closeness
        bad = off > 1
        beside = float(face_areas(placed.positions, pair.triangles) @ off**2)
        if beside < least:
            best, least = placed, beside
        if not bad.any():
            break
        free = vertices_around(pair.triangles, bad, len(held), RINGS + k // WIDER_EVERY) & ~held
        near = free[pair.triangles].any(axis=1)
        for _ in range(MOVES):
            placed = _moved(case, placed, pair.triangles[near], off[near], free)
        rows = np.flatnonzero(near & own)
    return best


class _Distance:
    """How far the middles of faces are from the target, over its diagonal."""

    def __init__(self, case: Case):
        target = case.pair.target
        self.triangles = target.triangles[: target.count]
        self.diagonal = float(np.linalg.norm(np.ptp(target.vertices, axis=0)))
        spacing = float(np.median(halfedge_lengths(target.vertices, self.triangles)))
        self.closest = ClosestPoint(target.vertices, self.triangles, spacing)

    def __call__(self, positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Of triangles (m,3) of positions (n,3)."""
        middle, normals = positions[triangles].mean(axis=1), face_normals(positions, triangles)
        found = self.closest.closer(middle, normals, self.closest(middle, normals))
        return np.linalg.norm(found.points - middle, axis=1) / self.diagonal


def _moved(case: Case, placed: InPlace, triangles: np.ndarray, off: np.ndarray, free: np.ndarray) -> InPlace:
    """The places with vertices `free` (n,) bool at the means of the centroids of triangles (m,3) around them."""
    domain, n = placed.domain, len(free)
    weight = face_areas(in_space(domain), triangles) * (1 + off**2)
    corner = triangles.ravel()
    total = np.bincount(corner, np.repeat(weight, 3), n)
    moment = weight[:, None] * domain[triangles].mean(axis=1)
    sums = np.stack([np.bincount(corner, np.repeat(part, 3), n) for part in moment.T], axis=1)
    free = free & (total > 0)
    target = domain.copy()
    target[free] = case.carrier.within(sums[free] / total[free, None])
    for _ in range(RESTORING):
        trial = InPlace(placed.positions, target, placed.faces, placed.barycentric)
        folded = case.carrier.folded(trial, triangles) & free[triangles].any(axis=1)
        if not folded.any():
            break
        free[triangles[folded]] = False
        target = np.where(free[:, None], target, domain)
    else:
        return placed
    moved = InPlace(*(part.copy() for part in vars(placed).values()))
    vertices = np.flatnonzero(free)
    moved.put(vertices, case.carrier.place(target[vertices]), np.ones(len(vertices), bool))
    return moved
