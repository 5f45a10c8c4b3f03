"""Symmetric matrices of large meshes, two unknowns a vertex, by rows of vertices: colour after colour.

No two vertices of a colour are neighbours, so that a sweep solves for all of them at once (Saad, Iterative methods for
sparse linear systems, section 12.4), and their rows follow each other: nothing is copied for that. Both rows of a
vertex share their columns, which halves what these take.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from ..errors import PrecisionError

# Cells whose pairs of corners are numbered at a time.
AT_ONCE = 100_000


class RowPattern:
    """Where entries are in the rows of matrices of the cells (c_i,k_i), some triangles and some quads, of n vertices.

    order (n,) : vertices by colour, in which all else is numbered; first (colours + 1,) : where each begins
    start (n + 1,), columns (2b,) : of the blocks of each vertex, and the two columns of each block
    own (n,) : the block of each vertex with itself; blocks : (c_i,k_i^2) of the pairs of corners of cells, row by row
    """

    def __init__(self, cells: Sequence[np.ndarray], n: int):
        key = _distinct_keys(cells, n)
        row, column = (x.astype(np.int32) for x in np.divmod(key, n))
        degree = np.bincount(row, minlength=n)
        start = np.cumsum(degree) - degree
        colour = coloured(start, row, column)
        self.order = np.argsort(colour, kind="stable").astype(np.int32)
        place = np.empty(n, np.int32)
        place[self.order] = np.arange(n)
        self.first = np.concatenate([[0], np.cumsum(np.bincount(colour))])
        self.start = np.concatenate([[0], np.cumsum(degree[self.order])]).astype(np.int32)
        moved = (self.start[place[row]] + (np.arange(len(key)) - start[row])).astype(np.int32)
        self.columns = np.empty(2 * len(key), np.int32)
        self.columns.reshape(-1, 2)[moved] = 2 * place[column][:, None] + np.arange(2)
        self.own = moved[row == column][self.order]
        self.blocks = [np.empty((len(c), c.shape[1] ** 2), np.int32) for c in cells]
        for found, some in zip(self.blocks, cells, strict=True):
            for begin in range(0, len(some), AT_ONCE):
                here = slice(begin, begin + AT_ONCE)
                found[here] = moved[np.searchsorted(key, _keys(some[here], n))]

    def rows(self, colour: int) -> slice:
        """Which vertices have a colour."""
        return slice(int(self.first[colour]), int(self.first[colour + 1]))


def coloured(start: np.ndarray, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """Colours (n,) of the vertices of a symmetric graph, no two neighbours of one (Jones, Plassmann 1993).

    start (n,) : the first of the edges from each vertex; tail, head (e,) : of the edges, by tail, each vertex with
    itself among them
    """
    n = len(start)
    rank = np.random.default_rng(0).permutation(n)
    colour, taken = np.full(n, -1), np.zeros(n, np.int64)
    while True:
        left = colour < 0
        if not left.any():
            return colour
        # Its edge to itself stays with every vertex that is left.
        kept = left[tail] & left[head]
        tail, head = tail[kept], head[kept]
        vertex = np.flatnonzero(left)
        begin = np.searchsorted(tail, vertex)
        won = vertex[np.maximum.reduceat(rank[head], begin) == rank[vertex]]
        colour[won] = np.log2(~taken[won] & (taken[won] + 1)).astype(np.int64)
        bit = np.zeros(n, np.int64)
        bit[won] = 1 << colour[won]
        taken[vertex] |= np.bitwise_or.reduceat(bit[head], begin)


class VertexRows:
    """A symmetric matrix (2n,2n) of a pattern; unknowns 2 i and 2 i + 1 are those of the vertex `pattern.order[i]`.

    more : a sparse matrix (2n,2n) to be added, in the numbers of the mesh, or None
    """

    def __init__(self, pattern: RowPattern, data: np.ndarray, more: sp.spmatrix | None = None):
        self.pattern, self._data = pattern, data
        unknowns = (2 * pattern.order[:, None] + np.arange(2, dtype=np.int32)).ravel()
        self._more = None if more is None else more.tocsr()[unknowns][:, unknowns].tocsr()

    @staticmethod
    def summed(pattern: RowPattern, parts: Iterable[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        """The data (2,b,2) of a matrix: by axis of the row, block, and axis of the column.

        parts : the numbers (c,k^2) of some blocks in the pattern and their values (c,2k,2k)
        """
        data = np.zeros((2, len(pattern.columns) // 2, 2))
        seen, number = np.zeros(data.shape[1], bool), np.empty(data.shape[1], np.int32)
        for ids, blocks in parts:
            flat, k = ids.ravel(), blocks.shape[1] // 2
            seen[flat] = True
            touched = np.flatnonzero(seen)
            seen[touched] = False
            number[touched] = np.arange(len(touched))
            local = number[flat].astype(np.intp)
            cells = blocks.reshape(len(blocks), k, 2, k, 2)
            for p in range(2):
                for q in range(2):
                    data[p, touched, q] += np.bincount(local, cells[:, :, p, :, q].ravel(), len(touched))
        return data

    def add_diagonal(self, diagonal: np.ndarray) -> None:
        """Add a diagonal (2n,), in the numbers of the mesh."""
        for p, values in enumerate(diagonal.reshape(-1, 2)[self.pattern.order].T):
            self._data[p, self.pattern.own, p] += values

    @cached_property
    def of_colours(self) -> list[tuple[sp.csr_matrix, sp.csr_matrix]]:
        """The first and the second rows (v,2n) of the vertices of each colour."""
        pattern, found = self.pattern, []
        size = 2 * len(pattern.order)
        for k in range(len(pattern.first) - 1):
            own = pattern.rows(k)
            start = pattern.start[own.start : own.stop + 1]
            here, pointers = slice(2 * start[0], 2 * start[-1]), 2 * (start - start[0])
            both = sp.csr_matrix((len(start) - 1, size)), sp.csr_matrix((len(start) - 1, size))
            for rows, data in zip(both, self._data, strict=True):
                # A matrix that is made of parts of larger arrays copies them.
                rows.data, rows.indices, rows.indptr = data.reshape(-1)[here], pattern.columns[here], pointers
            found.append(both)
        return found

    @cached_property
    def more_of_colours(self) -> list[sp.csr_matrix] | None:
        """What is to be added to the rows (2v,2n) of each colour."""
        if self._more is None:
            return None
        cuts = 2 * self.pattern.first
        return [self._more[a:b] for a, b in pairwise(cuts)]

    def times(self, x: np.ndarray, colour: int) -> np.ndarray:
        """What the rows of a colour make of x (2n,): (v,2)."""
        first, second = self.of_colours[colour]
        found = np.column_stack([first @ x, second @ x])
        return found if self.more_of_colours is None else found + (self.more_of_colours[colour] @ x).reshape(-1, 2)

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        return np.concatenate([self.times(x, k) for k in range(len(self.pattern.first) - 1)]).ravel()

    @cached_property
    def inverse(self) -> np.ndarray:
        """Inverses of the blocks of vertices with themselves, (3,n): entries of both diagonals. Raises PrecisionError.

        What is added to the pattern may join vertices of a colour: their blocks are as much greater as makes sweeps
        converge all the same (Baker, Falgout, Kolev, Yang 2011).
        """
        first, second = (self._data[p, self.pattern.own] for p in range(2))
        xx, xy, yy = first[:, 0].copy(), first[:, 1].copy(), second[:, 1].copy()
        if self._more is not None:
            more = self._more.tocoo()
            row, column = more.row // 2, more.col // 2
            axes = more.row % 2 + more.col % 2
            for k, entry in enumerate((xx, xy, yy)):
                # Entries below the diagonal of a block are those above it.
                here = (row == column) & (axes == k) & (more.row <= more.col)
                entry += np.bincount(row[here], more.data[here], len(entry))
            colour = np.searchsorted(self.pattern.first, np.arange(len(xx)), side="right")
            beside = (row != column) & (colour[row] == colour[column])
            lift = np.bincount(more.row[beside], np.abs(more.data[beside]), 2 * len(xx))
            xx, yy = xx + lift[::2], yy + lift[1::2]
        det = xx * yy - xy * xy
        if not (det > 0).all():
            raise PrecisionError("A linear system is singular in double precision")
        return np.stack([yy / det, -xy / det, xx / det])

    def shifted(self, shift: float) -> VertexRows:
        """The matrix and a multiple of the identity."""
        found = VertexRows(self.pattern, self._data.copy())
        found._more = self._more
        found.add_diagonal(np.full(2 * len(self.pattern.order), shift))
        return found

    def plain(self) -> sp.csc_matrix:
        """The matrix, in the numbers of the mesh."""
        rows = sp.vstack([sp.vstack(both).tocsr()[_alternating(both[0].shape[0])] for both in self.of_colours])
        rows = rows.tocsr() if self._more is None else rows.tocsr() + self._more
        place = np.empty(len(self.pattern.order), np.int64)
        place[self.pattern.order] = np.arange(len(place))
        unknowns = (2 * place[:, None] + np.arange(2)).ravel()
        return rows[unknowns][:, unknowns].tocsc()


def _alternating(count: int) -> np.ndarray:
    """Rows 0, count, 1, count + 1, ..."""
    return (np.arange(count)[:, None] + [0, count]).ravel()


def _keys(cells: np.ndarray, n: int) -> np.ndarray:
    """Keys (c,k^2) of the pairs of corners of cells (c,k), row by row."""
    k = cells.shape[1]
    return np.repeat(cells, k, axis=1).astype(np.int64) * n + np.tile(cells, (1, k))


def _distinct_keys(cells: Sequence[np.ndarray], n: int) -> np.ndarray:
    """The keys of all pairs of corners, and of all vertices with themselves, in order, each once: a vertex may follow
    another, and be in no cell."""
    key = np.empty(n + sum(len(c) * c.shape[1] ** 2 for c in cells), np.int64)
    key[:n] = np.arange(n, dtype=np.int64) * (n + 1)
    begin = n
    for some in cells:
        for part in (some[k : k + AT_ONCE] for k in range(0, len(some), AT_ONCE)):
            found = _keys(part, n).ravel()
            key[begin : begin + len(found)] = found
            begin += len(found)
    key.sort()
    kept = np.concatenate([[True], key[1:] != key[:-1]])
    return key[kept]
