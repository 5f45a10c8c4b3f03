"""The one place that factors and solves sparse systems.

Factors are SuperLU's (scipy). Orders: "mmd" (minimum degree on A + A^T) has the least fill on small
meshes, "colamd" is the faster of the two on large ones, and a permutation array brings an order
from outside, for example `nested_dissection` of the mesh (George 1973).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from .errors import PrecisionError

# Below this many unknowns minimum degree is the faster order of the two.
SMALL = 20_000
_ORDERS = {"mmd": "MMD_AT_PLUS_A", "colamd": "COLAMD", "natural": "NATURAL"}


class Factor:
    """Sparse factors of a square matrix, kept for any number of solves.

    Parameters
    ----------
    A : (n,n) sparse matrix
    order : None (chosen by size), "mmd", "colamd", "natural" (as they come), or (n,) permutation, `order[k]` the k-th unknown to eliminate
    spd : True when A is symmetric positive definite, False for unsymmetric diagonally dominant systems

    Raises
    ------
    PrecisionError : the matrix is singular in double precision
    """

    def __init__(self, A: sp.spmatrix, order: str | np.ndarray | None = None, spd: bool = True):
        A = sp.csc_matrix(A)
        if order is None:
            order = "mmd" if spd and A.shape[0] < SMALL else "colamd"
        self._permutation = None
        spec = _ORDERS[order] if isinstance(order, str) else "NATURAL"
        if not isinstance(order, str):
            self._permutation = np.asarray(order)
            A = A[self._permutation][:, self._permutation].tocsc()
        try:
            self._lu = splu(A, permc_spec=spec, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise PrecisionError("A linear system is singular in double precision") from error

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solution of A x = b for b (n,) or (n,k)."""
        p = self._permutation
        if p is None:
            x = self._lu.solve(np.ascontiguousarray(b, dtype=float))
        else:
            x = np.zeros(b.shape)
            x[p] = self._lu.solve(np.ascontiguousarray(b, dtype=float)[p])
        if not np.isfinite(x).all():
            raise PrecisionError("A linear system is singular in double precision")
        return x


def solve_spd(A: sp.spmatrix, b: np.ndarray, order: str | np.ndarray | None = None) -> np.ndarray:
    """Solve A x = b with A symmetric positive definite; b (n,) or (n,k). Raises PrecisionError."""
    return Factor(A, order).solve(b)


def solve_general(A: sp.spmatrix, b: np.ndarray) -> np.ndarray:
    """Solve A x = b with A unsymmetric but diagonally dominant (Tutte systems); b (n,) or (n,k). Raises PrecisionError."""
    return Factor(A, "colamd", spd=False).solve(b)


def minimum_degree(A: sp.spmatrix) -> np.ndarray:
    """Elimination order of least fill, (n,), `order[k]` the k-th unknown to eliminate; only A's symmetric pattern counts.

    Ordering takes longer than factoring: compute it once on the graph of the vertices, not on their coordinates.
    """
    A = sp.csc_matrix(A)
    degree = np.diff(A.indptr)
    dominant = sp.csc_matrix((np.full(A.nnz, -1.0), A.indices, A.indptr), shape=A.shape) + sp.diags(3.0 + degree)
    lu = splu(sp.csc_matrix(dominant), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.argsort(lu.perm_c)


def nested_dissection(A: sp.spmatrix, points: np.ndarray, leaf: int = 64) -> np.ndarray:
    """Elimination order by recursive bisection of embedded unknowns, all parts of a level at once.

    Parameters
    ----------
    A : (n,n) sparse matrix, of which only the pattern is read
    points : (n,d) positions of the unknowns, in 2D or 3D; neighbours should be near each other
    leaf : parts of at most this many unknowns are not cut any more

    Returns
    -------
    (n,) permutation, `order[k]` the k-th unknown to eliminate

    References
    ----------
    George 1973, "Nested dissection of a regular finite element mesh".
    """
    n = len(points)
    graph = sp.coo_matrix(A)
    below = graph.row < graph.col
    a, b = graph.row[below].astype(np.int64), graph.col[below].astype(np.int64)
    part, free = np.zeros(n, np.int64), np.ones(n, bool)
    # Keys sort a separator behind both parts it separates; three values per level: left, right, separator.
    levels = max(int(np.ceil(np.log2(max(n / leaf, 1)))), 0)
    key = np.zeros(n, np.int64)
    for level in range(levels):
        side = _halves(points, part, free)
        cut = free[a] & free[b] & (part[a] == part[b]) & (side[a] != side[b])
        separator = np.zeros(n, bool)
        separator[np.where(side[a[cut]] == 0, a[cut], b[cut])] = True
        key += np.where(free, np.where(separator, 2, side), 0) * 3 ** (levels - 1 - level)
        part = 2 * part + side
        free &= ~separator
    return np.argsort(key, kind="stable")


def _halves(points: np.ndarray, part: np.ndarray, free: np.ndarray) -> np.ndarray:
    """0 or 1 per point: the half of its part, cut at the median of the axis of the largest spread."""
    count = np.maximum(np.bincount(part, free), 1)
    mean = np.stack([np.bincount(part, free * x) / count for x in points.T])
    spread = np.stack([np.bincount(part, free * (x - m[part]) ** 2) for x, m in zip(points.T, mean, strict=True)])
    coordinate = np.take_along_axis(points, spread.argmax(0)[part][:, None], axis=1)[:, 0]
    index = np.nonzero(free)[0]
    index = index[np.lexsort((coordinate[index], part[index]))]
    size = np.bincount(part[index], minlength=len(count))
    rank = np.arange(len(index)) - (np.cumsum(size) - size)[part[index]]
    side = np.zeros(len(points), np.int64)
    side[index] = rank >= size[part[index]] // 2
    return side
