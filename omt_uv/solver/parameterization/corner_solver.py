"""Make polygon corners convex in patches of a map, each for itself, by an interior point method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..maps.energy import elements, energies, gradient
from ..mesh.geometry import face_areas
from ..mesh.topology import halfedges
from ..refinement.hessian_blocks import Assembly
from ..refinement.projected_newton import (
    ARMIJO,
    FOLD_SHARE,
    FreeMotion,
    NewtonProblem,
    fold_shares,
    newton_direction,
)
from .polygon_corners import CONVEX, CornerBarrier, PolygonCorners

# Strength of the barrier of a corner, per share that its polygon has of the target's area.
STRENGTH = 30.0
# Rounds that make corners convex, and rounds in which the barrier then weakens.
CONVEXIFYING = 12
SETTLING = 4
# Newton steps of a round.
STEPS = 3
# Corners that are reflex start a round at this r, the area over the target, both with a slack.
LEAST = 0.1
# A patch whose area error grew by more than this factor gets an area weight so many times as large.
GROWTH = 1.25
HEAVIER = 1.5
# See `projected_newton.newton_direction`.
PRESSURE = 0.3
# Halvings of a step until a patch stays where it is.
HALVINGS = 12


@dataclass(frozen=True)
class CornerMesh:
    """The charts side by side.

    Attributes
    ----------
    positions (n,3), triangles (m,3)
    target (m,) : areas that the triangles shall have
    area_weight (m,) : weight of the area term
    chart (m,) : the chart of each triangle
    spare (c,) : by how much the areas of a chart may be further off, in sum
    """

    positions: np.ndarray
    triangles: np.ndarray
    target: np.ndarray
    area_weight: np.ndarray
    chart: np.ndarray
    spare: np.ndarray

    def of(self, vertices: np.ndarray, faces: np.ndarray, place: np.ndarray) -> CornerMesh:
        """Some of the vertices (k,) and faces (m,) bool, vertex v as place[v]."""
        return CornerMesh(
            positions=self.positions[vertices],
            triangles=place[self.triangles[faces]],
            target=self.target[faces],
            area_weight=self.area_weight[faces],
            chart=self.chart[faces],
            spare=self.spare,
        )


class CornerPatches:
    """Patches of a mesh, each of which goes its own way; unknowns in the order of their elimination."""

    def __init__(self, mesh: CornerMesh, corners: PolygonCorners, free: np.ndarray):
        n, triangles = len(free), mesh.triangles
        self.faces = elements(mesh.positions, triangles, mesh.target)
        self.assembly, self.motion = Assembly(triangles, n), FreeMotion(~free)
        self.area_weight, self.corners = mesh.area_weight, corners
        self.strength = STRENGTH * corners.whole / mesh.target.sum()
        every = np.concatenate([triangles, corners.triangles])
        tail, head = halfedges(every)
        joined = free[tail] & free[head]
        graph = coo_matrix((np.ones(joined.sum()), (tail[joined], head[joined])), shape=(n, n))
        self.count, self.of_vertex = connected_components(graph, directed=False)
        moving = np.take_along_axis(every, free[every].argmax(1)[:, None], 1)[:, 0]
        self.of_face, self.of_corner = np.split(self.of_vertex[moving], [len(triangles)])
        self.chart = np.zeros(self.count, np.int64)
        self.chart[self.of_face] = mesh.chart
        # As `Elements` measures areas.
        self.spare = mesh.spare / face_areas(mesh.positions, triangles).sum()

    def opened(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) with corners made convex in those patches where fewer are reflex then, at whatever cost."""
        given, w = w, self._forced(w)
        w = self._stepped(w, self.area_weight, self._barrier(w, self.strength))
        return np.where((self._reflex_count(w) < self._reflex_count(given))[self.of_vertex], w, given)

    def convexified(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) with corners made convex in those patches where fewer are reflex then, and areas kept."""
        given, weight = w, self.area_weight
        w = self._forced(w)
        for k in range(SETTLING):
            worse = (self._area_errors(w) > GROWTH * self._area_errors(given)) & (k > 1)
            weight = np.where(worse[self.of_face], HEAVIER * weight, weight)
            w = self._stepped(w, weight, self._barrier(w, self.strength * 0.1**k))
        gain, cost = self._reflex_count(given) - self._reflex_count(w), self._area_errors(w) - self._area_errors(given)
        good = affordable(gain, cost, self.chart, self.spare)
        return np.where(good[self.of_vertex], w, given)

    def _forced(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) after rounds with a barrier that grows stronger at corners while these are reflex."""
        strength = self.strength
        for _ in range(CONVEXIFYING):
            reflex = self.corners.reflex(w)
            if not reflex.any():
                break
            w = self._stepped(w, self.area_weight, self._barrier(w, strength))
            strength = np.where(reflex, 2 * strength, strength)
        return w

    def _barrier(self, w, strength) -> CornerBarrier:
        target = self.corners.target
        slack = np.maximum(LEAST * target - self.corners.areas(w), 0) / (1 - LEAST)
        # What is convex stays so.
        return CornerBarrier(self.corners, np.where(self.corners.convex(w), -CONVEX * target, slack), strength)

    def _reflex_count(self, w):
        return np.bincount(self.of_corner, self.corners.reflex(w), self.count)

    def _area_errors(self, w):
        return np.bincount(self.of_face, np.abs(self.faces.areas(w) - self.faces.area * self.faces.ratio), self.count)

    def _stepped(self, w, weight, barrier: CornerBarrier) -> np.ndarray:
        """The map after some Newton steps, of which every patch takes as much as it may."""
        problem = NewtonProblem(self.faces, self.assembly, self.motion, weight, (barrier,))
        value = self._values(w, weight, barrier)
        for _ in range(STEPS):
            step, _ = newton_direction(problem, w, PRESSURE)
            down = gradient(self.faces, w, weight) + barrier.derivatives(w)[0]
            slope = np.bincount(self.of_vertex, (step.conj() * down).real, self.count)
            far = np.full(self.count, 1 / FOLD_SHARE)
            np.minimum.at(far, self.of_face, fold_shares(*self.faces.derivatives(w), *self.faces.derivatives(step)))
            share = FOLD_SHARE * far
            for _ in range(HALVINGS):
                trial = self._values(w + share[self.of_vertex] * step, weight, barrier)
                waiting = ~(trial <= value + ARMIJO * share * slope)
                if not waiting.any():
                    break
                share[waiting] *= 0.5
            share[waiting] = 0
            w, value = w + share[self.of_vertex] * step, np.where(waiting, value, trial)
        return w

    def _values(self, w, weight, barrier: CornerBarrier) -> np.ndarray:
        of_faces = np.bincount(self.of_face, energies(self.faces, w, weight), self.count)
        return of_faces + np.bincount(self.of_corner, barrier.energies(w), self.count)


def affordable(gain: np.ndarray, cost: np.ndarray, chart: np.ndarray, spare: np.ndarray) -> np.ndarray:
    """Patches (p,) bool with a gain: those that cost nothing, and the cheapest others that their charts can spare.

    gain, cost, chart (p,); spare (c,).
    """
    good = gain > 0
    paid = np.where(good, np.maximum(cost, 0), 0)
    order = np.lexsort((paid / np.maximum(gain, 1e-300), chart))
    total, first = np.cumsum(paid[order]), np.searchsorted(chart[order], chart[order])
    good[order] &= total - np.concatenate([[0], total])[first] <= spare[chart[order]]
    return good
