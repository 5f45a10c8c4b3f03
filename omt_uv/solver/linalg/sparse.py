"""Factor and solve sparse systems, by SuperLU or conjugate gradients.

Factors are SuperLU's (scipy). Orders: "mmd" (minimum degree on A + A^T) has the least fill, but takes
long on large meshes and on several unknowns a vertex; "colamd" does not; a permutation array brings an order from
outside: `minimum_degree` of the vertices' graph, for any number of unknowns a vertex and any number of factors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spilu, splu

from ..errors import PrecisionError

# Below this many unknowns minimum degree is the faster order of the two.
SMALL = 50_000
# Columns of SuperLU's panels where there are few unknowns; beyond, its own default is as fast.
PANEL = 1
# Columns at most that SuperLU takes for one block though their rows differ. Without any, factors of meshes take a third
# less time on thousands of unknowns, and on some meshes a fifth.
RELAX = 1
# Up to this many unknowns are few: factors of scanned bodies take a quarter less time, those of a square as much.
FEW = 110_000
# From this many on every pattern has an order of its own.
MANY = 50_000
# An order has lost its use where factors have more than so many times the least entries there were.
FILLED = 1.2
# What drops all that would be filled in.
ONLY_ORDERED = {"permc_spec": "MMD_AT_PLUS_A", "drop_tol": 1.0, "fill_factor": 1, "diag_pivot_thresh": 0.0}
# Names of elimination orders, and SuperLU's for them.
_ORDERS = {"mmd": "MMD_AT_PLUS_A", "colamd": "COLAMD", "natural": "NATURAL"}


class Factor:
    """Sparse factors of a square matrix, kept for any number of solves.

    Parameters
    ----------
    A : (n,n) sparse matrix
    order : None (chosen by size), "mmd", "colamd", "natural" (as they come), or a permutation (n,), `order[k]` the
        k-th unknown to eliminate
    spd : True when A is symmetric positive definite, False for unsymmetric diagonally dominant systems
    single : in single precision, which takes a fifth less time and half of the memory: to precondition by

    Raises
    ------
    PrecisionError : the matrix is singular in double precision
    """

    def __init__(self, A: sp.spmatrix, order: str | np.ndarray | None = None, spd: bool = True, single: bool = False):
        self._type = np.float32 if single else np.float64
        # To wrap a small matrix once more takes a fiftieth of the time of its factors.
        A = A if isinstance(A, sp.csc_matrix) and A.dtype == self._type else sp.csc_matrix(A, dtype=self._type)
        if order is None:
            order = "mmd" if spd and A.shape[0] < SMALL else "colamd"
        self._permutation = None
        spec = _ORDERS[order] if isinstance(order, str) else "NATURAL"
        if not isinstance(order, str):
            self._permutation = np.asarray(order)
            A = A[self._permutation][:, self._permutation].tocsc()
        try:
            self._lu = _splu(A, spec)
        except RuntimeError as error:
            raise PrecisionError("A linear system is singular in double precision") from error

    @property
    def entries(self) -> int:
        """How many entries the factors have."""
        return int(self._lu.nnz)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solution of A x = b for b (n,) or (n,k)."""
        p = self._permutation
        if p is None:
            x = self._lu.solve(np.ascontiguousarray(b, dtype=self._type)).astype(float, copy=False)
        else:
            x = np.zeros(b.shape)
            x[p] = self._lu.solve(np.ascontiguousarray(b, dtype=self._type)[p])
        if not np.isfinite(x).all():
            raise PrecisionError("A linear system is singular in double precision")
        return x


class FillOrder:
    """Order in which unknowns, two a vertex, of matrices are eliminated whose patterns change from one to the next.

    Where vertices come near to each other and part again, entries come and go that no order of their mesh foresees, and
    factors fill. Then an order is found anew: it takes a third of the time of the factors that it saves. Of many
    unknowns it takes a sixth of the time of factors, and one entry more can fill these by half: there each pattern has
    an order of its own.

    order : of the first matrices, see `Factor`
    """

    def __init__(self, order: str | np.ndarray = "natural"):
        self.order, self._least = order, np.inf
        self._rows: np.ndarray | None = None

    def factor(self, A: sp.spmatrix) -> Factor:
        """Factors of A (2n,2n), symmetric positive definite. Raises PrecisionError.

        >>> FillOrder().factor(sp.identity(4, format="csc")).solve(np.ones(4))
        array([1., 1., 1., 1.])
        """
        if A.shape[0] >= MANY:
            A = sp.csc_matrix(A)
            if self._rows is not None and not np.array_equal(A.indices, self._rows):
                self._find(A)
            self._rows = A.indices
            return Factor(A, self.order)
        factor = Factor(A, self.order)
        if factor.entries > FILLED * self._least:
            self._find(A)
        else:
            self._least = min(self._least, factor.entries)
        return factor

    def _find(self, A: sp.spmatrix) -> None:
        """Find an order for the pattern of A (2n,2n)."""
        vertices = minimum_degree(sp.csc_matrix(A)[::2, ::2])
        self.order, self._least = (2 * vertices[:, None] + np.arange(2)).ravel(), np.inf


def solve_spd(A: sp.spmatrix, b: np.ndarray, order: str | np.ndarray | None = None) -> np.ndarray:
    """Solve A x = b with A symmetric positive definite; b (n,) or (n,k). Raises PrecisionError."""
    return Factor(A, order).solve(b)


def solve_general(A: sp.spmatrix, b: np.ndarray, order: str | np.ndarray = "colamd") -> np.ndarray:
    """Solve A x = b, A unsymmetric but diagonally dominant (Tutte systems); b (n,) or (n,k). Raises PrecisionError."""
    return Factor(A, order, spd=False).solve(b)


def gradient_steps(
    A: sp.spmatrix, b: np.ndarray, precondition: Callable[[np.ndarray], np.ndarray], overwrite: bool = False
) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Iterates of preconditioned conjugate gradients for A x = b (n,), A symmetric positive definite.

    Each is x (n,), the residual b - A x (n,), and how far x.A.x / 2 - b.x has fallen, times two; x and the residual are
    overwritten by the next. Ends where the residual leads nowhere any more, to the precision of the preconditioner.
    overwrite: b becomes the residual, which for large meshes takes the memory of a map.
    """
    x, residual, direction = np.zeros(len(b)), b if overwrite else b.copy(), np.zeros(len(b))
    power, fallen = 1.0, 0.0
    while True:
        yield x, residual, fallen
        z = precondition(residual)
        power, before = residual @ z, power
        if power <= 0:
            return
        direction *= power / before
        direction += z
        del z
        image = A @ direction
        step = power / (direction @ image)
        x += step * direction
        image *= step
        residual -= image
        # Of large meshes it takes the memory of a map.
        del image
        fallen += step * power


def solve_conjugate_gradients(A: sp.spmatrix, b: np.ndarray, tolerance: float = 1e-6, most: int = 200) -> np.ndarray:
    """Solve A x = b (n,) by conjugate gradients, A symmetric positive definite and close to its diagonal."""
    return conjugate_gradients(lambda x: A @ x, b, sp.diags(1 / A.diagonal()), tolerance, most)


def conjugate_gradients(
    times: Callable[[np.ndarray], np.ndarray], b: np.ndarray, inverse: sp.spmatrix, tolerance: float, most: int = 200
) -> np.ndarray:
    """Solve A x = b (n,) by conjugate gradients, A symmetric positive definite, given by `times`, x to A x, and close
    to the matrix with this `inverse`."""
    # scipy's own takes as long again for its checks of every product of small systems.
    x, residual = np.zeros(len(b)), np.array(b, float)
    goal = tolerance * np.linalg.norm(residual)
    if goal == 0:
        return x
    direction, power = np.zeros(len(b)), np.inf
    for _ in range(most):
        z = inverse @ residual
        power, before = residual @ z, power
        direction = z + (power / before) * direction
        image = times(direction)
        step = power / (direction @ image)
        x += step * direction
        residual -= step * image
        if np.linalg.norm(residual) <= goal:
            break
    return x


def minimum_degree(A: sp.spmatrix) -> np.ndarray:
    """Elimination order of least fill, (n,), `order[k]` the k-th unknown to eliminate, of a symmetric pattern.

    Ordering takes longer than factoring: compute it once on the graph of the vertices, not on their coordinates.
    """
    # SuperLU orders only what it factors, too; what is incomplete takes half of the time.
    factors = spilu(_dominant(A), **ONLY_ORDERED, panel_size=PANEL, relax=RELAX, options={"SymmetricMode": True})
    return np.argsort(factors.perm_c)


def fill(A: sp.spmatrix) -> int:
    """Entries of the lower factor of a symmetric pattern (n,n) whose unknowns are eliminated as they come."""
    # Both factors have as many; to take one out of SuperLU takes as long again as to find it, and as much memory.
    # Both factors have as many; to take one out of SuperLU takes as long as to find it, and as much memory.
    return Factor(_dominant(A), "natural", single=True).entries // 2


def _dominant(A: sp.spmatrix) -> sp.spmatrix:
    """A positive definite matrix of this pattern."""
    A = sp.csc_matrix(A)
    degree = np.diff(A.indptr)
    data, own = np.full(A.nnz, -1.0), A.indices == np.repeat(np.arange(A.shape[1]), degree)
    found = sp.csc_matrix((data, A.indices, A.indptr), shape=A.shape)
    if np.count_nonzero(own) < A.shape[0]:
        return found + sp.diags(3.0 + degree)
    data[own] += 3.0 + degree
    return found


def _splu(A: sp.spmatrix, spec: str):
    """SuperLU's factors in an order of its own (`spec`), without pivoting."""
    # No larger panels and no more relaxation than SuperLU's own: it sizes work arrays by its defaults.
    given = {"panel_size": PANEL if A.shape[0] <= FEW else None, "relax": RELAX, "options": {"SymmetricMode": True}}
    return splu(A, permc_spec=spec, diag_pivot_thresh=0.0, **given)
