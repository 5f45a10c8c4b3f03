"""Map tetrahedra by Newton's method: untangled first, then with volumes in stages of growing weight.

Volumes of single tetrahedra cannot all be right: there are more of them than unknowns. Those around vertices can, and
are what is made exact at the end, by an augmented Lagrangian (Hestenes 1969) whose multipliers are pressures at
vertices, as the nodal pressures of Bonet and Burton (1998).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from ..errors import TetrahedraError
from ..progress import Progress, Steps
from .domains import BallDomain, CubeDomain
from .tet_energy import RestShape, TetAssembly, rest_shape, tet_energy
from .tet_mesh import around_vertices, tet_volumes, vertex_share_error, volume_gradients

# Steps that untangle; eps of the first, its factor from step to step, that after a step that failed, and its least.
UNTANGLING = 80
FIRST_EPS = 0.3
EPS_FACTOR = 0.75
EPS_BACK = 12.0
LEAST_EPS = 2e-3
# Volumes of slivers are taken for this share of the mean while untangling, and then.
COARSE = 0.1
FINE = 0.01
# Weights of the volumes, and the steps at each.
STAGES = ((1.0, 2), (10.0, 4), (100.0, 3))
# Stiffness of volumes around vertices, over the weight of the last stage, and rounds with more of it.
PRESSURE = 30.0
PRESSURES = 14
# Predicted decrease over the energy at which a stage ends.
ENOUGH = 0.02
# Of conjugate gradients.
RESIDUAL = 0.03
MOST_ITERATIONS = 400
# Halvings of a step.
HALVINGS = 14
ARMIJO = 1e-4


@dataclass(frozen=True)
class TetProblem:
    """Tetrahedra (m,4) with shares (m,) of the volume, a domain, and where blocks go in matrices."""

    tets: np.ndarray
    share: np.ndarray
    domain: BallDomain | CubeDomain
    assembly: TetAssembly
    coarse: RestShape
    fine: RestShape
    count: int

    @cached_property
    def vertex_share(self) -> np.ndarray:
        """Share (n,) of the volume around every vertex."""
        return around_vertices(self.share, self.tets, self.count)


def tet_problem(points: np.ndarray, tets: np.ndarray, domain: BallDomain | CubeDomain) -> TetProblem:
    """What is to be solved for tetrahedra (m,4) of points (n,3)."""
    inside = np.ones(len(points), bool)
    inside[domain.boundary] = False
    b = len(domain.boundary)
    unknown = np.full((len(points), 3), -1, np.int64)
    unknown[domain.boundary, :2] = np.arange(2 * b).reshape(b, 2)
    unknown[inside] = 2 * b + np.arange(3 * int(inside.sum())).reshape(-1, 3)
    volume = tet_volumes(points, tets)
    return TetProblem(
        tets=tets,
        share=volume / volume.sum(),
        domain=domain,
        assembly=TetAssembly(tets, unknown),
        coarse=rest_shape(points, tets, COARSE),
        fine=rest_shape(points, tets, FINE),
        count=len(points),
    )


def inverted(points: np.ndarray, tets: np.ndarray) -> int:
    """How many of tetrahedra (m,4) have no positive volume at points (n,3)."""
    return int((~(tet_volumes(points, tets) > 0)).sum())


def untangled(problem: TetProblem, points: np.ndarray) -> Steps[np.ndarray]:
    """Points (n,3) near the given ones with no tetrahedron inverted (Garanzha et al. 2021).

    Raises
    ------
    TetrahedraError : some remain
    """
    even = np.full(len(problem.tets), 1 / len(problem.tets))
    shape = replace(problem.coarse, weight=(problem.coarse.weight + even) / 2)
    eps = FIRST_EPS
    for k in range(UNTANGLING):
        count = inverted(points, problem.tets)
        if count == 0:
            return points
        yield Progress("Untangling", k / UNTANGLING)
        size = float(tet_volumes(points, problem.tets).sum())
        points, fall = _step(problem, shape, points, _Terms(size, 1.0, eps))
        # Where no step helps, a softer energy may.
        eps = max(eps * EPS_FACTOR, LEAST_EPS) if fall > 0 else min(eps * EPS_BACK, FIRST_EPS)
    count = inverted(points, problem.tets)
    if count:
        raise TetrahedraError(f"{count} of {len(problem.tets)} tetrahedra stay inverted in the map")
    return points


def refined(problem: TetProblem, points: np.ndarray, tolerance: float) -> Steps[tuple[np.ndarray, int]]:
    """Points (n,3) with the volumes around vertices within `tolerance`, the sum of what they are off, and the steps."""
    steps = 0
    total = sum(most for _, most in STAGES) + PRESSURES
    for weight, most in STAGES:
        for _ in range(most):
            yield Progress("Volumes", steps / total)
            size = float(tet_volumes(points, problem.tets).sum())
            points, fall = _step(problem, problem.fine, points, _Terms(size, weight))
            steps += 1
            if fall < ENOUGH:
                break
    pressure, stiff = np.zeros(problem.count), PRESSURE * STAGES[-1][0]
    error = vertex_share_error(points, problem.tets, problem.share)
    for _ in range(PRESSURES):
        if error <= tolerance:
            break
        yield Progress("Volumes", min(steps / total, 1.0))
        size = float(tet_volumes(points, problem.tets).sum())
        terms = _Terms(size, STAGES[-1][0], 0.0, pressure, stiff)
        points, fall = _step(problem, problem.fine, points, terms)
        steps += 1
        before, error = error, vertex_share_error(points, problem.tets, problem.share)
        if fall < ENOUGH or error < 0.5 * before:
            off = _volumes_off(problem, points)
            pressure = pressure + stiff * off / problem.vertex_share
        if error > 0.7 * before:
            stiff *= 3
    return points, steps


@dataclass(frozen=True)
class _Terms:
    """Volume of the domain, weights, eps; multipliers (n,) and stiffness of the volumes around vertices."""

    size: float
    weight: float
    eps: float = 0.0
    pressure: np.ndarray | None = None
    stiffness: float = 0.0


def _volumes_off(problem: TetProblem, points: np.ndarray, size: float = 0.0) -> np.ndarray:
    """Volume (n,) around every vertex as a share of `size`, or of the whole, less what it should be."""
    volume = tet_volumes(points, problem.tets)
    mine = around_vertices(volume, problem.tets, problem.count)
    return mine / (size or volume.sum()) - problem.vertex_share


def _step(problem: TetProblem, shape: RestShape, points: np.ndarray, terms: _Terms) -> tuple[np.ndarray, float]:
    """Points (n,3) after a line-searched Newton step, and the predicted decrease over the energy."""
    energy = tet_energy(shape, terms.size, terms.weight, terms.eps)
    asked = problem.vertex_share

    def value(at: np.ndarray) -> float:
        result = energy.value(at)
        if terms.pressure is not None and np.isfinite(result):
            off = _volumes_off(problem, at, terms.size)
            result += float(terms.pressure @ off + terms.stiffness / 2 * (off**2 / asked).sum())
        return result

    frames = problem.domain.frames(points)
    slope, blocks = energy.derivatives(points, frames)
    rows, springs = None, np.zeros(0)
    if terms.pressure is not None:
        rows = _volume_rows(problem, points, frames, terms.size)
        off = _volumes_off(problem, points, terms.size)
        springs = terms.stiffness / asked
        multiplier = terms.pressure + springs * off
    gradient = problem.assembly.vector(slope, frames)
    if rows is not None:
        gradient = gradient + rows.T @ multiplier
    direction = _solved(problem, blocks, slope, points, gradient, rows, springs)
    move = problem.assembly.spread(direction, frames)
    fall = -float(gradient @ direction)
    here, share = value(points), 1.0
    for _ in range(HALVINGS):
        trial = problem.domain.retract(points + share * move)
        if value(trial) <= here - ARMIJO * share * fall:
            return trial, fall / max(abs(here), 1e-300)
        share /= 2
    return points, 0.0


def _volume_rows(problem: TetProblem, points: np.ndarray, frames: np.ndarray, size: float) -> sp.csr_matrix:
    """Derivatives (n,u) of the volumes around vertices, as shares of `size`, by the unknowns."""
    tets, unknown = problem.tets, problem.assembly.unknown
    along = np.einsum("mai,maij->maj", volume_gradients(points, tets), frames[tets]) / (4 * size)
    shape = (len(tets), 4, 4, 3)
    rows = np.broadcast_to(tets[:, :, None, None], shape).ravel()
    columns = np.broadcast_to(unknown[tets][:, None], shape).ravel()
    values = np.broadcast_to(along[:, None], shape).ravel()
    used = columns >= 0
    matrix = (values[used], (rows[used], columns[used]))
    return sp.csr_matrix(matrix, shape=(problem.count, problem.assembly.size))


def _solved(problem, blocks, slope, points, gradient, rows, springs) -> np.ndarray:
    """The Newton direction (u,), by conjugate gradients."""
    matrix = problem.assembly.matrix(blocks)
    bend = np.zeros(problem.assembly.size)
    bend[problem.assembly.unknown[problem.domain.boundary, :2]] = problem.domain.bending(slope, points)[:, None]
    matrix = matrix + sp.diags(bend)
    diagonal = matrix.diagonal()
    if rows is None:
        times = matrix
    else:
        diagonal = diagonal + rows.multiply(rows).T @ springs
        back = rows.T.tocsr()
        times = LinearOperator(matrix.shape, matvec=lambda x: matrix @ x + back @ (springs * (rows @ x)), dtype=float)
    x, _ = cg(times, -gradient, rtol=RESIDUAL, maxiter=MOST_ITERATIONS, M=sp.diags(1 / diagonal))
    return x
