"""Correct the areas of a laid out sphere, whose straight triangles are not images of spherical ones, by least squares.

An equal-area projection keeps the area of a spherical triangle, whose sides come out as curves. The triangle on its
three corners is off by what lies between curve and chord: little at the equator, half of the face at a pole. Moving
the corners by a share of that puts it right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..linalg.sparse import minimum_degree, solve_spd
from ..mesh.geometry import cross2, signed_areas
from ..mesh.spherical_geometry import spherical_areas
from ..progress import Progress, Steps
from .projections import EQUIRECT, is_cylindrical
from .unfolding import Polygons, Unfolding, brought_into_square

# Steps of Levenberg and Marquardt.
ROUNDS = 14
# Share of the area in the wrong place at which the areas count as exact.
TOLERANCE = 1e-4
# As often the steps are repeated, while faces are still folded.
REPEATS = 3
# Factor of what folded faces count, with every repeat.
EMPHASIS = 5.0
# Factor of the squared displacement, in radians on the sphere, against the squared relative errors of the areas.
ANCHOR = 1e-5
# First factor of the squared length of a step.
DAMPING = 1e-2
# Its factor after a step that lowers the energy.
DAMPING_DECREASE = 0.1
# Its factor after one that does not.
DAMPING_INCREASE = 5.0
# Least target share of a face, relative to the mean: relative errors of less mean nothing.
LEAST_SHARE = 1e-4
# A straight triangle with less than this share of the area of its curved image is no image of it.
USABLE = 0.25
# A round that was hardly damped has to lower the sum of both by this share, or is the last.
LEAST_GAIN = 0.02


@dataclass(frozen=True)
class ExactAreas:
    """The unfolding with its areas corrected.

    status: "converged" or "improved"; iterations: steps; residual: sum |area share - target share| left; folded (k,):
    faces that still are.
    """

    unfolding: Unfolding
    status: str
    iterations: int
    residual: float
    folded: np.ndarray


def equirectangular_areas(points: np.ndarray, unfolded: Unfolding, polygons: Polygons) -> np.ndarray:
    """Target areas (m,) of the straight triangles of an equirectangular unfolding of unit vectors (n,3).

    Most keep what they have; those near a pole, but not at it, that are folded, or far from the area of their curved
    image, get the latter. The points are as they were laid out.
    """
    straight = signed_areas(unfolded.corners(), polygons.triangles)
    cells = np.einsum("qk,mkd->mqd", _CELLS, points[polygons.vertex_triangles])
    cosine = np.hypot(cells[..., 0], cells[..., 1]) / np.linalg.norm(cells, axis=2)
    stretch = (1 / np.maximum(cosine, 1e-9)).mean(axis=1)
    curved = spherical_areas(points, polygons.vertex_triangles) * stretch / (2 * np.pi**2)
    at_pole = unfolded.poles[unfolded.index][polygons.triangles].any(axis=1)
    return np.where(at_pole | (straight > USABLE * curved), straight, curved)


def correct_areas(unfolded: Unfolding, polygons: Polygons, shares: np.ndarray, projection: str) -> Steps[ExactAreas]:
    """Move the points of an unfolding so that every triangle has its share (m,) of the area in the plane.

    Levenberg-Marquardt (Marquardt 1963) on sum (area / target - 1)^2 target, plus a little of the displacement on the
    sphere: of all ways to the same areas, nearly the shortest. Points of a cylinder stay within it. Shares that are not
    positive, of faces folded on the sphere, are taken for tiny ones.
    """
    shares = np.maximum(shares / shares.sum(), LEAST_SHARE / len(shares))
    shares /= shares.sum()
    cylindrical = is_cylindrical(projection)
    problem = _AreaProblem(unfolded, polygons, shares, _sphere_metric(unfolded, projection), cylindrical)
    uv, done = unfolded.uv, 0
    for repeat in range(REPEATS):
        uv, rounds = yield from _levenberg_marquardt(problem, uv, repeat / REPEATS)
        done += rounds
        if not problem.emphasise_folds(uv):
            break
    result = unfolded.with_points(uv)
    if cylindrical:
        result = brought_into_square(result, polygons)
    areas = signed_areas(result.corners(), polygons.triangles)
    left = float(np.abs(areas / areas.sum() - shares).sum())
    status = "converged" if left < TOLERANCE else "improved"
    return ExactAreas(
        unfolding=result, status=status, iterations=done, residual=left, folded=np.flatnonzero(areas <= 0)
    )


def _levenberg_marquardt(problem: _AreaProblem, uv: np.ndarray, start: float) -> Steps[tuple[np.ndarray, int]]:
    """Points (k,2) of less energy, and the rounds it took; the progress goes on from `start`."""
    damping, energy, order = DAMPING, problem.energy(uv), problem.order
    done = 0
    for done in range(1, ROUNDS + 1):
        yield Progress("Exact areas", start + (done - 1) / ROUNDS / REPEATS)
        trial = problem.within(uv + problem.step(uv, damping, order))
        lower = problem.energy(trial)
        if lower < energy:
            settled = damping <= ANCHOR and lower > (1 - LEAST_GAIN) * energy
            uv, energy, damping = trial, lower, damping * DAMPING_DECREASE
            if settled:
                break
        else:
            damping *= DAMPING_INCREASE
    return uv, done


class _AreaProblem:
    """Residuals (area - target) / sqrt(target) of the triangles, and their derivatives by the points of an
    unfolding."""

    def __init__(
        self, unfolded: Unfolding, polygons: Polygons, shares: np.ndarray, metric: np.ndarray, cylindrical: bool
    ):
        self.unfolded, self.triangles, self.shares = unfolded, polygons.triangles, shares
        self.cylindrical = cylindrical
        self.scale = 1 / np.sqrt(shares)
        self.index = unfolded.index[self.triangles]
        self.sign = unfolded.sign[self.triangles]
        self.free = np.flatnonzero(~unfolded.fixed.ravel())
        self.metric = metric
        self.order = self._elimination_order()

    def _elimination_order(self) -> np.ndarray:
        """Elimination order of the free coordinates, from that of the points."""
        m, k = len(self.index), len(self.unfolded.uv)
        touches = sp.csr_matrix((np.ones(3 * m), (np.repeat(np.arange(m), 3), self.index.ravel())), shape=(m, k))
        points = minimum_degree(touches.T @ touches)
        place = np.empty(2 * k, dtype=np.int64)
        place[(2 * points[:, None] + np.arange(2)).ravel()] = np.arange(2 * k)
        return np.argsort(place[self.free])

    def residual(self, uv: np.ndarray) -> np.ndarray:
        """Share of the area less the target share, times `scale`, (m,), with the points at uv (k,2); infinite without
        area."""
        areas = signed_areas(self.unfolded.with_points(uv).corners(), self.triangles)
        total = areas.sum()
        # A step that goes too far may press all of a small globe onto one edge.
        return (areas / total - self.shares) * self.scale if total > 0 else np.full(len(areas), np.inf)

    def emphasise_folds(self, uv: np.ndarray) -> bool:
        """Let faces that are folded at uv (k,2) count more from now on; whether there are any."""
        folded = signed_areas(self.unfolded.with_points(uv).corners(), self.triangles) <= 0
        self.scale = np.where(folded, EMPHASIS * np.maximum(self.scale, 1 / np.sqrt(self.shares.mean())), self.scale)
        return bool(folded.any())

    def within(self, uv: np.ndarray) -> np.ndarray:
        """The points (k,2), those of a cylinder between its poles."""
        if self.cylindrical:
            uv[:, 1] = np.clip(uv[:, 1], 0, 1)
        return uv

    def pull(self, uv: np.ndarray) -> np.ndarray:
        """Half the slope of the squared displacement, (2k,)."""
        return ANCHOR * (self.metric * (uv - self.unfolded.uv)).ravel()

    def energy(self, uv: np.ndarray) -> float:
        """Sum of the squared residuals, plus ANCHOR times the squared displacement to uv (k,2) in the metric."""
        residual = self.residual(uv)
        return float(residual @ residual + self.pull(uv) @ (uv - self.unfolded.uv).ravel())

    def step(self, uv: np.ndarray, damping: float, order: np.ndarray) -> np.ndarray:
        """Damped Gauss-Newton step (k,2) from uv (k,2), 0 where coordinates are fixed.

        damping: in units of the metric; order: elimination order of the free coordinates.
        Raises PrecisionError.
        """
        p = self.unfolded.with_points(uv).corners()[self.triangles]
        opposite = np.roll(p, -1, axis=1) - np.roll(p, 1, axis=1)
        slope = 0.5 * self.sign[..., None] * np.stack([opposite[..., 1], -opposite[..., 0]], axis=-1)
        total = 0.5 * cross2(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]).sum()
        slope *= (self.scale / total)[:, None, None]
        columns = 2 * self.index[..., None] + np.arange(2)
        rows = np.repeat(np.arange(len(p)), 6)
        J = sp.csr_matrix((slope.ravel(), (rows, columns.ravel())), shape=(len(p), 2 * len(uv)))[:, self.free]
        A = J.T @ J + sp.diags((ANCHOR + damping) * self.metric.ravel()[self.free])
        step = np.zeros(2 * len(uv))
        step[self.free] = -solve_spd(A, J.T @ self.residual(uv) + self.pull(uv)[self.free], order)
        return step.reshape(-1, 2)


def _sphere_metric(unfolded: Unfolding, projection: str) -> np.ndarray:
    """Squared length (k,2) on the unit sphere of the unit directions at the points of an unfolding.

    For the octahedron, where it is nearly the same in all directions, the one that keeps the area.
    """
    if not is_cylindrical(projection):
        return np.full(unfolded.uv.shape, 4 * np.pi)
    inner = np.sort(unfolded.uv[~unfolded.poles, 1])
    # A pole's own row has no width at all; its neighbours' is the least that means anything.
    v = np.clip(unfolded.uv[:, 1], inner[2], inner[-3])
    if projection == EQUIRECT:
        return np.column_stack([(2 * np.pi * np.sin(np.pi * v)) ** 2, np.full(len(v), np.pi**2)])
    r = 2 * np.sqrt(v * (1 - v))
    return np.column_stack([(2 * np.pi * r) ** 2, (2 / r) ** 2])


def _grid_cells(n: int) -> np.ndarray:
    """Barycentric centres (n^2,3) of the equal triangles that n cuts along each side make of one."""
    up = [(3 * i + 1, 3 * j + 1) for i in range(n) for j in range(n - i)]
    down = [(3 * i + 2, 3 * j + 2) for i in range(n - 1) for j in range(n - 1 - i)]
    ij = np.array(up + down) / (3 * n)
    return np.column_stack([ij, 1 - ij.sum(axis=1)])


_CELLS = _grid_cells(4)
