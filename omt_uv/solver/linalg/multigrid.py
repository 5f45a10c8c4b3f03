"""Solve Laplacians by conjugate gradients, preconditioned by smoothed aggregation (Vanek, Mandel, Brezina 1996).

Unknowns lie at points, and eight that follow each other in the order of a kd-tree make one of the next level. No
factorisation but that of the coarsest level is needed, so that time and memory grow with the number of unknowns.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
import scipy.sparse as sp

from .sparse import Factor, gradient_steps, solve_spd

# Unknowns of a level that make one of the next.
BLOCK = 8
# Up to this many unknowns are factored.
COARSEST = 1000
# Damping of Jacobi's method: 4/3 over the largest eigenvalue of D^-1 A, which is at most 2.
DAMPING = 2 / 3
# Cycles at most; the matrix is factored where these are not enough.
MOST = 200
# A hierarchy of an older matrix serves while it takes at most so many times the cycles it took for its own.
SLOWER = 1.5


class Multigrid:
    """A preconditioner for the Laplacian (n,n) of a connected graph with positive weights; its kernel are constants.

    The unknowns are numbered along a kd-tree over their points, `cKDTree(points).indices`.
    """

    def __init__(self, A: sp.csr_matrix):
        self._levels = []
        while A.shape[0] > COARSEST:
            n = A.shape[0]
            coarse = -(-n // BLOCK)
            # As the tree does, to halve the range is to halve the points.
            block = np.arange(n) * coarse // n
            jump = sp.csr_matrix((np.ones(n), block, np.arange(n + 1)), shape=(n, coarse))
            smoother = DAMPING / A.diagonal()
            prolong = (jump - sp.diags(smoother) @ (A @ jump)).tocsr()
            restrict = prolong.T.tocsr()
            self._levels.append((A, smoother, prolong, restrict))
            A = (restrict @ (A @ prolong)).tocsr()
        self._coarsest = Factor(A[1:, 1:])

    def cycle(self, b: np.ndarray, level: int = 0) -> np.ndarray:
        """One V-cycle for A x = b (n,), with a sweep of Jacobi's method before and after, so that it is symmetric."""
        if level == len(self._levels):
            return np.concatenate([[0.0], self._coarsest.solve(b[1:])])
        A, smoother, prolong, restrict = self._levels[level]
        x = smoother * b
        x += prolong @ self.cycle(restrict @ (b - A @ x), level + 1)
        return x + smoother * (b - A @ x)


class LaplacianSolver:
    """Solves with one Laplacian after the other, each a little different: a hierarchy serves until it is slow."""

    def __init__(self):
        # The hierarchy that serves, and with how many cycles it still does.
        self._serving: tuple[Multigrid, float] | None = None

    def solve(self, A: sp.csr_matrix, b: np.ndarray, scale: np.ndarray, tolerance: float) -> np.ndarray:
        """Solve A x = b (n,), A and its unknowns as in `Multigrid`; the mean of x is 0.

        Ends at max(|b - A x| / scale) <= tolerance max(|b| / scale), scale (n,) > 0. Raises PrecisionError.
        """
        hierarchy, most = self._serving or (Multigrid(A), None)
        x, cycles = _by_gradients(A, b - b.mean(), scale, tolerance, hierarchy)
        most = SLOWER * cycles if most is None else most
        self._serving = (hierarchy, most) if cycles <= most else None
        return x - x.mean()


def _by_gradients(A, b, scale, tolerance, hierarchy: Multigrid) -> tuple[np.ndarray, int]:
    """Conjugate gradients: the solution and the number of cycles. Where they do not converge, A is factored."""
    enough = tolerance * np.abs(b / scale).max()
    for cycles, (x, residual, _) in enumerate(islice(gradient_steps(A, b, hierarchy.cycle), MOST)):
        if np.abs(residual / scale).max() <= enough:
            return x, cycles
    return np.concatenate([[0.0], solve_spd(A[1:, 1:], b[1:])]), MOST
