"""Make polygon corners convex in patches of a map, each for itself, by an interior point method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ...maps.energy import Elements, energies
from ...maps.mirror_symmetry import MirrorSymmetry
from ...maps.polygon_elements import polygon_elements, with_convex_quads
from ...mesh.polygon_areas import polygon_areas
from ...refinement.hessian_blocks import assembly_of
from ...refinement.mirrored_motion import MirroredMotion
from ...refinement.projected_newton import (
    ARMIJO,
    FOLD_SHARE,
    FreeMotion,
    NewtonProblem,
    fold_shares,
    newton_steps,
)
from .polygon_corners import CONVEX, CornerBarrier, Forced, PolygonCorners

# Strength of the barrier of a corner, per share that its polygon has of the target's area.
STRENGTH = 30.0
# Rounds that make corners convex, so many, and up to so many while they come nearer to that; and rounds in which the
# barrier then weakens: so many, and up to so many while areas are further off than can be spared.
CONVEXIFYING = 12
MOST_CONVEXIFYING = 48
# What a round beyond the first ones has to take off from what corners lack.
WORTHWHILE = 0.05
SETTLING = 4
MOST_SETTLING = 12
# Newton steps of a round.
STEPS = 3
# Corners that are reflex start a round at this r, the area over the target, both with a slack.
LEAST = 0.1
# A patch whose area error grew by more than this factor gets an area weight so many times as large.
GROWTH = 1.25
HEAVIER = 1.5
# See `projected_newton.newton_steps`.
PRESSURE = 0.3
# Halvings of a step until a patch stays where it is.
HALVINGS = 12


@dataclass(frozen=True)
class CornerMesh:
    """The charts side by side.

    Attributes
    ----------
    positions (n,3), triangles (m,3)
    polygon (m,) : whose triangle each is, any numbers
    target (m,) : areas that the triangles ask for; a polygon shall have their sum
    area_weight (c,) : weight of the area term
    chart (m,) : the chart of each triangle
    spare (c,) : by how much the areas of a chart may be further off, in sum
    """

    positions: np.ndarray
    triangles: np.ndarray
    polygon: np.ndarray
    target: np.ndarray
    area_weight: np.ndarray
    chart: np.ndarray
    spare: np.ndarray

    def of(self, vertices: np.ndarray, faces: np.ndarray, place: np.ndarray) -> CornerMesh:
        """Some of the vertices (k,) and faces (m,) bool, vertex v as place[v]."""
        return CornerMesh(
            positions=self.positions[vertices],
            triangles=place[self.triangles[faces]],
            polygon=self.polygon[faces],
            target=self.target[faces],
            area_weight=self.area_weight,
            chart=self.chart[faces],
            spare=self.spare,
        )


class CornerPatches:
    """Patches of a mesh, each of which goes its own way; unknowns in the order of their elimination.

    forced : known to other patches, and added to by these
    """

    def __init__(
        self,
        mesh: CornerMesh,
        corners: PolygonCorners,
        free: np.ndarray,
        symmetry: MirrorSymmetry | None = None,
        forced: Forced | None = None,
    ):
        self._known: Forced = {} if forced is None else forced
        n, self.motion, self.corners, self.symmetry = len(free), FreeMotion(~free), corners, symmetry
        # Areas are those that the refinement gave, and that decide whether the map is kept: of whole polygons.
        self.faces = polygon_elements(mesh.positions, mesh.triangles, mesh.target, mesh.polygon)
        self.assembly, count = assembly_of(self.faces, n, symmetry=symmetry), len(self.faces.area)
        self.strength = STRENGTH * corners.whole / mesh.target.sum()
        self.count, patch = self._patches(free)
        self.of_vertex, self.of_face, self.of_corner = np.split(patch, [n, n + count])
        of_vertex = np.zeros(n, np.int64)
        of_vertex[mesh.triangles] = mesh.chart[:, None]
        of_face = np.zeros(count, np.int64)
        of_face[self.faces.owner] = of_vertex[self.faces.triangles[:, 0]]
        self.area_weight = mesh.area_weight[of_face]
        self.chart = np.zeros(self.count, np.int64)
        self.chart[self.of_face] = of_face
        # As `Elements` measures areas.
        self.spare = mesh.spare / polygon_areas(mesh.positions, mesh.triangles, mesh.polygon).sum()

    def _patches(self, free: np.ndarray) -> tuple[int, np.ndarray]:
        """How many patches there are, and that of every vertex, polygon and corner: what shares one goes one way, and
        so do mirror images."""
        n, count = len(free), len(self.faces.area)
        vertices = np.concatenate([self.faces.triangles, self.corners.triangles])
        cells = n + np.concatenate([self.faces.owner, count + np.arange(len(self.corners.triangles))])
        moving = free[vertices]
        ends = [vertices[moving], np.repeat(cells, moving.sum(axis=1))]
        if self.symmetry is not None:
            ends = [np.append(ends[0], np.flatnonzero(free)), np.append(ends[1], self.symmetry.representative[free])]
        size = n + count + len(self.corners.triangles)
        graph = coo_matrix((np.ones(len(ends[0])), ends), shape=(size, size))
        return connected_components(graph, directed=False)

    def opened(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) with corners made convex in those patches where fewer are reflex then, at whatever cost."""
        given, w = w, self._forced(self._symmetric(w))
        if not (self._reflex_count(w) < self._reflex_count(given)).any():
            return given
        w = self._stepped(w, self.area_weight, self._barrier(w, self.strength))
        return np.where((self._reflex_count(w) < self._reflex_count(given))[self.of_vertex], w, given)

    def convexified(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) with corners made convex in those patches where fewer are reflex then, and areas kept."""
        given, weight = w, self.area_weight
        before, reflex = self._area_errors(given), self._reflex_count(given)
        w = self._forced(self._symmetric(w))
        if not (self._reflex_count(w) < reflex).any():
            return given
        for k in range(MOST_SETTLING):
            worse = (self._area_errors(w) > GROWTH * before) & (k > 1)
            weight = np.where(worse[self.of_face], HEAVIER * weight, weight)
            w = self._stepped(w, weight, self._barrier(w, self.strength * 0.1**k))
            gain = reflex - self._reflex_count(w)
            good = affordable(gain, self._costs(given, w), self.chart, self.spare)
            if k + 1 >= SETTLING and (good | (gain <= 0)).all():
                break
        return np.where(good[self.of_vertex], w, given)

    def _symmetric(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,), which is symmetric but for rounding, symmetric to the last bit."""
        return w if self.symmetry is None else self.symmetry.spread(w)

    def _forced(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) after rounds with a barrier that grows stronger at corners while these are reflex."""
        parts = (w, self.motion.free, self.faces.triangles, self.faces.area, self.corners.triangles, self.area_weight)
        key = tuple(part.tobytes() for part in parts)
        if key not in self._known:
            self._known[key] = self._forced_anew(w)
        return self._known[key]

    def _forced_anew(self, w: np.ndarray) -> np.ndarray:
        strength, lacking = self.strength, np.inf
        for k in range(MOST_CONVEXIFYING):
            reflex = self.corners.reflex(w)
            before, lacking = lacking, self._lacking(w, reflex)
            if not reflex.any() or (k >= CONVEXIFYING and lacking > (1 - WORTHWHILE) * before):
                break
            w = self._stepped(w, self.area_weight, self._barrier(w, strength))
            strength = np.where(reflex, 2 * strength, strength)
        return w

    def _barrier(self, w, strength) -> CornerBarrier:
        target = self.corners.target
        slack = np.maximum(LEAST * target - self.corners.areas(w), 0) / (1 - LEAST)
        # What is convex stays so.
        return CornerBarrier(self.corners, np.where(self.corners.convex(w), -CONVEX * target, slack), strength)

    def _lacking(self, w: np.ndarray, reflex: np.ndarray) -> float:
        """What the areas of reflex corners (k,) bool lack, over those that they shall have."""
        corners = self.corners
        return float(((corners.least - corners.areas(w)) / corners.target)[reflex].sum())

    def _reflex_count(self, w):
        return np.bincount(self.of_corner, self.corners.reflex(w), self.count)

    def _area_errors(self, w):
        return np.bincount(self.of_face, np.abs(self.faces.areas(w) - self.faces.area * self.faces.ratio), self.count)

    def _costs(self, given, w):
        """By how much the areas of every patch (p,) are further off than in another map, as shares of a chart's own
        area: all others lose by what that grows."""
        grown = np.bincount(self.of_face, self.faces.areas(w) - self.faces.areas(given), self.count)
        return self._area_errors(w) - self._area_errors(given) + np.abs(grown)

    def _stepped(self, w, weight, barrier: CornerBarrier) -> np.ndarray:
        """The map after some Newton steps, of which every patch takes as much as it may."""
        # Quads that have become convex are measured along both diagonals from then on, and stay so.
        faces = with_convex_quads(self.faces, w)
        motion = self.motion if self.symmetry is None else MirroredMotion(self.motion, self.symmetry, w)
        problem = NewtonProblem(faces, self.assembly, motion, weight, (barrier,), symmetry=self.symmetry)
        value = self._values(faces, w, weight, barrier)
        of_triangle, counts = self.of_face[faces.owner], faces.triangle_areas > 0
        for _ in range(STEPS):
            step, slopes = newton_steps(problem, w, PRESSURE)
            slope = np.bincount(self.of_vertex, (step.conj() * slopes).real, self.count)
            step = motion.frame(w) * step
            if self.symmetry is not None:
                step = self.symmetry.spread(step)
            far = np.full(self.count, 1 / FOLD_SHARE)
            folding = fold_shares(*faces.derivatives(w), *faces.derivatives(step))
            np.minimum.at(far, of_triangle[counts], folding[counts])
            share = FOLD_SHARE * far
            for _ in range(HALVINGS):
                trial = self._values(faces, w + share[self.of_vertex] * step, weight, barrier)
                waiting = ~(trial <= value + ARMIJO * share * slope)
                if not waiting.any():
                    break
                share[waiting] *= 0.5
            share[waiting] = 0
            w, value = w + share[self.of_vertex] * step, np.where(waiting, value, trial)
        return w

    def _values(self, faces: Elements, w, weight, barrier: CornerBarrier) -> np.ndarray:
        of_faces = np.bincount(self.of_face, energies(faces, w, weight), self.count)
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
