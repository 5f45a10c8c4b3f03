"""Make the volume of every tetrahedron right, in the body and in the domain at once.

There are more tetrahedra than unknowns in the domain alone. But the points inside the body are nobody's: where they lie
is as free as where they go, and with both free every tetrahedron can be met. Each round solves linear least squares for
relative errors of volume, damped by the strain of either mesh, as Levenberg and Marquardt do; weights from round to
round turn squares into absolute values. A sliver is as stiff as any other tetrahedron, so that no few of them stop all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from ..progress import Progress, Steps
from .domains import Domain
from .tet_mesh import EDGES, gradients, graph_laplacian, tet_volumes, volume_gradients

# Rounds, and those in a row that gain less than this share of the error and end them.
ROUNDS = 40
ENOUGH = 0.01
PATIENCE = 3
# Damping at first, its factors after rounds that went as foreseen, that did not, and that failed, and its range.
DAMPING = 0.01
GOOD = 0.25
POOR = 4.0
FAILED = 10.0
LEAST = 1e-6
MOST = 1e3
# Of the foreseen decrease, what a good round has.
FORESEEN = 0.7
# Stiffness of a tetrahedron besides its share, over the mean of shares.
EVEN = 3.0
# Errors are relative to shares of at least this, over their mean, and count as absolute values beyond this share of
# their sum.
SMALLEST = 0.05
ABSOLUTE = 0.25
# What is left at least of a tetrahedron after a round, and halvings around those that have less.
KEPT = 0.1
HALVINGS = 16
# Of conjugate gradients.
RESIDUAL = 0.02
ITERATIONS = 200


@dataclass(frozen=True)
class ExactVolumes:
    """Points (n,3) in the body, positions (n,3) in the domain, and rounds."""

    points: np.ndarray
    positions: np.ndarray
    rounds: int


@dataclass(frozen=True)
class _Both:
    """A mesh in two places: points and positions (n,3), volumes (m,) there as shares of the whole."""

    tets: np.ndarray
    points: np.ndarray
    positions: np.ndarray
    here: np.ndarray
    there: np.ndarray

    @property
    def off(self) -> np.ndarray:
        """What shares (m,) are off."""
        return self.there - self.here


def exact_volumes(
    points: np.ndarray,
    tets: np.ndarray,
    positions: np.ndarray,
    domain: Domain,
    tolerance: float,
    slide: bool = True,
) -> Steps[ExactVolumes]:
    """Move positions (n,3) of tetrahedra (m,4) in a domain and, with `slide`, points (n,3) inside the body, until the
    sum of abs(share of the volume there - here) is below `tolerance`, or no longer falls. Nothing is inverted."""
    scale = np.cbrt(tet_volumes(points, tets).sum())
    both = _both(tets, points / scale, positions)
    error, damping, idle, rounds = float(np.abs(both.off).sum()), DAMPING, 0, 0
    while error > tolerance and idle < PATIENCE and rounds < ROUNDS and damping < MOST:
        yield Progress("Volumes of tetrahedra", rounds / ROUNDS)
        rounds += 1
        found, good = _round(both, domain, damping, slide)
        if found is None:
            damping *= FAILED
            continue
        damping = max(damping * (GOOD if good else POOR), LEAST)
        before, error = error, float(np.abs(found.off).sum())
        idle = idle + 1 if error > (1 - ENOUGH) * before else 0
        both = found
    inside = np.full(len(points), slide)
    inside[domain.boundary] = False
    moved = points.copy()
    moved[inside] = both.points[inside] * scale
    return ExactVolumes(moved, both.positions, rounds)


def _both(tets: np.ndarray, points: np.ndarray, positions: np.ndarray) -> _Both:
    """The mesh with its volumes; points (n,3) enclose the volume 1."""
    there = tet_volumes(positions, tets)
    return _Both(tets, points, positions, tet_volumes(points, tets), there / there.sum())


def _round(both: _Both, domain: Domain, damping: float, slide: bool) -> tuple[_Both | None, bool]:
    """The mesh after a step, None if there is none, and whether it went as foreseen."""
    n, m = len(both.points), len(both.tets)
    share = np.maximum(both.here, SMALLEST / m)
    relative = np.abs(both.off) / share
    sum_off = np.abs(both.off).sum()
    weight = 1 / np.sqrt(share * np.maximum(relative / sum_off, ABSOLUTE))
    size = tet_volumes(both.positions, both.tets).sum()
    rows = [_volume_rows(both.positions, both.tets, weight / size)]
    stiff = [_strain(both.positions, both.tets, both.here)]
    if slide:
        rows.append(_volume_rows(both.points, both.tets, -weight))
        stiff.append(_strain(both.points, both.tets, both.here))
    matrix = sp.hstack(rows, format="csr")
    tangent = domain.frames(both.positions)[domain.boundary][:, :, : domain.sliding]
    along = tangent @ np.swapaxes(tangent, 1, 2)

    def allowed(x: np.ndarray) -> np.ndarray:
        """Of moves only what the boundary lets happen: along the domain's, none of the body's."""
        moves = x.reshape(len(rows), n, 3).copy()
        moves[0, domain.boundary] = np.einsum("bij,bj->bi", along, moves[0, domain.boundary])
        moves[1:, domain.boundary] = 0.0
        return moves

    def times(x: np.ndarray) -> np.ndarray:
        strain = np.stack([K @ y for K, y in zip(stiff, x.reshape(-1, n, 3), strict=True)]).ravel()
        return allowed(matrix.T @ (matrix @ x) + damping * strain).ravel()

    # The same for the three axes of a vertex, so that what is allowed stays so.
    diagonal = np.asarray(matrix.multiply(matrix).sum(axis=0)).reshape(-1, 3).mean(axis=1)
    diagonal += damping * np.concatenate([K.diagonal() for K in stiff])
    inverse = np.repeat(1 / diagonal, 3)
    shape, off = (matrix.shape[1],) * 2, weight * both.off
    x, _ = cg(
        LinearOperator(shape, matvec=times, dtype=float),
        -allowed(matrix.T @ off).ravel(),
        rtol=RESIDUAL,
        maxiter=ITERATIONS,
        M=sp.diags(inverse),
    )
    now, foreseen = float(off @ off), float(np.square(off + matrix @ x).sum())
    found = _without_inversion(both, domain, allowed(x), lambda other: float(np.square(weight * other.off).sum()) < now)
    if found is None:
        return None, False
    return found, float(np.square(weight * found.off).sum()) < now - FORESEEN * (now - foreseen)


def _without_inversion(both: _Both, domain, moves: np.ndarray, better) -> _Both | None:
    """The mesh after moves (1 or 2,n,3), those around tetrahedra that would lose too much halved, if it is `better`."""
    part = np.ones((len(both.points), 1))
    for _ in range(HALVINGS):
        points = both.points if len(moves) == 1 else both.points + part * moves[1]
        trial = _both(both.tets, points, domain.retract(both.positions + part * moves[0]))
        lost = ~((trial.here > KEPT * both.here) & (trial.there > KEPT * both.there))
        if lost.any():
            part[both.tets[lost]] *= 0.5
        elif better(trial):
            return trial
        else:
            part *= 0.5
    return None


def _volume_rows(points: np.ndarray, tets: np.ndarray, weight: np.ndarray) -> sp.csr_matrix:
    """Derivatives (m,3n) of the volumes of tetrahedra (m,4), times weights (m,), by the points (n,3)."""
    values = volume_gradients(points, tets) * weight[:, None, None]
    columns = 3 * tets[:, :, None] + np.arange(3)
    shape = (len(tets), points.size)
    return sp.csr_matrix((values.ravel(), columns.ravel(), np.arange(len(tets) + 1) * 12), shape=shape)


def _strain(points: np.ndarray, tets: np.ndarray, share: np.ndarray) -> sp.csr_matrix:
    """The matrix (n,n) of the squared gradients of a function at points (n,3), by the shares (m,) of tetrahedra."""
    b = gradients(points, tets)
    along = np.einsum("mei,mei->me", b[:, EDGES[:, 0]], b[:, EDGES[:, 1]])
    return sp.csr_matrix(graph_laplacian(tets, -along * (share + EVEN / len(tets))[:, None], len(points)))
