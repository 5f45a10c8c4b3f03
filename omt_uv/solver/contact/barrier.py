"""Bring a mesh as near as possible to where it is to be, and let no faces meet on the way.

From positions in which nothing meets, Newton's method minimizes the distance from those that are asked for, and a
barrier of the distances d between vertices and triangles, and edges and edges, that are closer than a reach h (Li et
al. 2020):

    E(x) = sum_i m_i |x_i - y_i|^2 / (2 l^2) - k sum_p (d_p / h_p - 1)^2 log(d_p / h_p),

l the mean length of edges. What is held weighs so much more that it comes to its place to a millionth of an edge, and
is set there at the end. What is not close to one another has nothing to do with one another: a step is halved for each
such group by itself, until nothing meets and E falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..linalg.sparse import Factor
from ..mesh.geometry import affine_images
from ..mesh.topology import graph_components, halfedges
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
# Times that what no halving helps, and then what meets it, is left where it is; and that parts which meet are left
# there at first.
SETTLINGS = 4
PARTS = 4
# Steps that move nothing by more than this share of an edge end it.
STILL = 3e-3
# Groups whose step is shorter than this share of an edge stay.
CLOSE = 3e-4
# Less of the energy than this in one step is not worth another one.
ENOUGH = 0.05
# Faces closer than this share of an edge before meet there already.
MEETING = 1e-9
# An energy that rises by less than this share of it does not.
ROUNDING = 1e-9
# What distances and lengths are divided by where they are nothing.
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class _Close:
    """Pairs (k) that the barrier holds apart, its reach (k,), and lengths of pairs over it (k,)."""

    pairs: ClosePairs
    reach: np.ndarray
    share: np.ndarray

    def groups(self, n: int) -> np.ndarray:
        """Which group each of n vertices is of, (n,): those that act upon one another."""
        corner = self.pairs.corners
        return graph_components(corner[:, [0, 0, 0]].ravel(), corner[:, 1:].ravel(), n)[1]


@dataclass(frozen=True)
class _Problem:
    """Where vertices (n,3) shall go, what they weigh (n,), and what tells which triangles newly intersect."""

    goal: np.ndarray
    mass: np.ndarray
    crossings: NewCrossings
    edge: float

    def near(self, at: np.ndarray, last: _Close | None = None, moved: np.ndarray | None = None) -> _Close:
        """What is close at positions (n,3); what was close before but the vertices that have `moved` (n,) bool did is
        known."""
        found = close_pairs(at, self.crossings.faces.triangles, REACH * self.edge, moved)
        found = found.among(_lengths(found, at) < REACH * self.edge)
        if last is not None and moved is not None:
            found = found.joined(last.pairs.among(~moved[last.pairs.corners].any(axis=1)))
        reach = np.minimum(_lengths(found, self.crossings.before), REACH * self.edge)
        length = _lengths(found, at)
        active = (length < reach) & (reach > MEETING * self.edge)
        return _Close(found.among(active), reach[active], np.maximum(length[active] / reach[active], TINY))

    def meeting(self, at: np.ndarray, moved: np.ndarray | None = None) -> np.ndarray:
        """Pairs (k,2) of triangles that newly intersect at positions (n,3), but for those that touched before; only
        those with a vertex that has `moved` (n,) bool where this is given."""
        concerned = None if moved is None else moved[self.crossings.faces.triangles].any(axis=1)
        return self.crossings.apart(self.crossings.pairs(at, concerned))

    def energies(self, at: np.ndarray, near: _Close, group: np.ndarray) -> np.ndarray:
        """E at positions (n,3) of every group (n,) of vertices; what is between two is shared."""
        count = int(group.max()) + 1
        away = 0.5 * self.mass * np.square(at - self.goal).sum(axis=1)
        held = -STRENGTH * np.square(near.share - 1) * np.log(near.share)
        whose = group[near.pairs.corners].ravel()
        return np.bincount(group, away, count) + np.bincount(whose, np.repeat(held / 4, 4), count)

    def step(self, at: np.ndarray, near: _Close) -> np.ndarray:
        """Newton's step (n,3) from positions (n,3); closest points keep their places on triangles and edges."""
        offset, weights = near.pairs.offsets(at)
        length = np.maximum(np.linalg.norm(offset, axis=1), TINY)
        share, reach = near.share, near.reach
        slope = (-2 * (share - 1) * np.log(share) - np.square(share - 1) / share) / reach
        bend = (-2 * np.log(share) - 4 * (share - 1) / share + np.square((share - 1) / share)) / reach**2
        away = (weights[:, :, None] * (offset / length[:, None])[:, None]).reshape(-1, 12)
        columns = (3 * near.pairs.corners[:, :, None] + np.arange(3)).reshape(-1, 12)
        pattern = columns.ravel(), np.arange(0, columns.size + 1, 12)
        rows = sp.csr_matrix((away.ravel(), *pattern), (len(away), at.size))
        gradient = (self.mass[:, None] * (at - self.goal)).ravel() + STRENGTH * (rows.T @ slope)
        matrix = rows.T @ sp.diags(STRENGTH * bend) @ rows + sp.diags(np.repeat(self.mass, 3))
        return -Factor(matrix).solve(gradient).reshape(-1, 3)

    def searched(self, at: np.ndarray, near: _Close) -> tuple[np.ndarray, _Close, float]:
        """Positions (n,3) after a step in which nothing comes to meet and the energy of no group rises, what is close
        there, and what share of the energy is gone: groups go as far as each of them can."""
        group = near.groups(len(at))
        step, here = self.step(at, near), self.energies(at, near, group)
        longest = np.zeros(len(here))
        np.maximum.at(longest, group, np.abs(step).max(axis=1))
        # What is nearly where it shall be stays.
        share = np.minimum(1.0, FARTHEST * self.edge / np.maximum(longest, TINY)) * (longest > CLOSE * self.edge)
        triangles = self.crossings.faces.triangles
        for k in range(HALVINGS + SETTLINGS):
            tried, moved = at + share[group][:, None] * step, (share > 0)[group]
            stuck = np.zeros(len(here), bool)
            stuck[group[triangles[self.meeting(tried, moved)]]] = True
            stuck &= share > 0
            if not stuck.any():
                there = self.near(tried, near, moved)
                left = self.energies(tried, there, group)
                stuck = (left > here * (1 + ROUNDING)) & (share > 0)
                if not stuck.any():
                    return tried, there, 1 - float(left.sum()) / max(float(here.sum()), TINY)
            goes_on = (k < HALVINGS) & (share * longest > STILL * self.edge)
            share[stuck] = np.where(goes_on, share / 2, 0.0)[stuck]
        return at, near, 0.0


def _lengths(pairs: ClosePairs, at: np.ndarray) -> np.ndarray:
    """Distances (k,) of pairs at positions (n,3)."""
    return np.linalg.norm(pairs.offsets(at)[0], axis=1)


def brought(start: np.ndarray, goal: np.ndarray, crossings: NewCrossings, free: np.ndarray) -> np.ndarray:
    """Positions (n,3) as near to `goal` (n,3) as they can come from `start` (n,3), where no triangles newly intersect,
    without any that do.

    What is not `free` (n,) bool is at its goal, and where it cannot get there, something meets all the same; so may
    what touched before, which planes part (`separation`).
    """
    triangles = crossings.faces.triangles
    tail, head = halfedges(triangles)
    edge = float(np.linalg.norm(crossings.before[tail] - crossings.before[head], axis=1).mean())
    problem = _Problem(goal, np.where(free, 1.0, HELD) / edge**2, crossings, edge)
    at = _ahead(problem, start)
    near = problem.near(at)
    for _ in range(STEPS):
        last = at
        at, near, gone = problem.searched(at, near)
        if np.abs(at - last).max() < STILL * edge or gone < ENOUGH:
            break
    return np.where(free[:, None], at, goal)


def _ahead(problem: _Problem, start: np.ndarray) -> np.ndarray:
    """Positions (n,3) after the affine maps nearest to what is asked for, of parts that are connected or close: such a
    map brings nothing together, and is most of the way. Parts that would meet others stay where they `start` (n,3)."""
    triangles = problem.crossings.faces.triangles
    corner = np.concatenate([triangles[:, :2], triangles[:, 1:], problem.near(start).pairs.corners[:, [0, 3]]])
    count, part = graph_components(corner[:, 0], corner[:, 1], len(start))
    moved = affine_images(start, problem.goal, part, np.ones(len(start)))
    stays = np.zeros(count, bool)
    for _ in range(PARTS):
        at = np.where(stays[part][:, None], start, moved)
        met = problem.meeting(at)
        if not len(met):
            return at
        stays[part[triangles[met]]] = True
    return start
