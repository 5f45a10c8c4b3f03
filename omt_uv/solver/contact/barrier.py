"""Bring a mesh as near as possible to where it is to be, and let no faces meet on the way.

From positions in which nothing meets, Newton's method minimizes the distance from those that are asked for, and a
barrier of the distances d between vertices and triangles, and edges and edges, that are closer than a reach h (Li et
al. 2020):

    E(x) = sum_i m_i |x_i - y_i|^2 / (2 l^2) - k sum_p (d_p / h_p - 1)^2 log(d_p / h_p),

l the mean length of edges. What is held weighs so much more that it comes to its place to a millionth of an edge, and
is set there at the end; a step is halved until nothing meets and E falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..linalg.sparse import Factor
from ..mesh.topology import halfedges
from .new_crossings import NewCrossings
from .proximity import ClosePairs, close_pairs

# The reach of the barrier, as a share of the mean length of edges, but no more than what was between faces before.
REACH = 0.1
# Weight of the barrier, and of what is held.
STRENGTH = 1e-3
HELD = 1e6
# Newton's steps; each moves nothing farther than this share of an edge, and is halved at most so many times.
STEPS = 40
FARTHEST = 0.5
HALVINGS = 12
# Steps that move nothing by more than this share of an edge end it.
STILL = 1e-3
# Faces closer than this share of an edge before meet there already.
MEETING = 1e-9
# What distances and lengths are divided by where they are nothing.
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class _Problem:
    """Where vertices (n,3) shall go, what they weigh (n,), and what tells which triangles newly intersect."""

    goal: np.ndarray
    mass: np.ndarray
    crossings: NewCrossings
    edge: float

    def near(self, at: np.ndarray) -> tuple[ClosePairs, np.ndarray]:
        """Pairs (k) that the barrier holds apart at positions (n,3), and its reach (k,) for each."""
        found = close_pairs(at, self.crossings.faces.triangles, REACH * self.edge)
        found = found.among(_lengths(found, at) < REACH * self.edge)
        reach = np.minimum(_lengths(found, self.crossings.before), REACH * self.edge)
        active = (_lengths(found, at) < reach) & (reach > MEETING * self.edge)
        return found.among(active), reach[active]

    def energy(self, at: np.ndarray) -> float:
        """E at positions (n,3)."""
        pairs, reach = self.near(at)
        share = np.maximum(_lengths(pairs, at) / reach, TINY)
        away = 0.5 * float((self.mass * np.square(at - self.goal).sum(axis=1)).sum())
        return away - STRENGTH * float((np.square(share - 1) * np.log(share)).sum())

    def step(self, at: np.ndarray) -> np.ndarray:
        """Newton's step (n,3) from positions (n,3); closest points keep their places on triangles and edges."""
        pairs, reach = self.near(at)
        offset, weights = pairs.offsets(at)
        length = np.maximum(np.linalg.norm(offset, axis=1), TINY)
        share = np.maximum(length / reach, TINY)
        slope = (-2 * (share - 1) * np.log(share) - np.square(share - 1) / share) / reach
        bend = (-2 * np.log(share) - 4 * (share - 1) / share + np.square((share - 1) / share)) / reach**2
        away = (weights[:, :, None] * (offset / length[:, None])[:, None]).reshape(-1, 12)
        columns = (3 * pairs.corners[:, :, None] + np.arange(3)).reshape(-1, 12)
        pattern = columns.ravel(), np.arange(0, columns.size + 1, 12)
        rows = sp.csr_matrix((away.ravel(), *pattern), (len(away), at.size))
        gradient = (self.mass[:, None] * (at - self.goal)).ravel() + STRENGTH * (rows.T @ slope)
        matrix = rows.T @ sp.diags(STRENGTH * bend) @ rows + sp.diags(np.repeat(self.mass, 3))
        return -Factor(matrix).solve(gradient).reshape(-1, 3)


def _lengths(pairs: ClosePairs, at: np.ndarray) -> np.ndarray:
    """Distances (k,) of pairs at positions (n,3)."""
    return np.linalg.norm(pairs.offsets(at)[0], axis=1)


def brought(start: np.ndarray, goal: np.ndarray, crossings: NewCrossings, free: np.ndarray) -> np.ndarray:
    """Positions (n,3) as near to `goal` (n,3) as they can come from `start` (n,3), where no triangles newly intersect,
    without any that do.

    What is not `free` (n,) bool is at its goal, and where it cannot get there, something meets all the same.
    """
    triangles = crossings.faces.triangles
    tail, head = halfedges(triangles)
    edge = float(np.linalg.norm(crossings.before[tail] - crossings.before[head], axis=1).mean())
    problem = _Problem(goal, np.where(free, 1.0, HELD) / edge**2, crossings, edge)
    at, energy = start, problem.energy(start)
    for _ in range(STEPS):
        step = problem.step(at)
        longest = float(np.abs(step).max())
        share = min(1.0, FARTHEST * edge / max(longest, TINY))
        for _ in range(HALVINGS):
            tried = at + share * step
            if not len(crossings.pairs(tried)) and (fallen := problem.energy(tried)) <= energy:
                break
            share /= 2
        else:
            break
        at, energy = tried, fallen
        if share == 1 and longest < STILL * edge:
            break
    return np.where(free[:, None], at, goal)
