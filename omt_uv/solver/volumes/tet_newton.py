"""Map tetrahedra by Newton's method: untangled first, then with volumes in stages of growing weight.

Volumes of single tetrahedra cannot all be right by the places in the domain alone: there are more of them than
unknowns. `tet_exact` does the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import cg

from ..errors import TetrahedraError, plural
from ..progress import Progress, Steps
from .domains import Domain, HeldDomain
from .meshing import TetMesh, split_inside
from .tet_energy import RestShape, TetAssembly, rest_shape, tet_energy
from .tet_mesh import tet_volumes

# Steps that untangle; eps of the first, its factor from step to step, that after a step that failed, and its least.
UNTANGLING = 80
FIRST_EPS = 0.3
EPS_FACTOR = 0.75
EPS_BACK = 12.0
LEAST_EPS = 2e-3
# Rounds of steps with edges split between them, the steps of each, and rounds in a row with no fewer inverted.
SPLITTING = 24
ROUND_STEPS = 20
SPLIT_PATIENCE = 4
# Volumes of slivers are taken for this share of the mean while untangling, and then.
COARSE = 0.1
FINE = 0.01
# Weights of the volumes, and the steps at each.
STAGES = ((1.0, 2), (10.0, 4), (100.0, 3))
# The same where what was tangled had to be given room: it starts far from the shape of the body.
LONG_STAGES = ((1.0, 30), (10.0, 20), (100.0, 20))
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
    domain: Domain
    assembly: TetAssembly
    coarse: RestShape
    fine: RestShape
    count: int


def tet_problem(points: np.ndarray, tets: np.ndarray, domain: Domain) -> TetProblem:
    """What is to be solved for tetrahedra (m,4) of points (n,3)."""
    inside = np.ones(len(points), bool)
    inside[domain.boundary] = False
    b = len(domain.boundary)
    unknown = np.full((len(points), 3), -1, np.int64)
    free = domain.sliding
    unknown[domain.boundary, :free] = np.arange(free * b).reshape(b, free)
    unknown[inside] = free * b + np.arange(3 * int(inside.sum())).reshape(-1, 3)
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
    points = yield from _untangling(problem, points, UNTANGLING, FIRST_EPS)
    _without_inverted(points, problem.tets)
    return points


def unlocked(mesh: TetMesh, positions: np.ndarray, count: int) -> Steps[tuple[TetMesh, np.ndarray]]:
    """A finer mesh and positions (n,3) of it with no tetrahedron inverted, the first `count`, its boundary, held.

    Edges in a fixed number may leave no room for all tetrahedra, and a boundary that slides may fold over. Where
    steps get no further, edges inside of what is inverted are split, which leaves more room than there was.

    Raises
    ------
    TetrahedraError : some remain
    """
    edge, best, idle, eps = HeldDomain(np.arange(count)), len(mesh.tets), 0, FIRST_EPS
    for k in range(SPLITTING):
        yield Progress("Untangling", k / SPLITTING)
        problem = tet_problem(mesh.points, mesh.tets, edge)
        positions = yield from _untangling(problem, positions, ROUND_STEPS, eps)
        wrong = ~(tet_volumes(positions, mesh.tets) > 0)
        left = int(wrong.sum())
        idle = idle + 1 if left >= best else 0
        if left == 0 or idle == SPLIT_PATIENCE:
            break
        best = min(best, left)
        mesh, positions = split_inside(mesh, positions, wrong)
        eps = LEAST_EPS * EPS_BACK
    _without_inverted(positions, mesh.tets)
    return mesh, positions


def _untangling(problem: TetProblem, points: np.ndarray, most: int, eps: float) -> Steps[np.ndarray]:
    """Points (n,3) after at most so many steps, the first of which is with `eps`; none once nothing is inverted."""
    even = np.full(len(problem.tets), 1 / len(problem.tets))
    shape = replace(problem.coarse, weight=(problem.coarse.weight + even) / 2)
    for k in range(most):
        if inverted(points, problem.tets) == 0:
            break
        yield Progress("Untangling", k / most)
        size = float(tet_volumes(points, problem.tets).sum())
        points, fall = _step(problem, shape, points, _Terms(size, 1.0, eps))
        # Where no step helps, a softer energy may.
        eps = max(eps * EPS_FACTOR, LEAST_EPS) if fall > 0 else min(eps * EPS_BACK, FIRST_EPS)
    return points


def _without_inverted(points: np.ndarray, tets: np.ndarray) -> None:
    """Refuse points (n,3) at which some of tetrahedra (m,4) are inverted."""
    count = inverted(points, tets)
    if count:
        raise TetrahedraError(f"{count} of {len(tets)} tetrahedra {plural(count, 'stays', 'stay')} inverted in the map")


def refined(problem: TetProblem, points: np.ndarray, stages=STAGES) -> Steps[tuple[np.ndarray, int]]:
    """Points (n,3) with volumes nearer to what they should be, and the steps; nothing is inverted. `stages` are pairs
    of a weight of the volumes and the most steps with it."""
    steps, total = 0, sum(most for _, most in stages)
    for weight, most in stages:
        for _ in range(most):
            yield Progress("Volumes", steps / total)
            size = float(tet_volumes(points, problem.tets).sum())
            points, fall = _step(problem, problem.fine, points, _Terms(size, weight))
            steps += 1
            if fall < ENOUGH:
                break
    return points, steps


@dataclass(frozen=True)
class _Terms:
    """Volume of the domain, weight of volumes, eps."""

    size: float
    weight: float
    eps: float = 0.0


def _step(problem: TetProblem, shape: RestShape, points: np.ndarray, terms: _Terms) -> tuple[np.ndarray, float]:
    """Points (n,3) after a line-searched Newton step, and the predicted decrease over the energy."""
    energy = tet_energy(shape, terms.size, terms.weight, terms.eps)
    frames = problem.domain.frames(points)
    slope, blocks = energy.derivatives(points, frames)
    gradient = problem.assembly.vector(slope, frames)
    direction = _solved(problem, blocks, slope, points, gradient)
    move = problem.assembly.spread(direction, frames)
    fall = -float(gradient @ direction)
    here, share = energy.value(points), 1.0
    for _ in range(HALVINGS):
        trial = problem.domain.retract(points + share * move)
        if energy.value(trial) <= here - ARMIJO * share * fall:
            return trial, fall / max(abs(here), 1e-300)
        share /= 2
    return points, 0.0


def _solved(problem, blocks, slope, points, gradient) -> np.ndarray:
    """The Newton direction (u,), by conjugate gradients."""
    matrix = problem.assembly.matrix(blocks)
    bend = np.zeros(problem.assembly.size)
    edge = problem.assembly.unknown[problem.domain.boundary, : problem.domain.sliding]
    bend[edge] = problem.domain.bending(slope, points)[:, None]
    matrix = matrix + sp.diags(bend)
    x, _ = cg(matrix, -gradient, rtol=RESIDUAL, maxiter=MOST_ITERATIONS, M=sp.diags(1 / matrix.diagonal()))
    return x
