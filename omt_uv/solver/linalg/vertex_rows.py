"""Symmetric matrices of large meshes, two unknowns a vertex, by rows of vertices: colour after colour.

No two vertices of a colour are neighbours, so that a sweep solves for all of them at once (Saad, Iterative methods for
sparse linear systems, section 12.4), and their rows follow each other: nothing is copied for that. Rows have the blocks
with vertices of later colours alone, which is half of a symmetric matrix; the other half is their transpose. Both rows
of a vertex share their columns, which halves what these take.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from ..errors import PrecisionError
from ..freed_memory import give_back_often
from ..mesh.topology import order_of_numbers

# Cells whose pairs of corners are numbered at a time.
AT_ONCE = 100_000


class RowPattern:
    """Where entries are in the rows of matrices of the cells (c_i,k_i), some triangles and some quads, of n vertices.

    order (n,) : vertices by colour, in which all else is numbered; first (colours + 1,) : where each begins
    start (n + 1,) : the first of the b blocks of each vertex with those of later colours
    columns (2b,) : the two columns of each block, counted from the first unknown of the next colour
    """

    def __init__(self, cells: Sequence[np.ndarray], n: int):
        key = _distinct_keys(cells, n)
        colour = _colours(key, n)
        self.order = np.argsort(colour, kind="stable").astype(np.int32)
        place = np.empty(n, np.int32)
        place[self.order] = np.arange(n)
        self.first = np.concatenate([[0], np.cumsum(np.bincount(colour))])
        one, other = place[key // n], place[key % n]
        row, column = np.minimum(one, other), np.maximum(one, other)
        del one, other
        by_row = np.argsort(row.astype(np.int64) * n + column)
        self.start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))]).astype(np.int32)
        del key
        row, column = row[by_row], column[by_row]
        del by_row
        later = column - self.first[1:].astype(np.int32)[colour[self.order[row]]]
        self.columns = (2 * later[:, None] + np.arange(2, dtype=np.int32)).ravel()

    def places(self) -> Callable[[np.ndarray], BlockPlaces]:
        """What finds where the blocks of some cells (c,k) belong. For all cells at once that takes as much memory as
        the mesh."""
        n, key = len(self.order), np.empty(self.count, np.int64)
        place = np.empty(n, np.int32)
        place[self.order] = np.arange(n)
        for begin, end in pairwise(self.first):
            # Row by row: they are in order.
            row = np.repeat(np.arange(begin, end), np.diff(self.start[begin : end + 1]))
            here = slice(self.start[begin], self.start[end])
            key[here] = self.columns[::2][here] // 2 + (n * row + end)
        seen, number = np.zeros(len(key) + n, bool), np.empty(len(key) + n, np.int32)

        def of(cells: np.ndarray) -> BlockPlaces:
            first, second = corner_pairs(cells.shape[1])
            one, other = place[cells.T[first]], place[cells.T[second]]
            # The key of a vertex with itself is none: what it comes to is of no use.
            found = np.searchsorted(key, _keys(one, other, n)).astype(np.int32)
            found = np.where(one == other, np.int32(len(key)) + one, found)
            seen[found] = True
            touched = np.flatnonzero(seen).astype(np.int32)
            seen[touched] = False
            number[touched] = np.arange(len(touched))
            # Two corners may be one vertex, where others follow it.
            alike = (one == other) & (first != second)[:, None]
            return BlockPlaces(touched, number[found], one > other, alike if alike.any() else None)

        return of

    def rows(self, colour: int) -> slice:
        """Which vertices have a colour."""
        return slice(int(self.first[colour]), int(self.first[colour + 1]))

    @property
    def count(self) -> int:
        """Blocks b of two vertices."""
        return len(self.columns) // 2


@dataclass(frozen=True)
class BlockPlaces:
    """Where the blocks of the pairs of corners of some cells (c,k) belong, see `corner_pairs`: (p,c) each.

    touched (t,) : blocks of the pattern that there are, b + v that of vertex v with itself; number : which of these
    turned : whether the second corner comes before the first; alike : whether both are one vertex, None where none are
    """

    touched: np.ndarray
    number: np.ndarray
    turned: np.ndarray
    alike: np.ndarray | None


def corner_pairs(k: int) -> tuple[np.ndarray, np.ndarray]:
    """The pairs of corners of a cell of k, each once, row by row."""
    return np.triu_indices(k)


def _colours(key: np.ndarray, n: int) -> np.ndarray:
    """Colours (n,) of n vertices of which those of the keys are neighbours, see `_distinct_keys`."""
    b, both = len(key), np.empty(2 * len(key) + n, np.int64)
    both[:b], both[2 * b :] = key, np.arange(n) * (n + 1)
    parts = [slice(k, k + 10 * AT_ONCE) for k in range(0, len(both), 10 * AT_ONCE)]
    for here in parts:
        one, other = np.divmod(key[here], n)
        both[b : 2 * b][here] = other * n + one
    both.sort()
    tail, head = (np.empty(len(both), np.int32) for _ in range(2))
    for here in parts:
        tail[here], head[here] = np.divmod(both[here], n)
    del both
    degree = np.bincount(tail, minlength=n)
    return coloured(np.cumsum(degree) - degree, tail, head)


def coloured(start: np.ndarray, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """Colours (n,) of the vertices of a symmetric graph, no two neighbours of one (Jones, Plassmann 1993).

    start (n,) : the first of the edges from each vertex; tail, head (e,) : of the edges, by tail, each vertex with
    itself among them
    """
    n = len(start)
    rank = np.random.default_rng(0).permutation(n).astype(np.int32)
    colour, taken = np.full(n, -1), np.zeros(n, np.int64)
    while True:
        give_back_often(n)
        left = colour < 0
        if not left.any():
            return colour
        # Its edge to itself stays with every vertex that is left.
        kept = left[tail] & left[head]
        tail, head = tail[kept], head[kept]
        vertex = np.flatnonzero(left)
        begin = np.searchsorted(tail, vertex)
        won = vertex[_of_edges(np.maximum, rank, head, begin) == rank[vertex]]
        colour[won] = np.log2(~taken[won] & (taken[won] + 1)).astype(np.int64)
        bit = np.zeros(n, np.int64)
        bit[won] = 1 << colour[won]
        taken[vertex] |= _of_edges(np.bitwise_or, bit, head, begin)


def _of_edges(reduce: np.ufunc, values: np.ndarray, head: np.ndarray, begin: np.ndarray) -> np.ndarray:
    """What values (n,) at the heads of edges (e,) come to, (v,), from each of some of these on to the next."""
    found, cuts = np.empty(len(begin), values.dtype), np.append(begin, len(head))
    for first in range(0, len(begin), AT_ONCE):
        some = cuts[first : first + AT_ONCE + 1]
        found[first : first + AT_ONCE] = reduce.reduceat(values[head[some[0] : some[-1]]], some[:-1] - some[0])
    return found


class VertexRows:
    """A symmetric matrix (2n,2n) of a pattern; unknowns 2 i and 2 i + 1 are those of the vertex `pattern.order[i]`.

    data : see `summed`; more : a sparse matrix (2n,2n) to be added, in the numbers of the mesh, or None
    """

    def __init__(self, pattern: RowPattern, data: np.ndarray, more: sp.spmatrix | None = None):
        self.pattern, self._data = pattern, data
        unknowns = (2 * pattern.order[:, None] + np.arange(2, dtype=np.int32)).ravel()
        self._more = None if more is None else more.tocsr()[unknowns][:, unknowns].tocsr()

    @staticmethod
    def summed(pattern: RowPattern, parts: Iterable[tuple[BlockPlaces, np.ndarray]]) -> np.ndarray:
        """The data (2,b + n,2) of a matrix: by axis of the row, block, and axis of the column.

        parts : where the blocks of some cells belong, and what these cells add, (c,2k,2k) symmetric
        """
        data = np.zeros((2, pattern.count + len(pattern.order), 2))
        for places, blocks in parts:
            one, other = corner_pairs(blocks.shape[1] // 2)
            cells, count = blocks.transpose(1, 2, 0), len(places.touched)
            number = places.number.ravel().astype(np.intp)
            here = {(p, q): cells[2 * one + p, 2 * other + q] for p in range(2) for q in range(2)}
            for (p, q), values in here.items():
                across = here[q, p]
                if p != q:
                    values = np.where(places.turned, across, values)
                if places.alike is not None:
                    values = values + np.where(places.alike, across, 0)
                data[p, places.touched, q] += np.bincount(number, values.ravel(), count)
        return data

    def add_diagonal(self, diagonal: np.ndarray) -> None:
        """Add a diagonal (2n,), in the numbers of the mesh."""
        for p, values in enumerate(diagonal.reshape(-1, 2)[self.pattern.order].T):
            self._data[p, self.pattern.count :, p] += values

    @cached_property
    def of_colours(self) -> list[tuple[sp.csr_matrix, sp.csr_matrix]]:
        """The first and the second rows (v,2m) of the vertices of each colour, as far as they are of the m vertices of
        later colours."""
        pattern, found = self.pattern, []
        for k in range(len(pattern.first) - 1):
            own = pattern.rows(k)
            start = pattern.start[own.start : own.stop + 1]
            here, pointers = slice(2 * start[0], 2 * start[-1]), 2 * (start - start[0])
            size = len(start) - 1, 2 * (len(pattern.order) - own.stop)
            first, second = (
                _sharing(size, rows.reshape(-1)[here], pattern.columns[here], pointers) for rows in self._data
            )
            found.append((first, second))
        return found

    @cached_property
    def more_of_colours(self) -> list[sp.csr_matrix] | None:
        """What is to be added to the rows (2v,2n) of each colour, beside `inverse`."""
        if self._more is None:
            return None
        xx, xy, yy = self._own - np.stack(self._blocks_of(slice(None)))
        size = np.arange(len(xx) + 1)
        blocks = np.stack([np.stack([xx, xy], axis=1), np.stack([xy, yy], axis=1)], axis=1)
        beside = (self._more - sp.bsr_matrix((blocks, size[:-1], size)).tocsr()).tocsr()
        cuts = 2 * self.pattern.first
        return [beside[a:b] for a, b in pairwise(cuts)]

    def from_later(self, x: np.ndarray, colour: int, total: np.ndarray) -> None:
        """Take what vertices of later colours, which are at x (2n,), do to those of a colour off a total (2n,)."""
        own = total.reshape(-1, 2)[self.pattern.rows(colour)]
        for axis, rows in enumerate(self.of_colours[colour]):
            own[:, axis] -= rows @ x[len(x) - rows.shape[1] :]

    def to_later(self, own: np.ndarray, colour: int, total: np.ndarray) -> None:
        """Take what the vertices of a colour, which are at `own` (v,2), do to those of later colours off a total
        (2n,)."""
        first, second = (_turned(rows) @ own[:, axis] for axis, rows in enumerate(self.of_colours[colour]))
        first += second
        total[len(total) - len(first) :] -= first

    def by_more(self, x: np.ndarray, colour: int) -> np.ndarray:
        """What `more_of_colours` makes of x (2n,), (v,2)."""
        more, own = self.more_of_colours, self.pattern.rows(colour)
        return np.zeros((own.stop - own.start, 2)) if more is None else (more[colour] @ x).reshape(-1, 2)

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        give_back_often(len(self.pattern.order))
        found = np.empty(len(x))
        at, minus = x.reshape(-1, 2), found.reshape(-1, 2)
        for axis, rows in enumerate(self._data[:, self.pattern.count :]):
            minus[:, axis] = -(rows[:, 0] * at[:, 0] + rows[:, 1] * at[:, 1])
        for k in range(len(self.of_colours)):
            self.from_later(x, k, found)
            self.to_later(at[self.pattern.rows(k)], k, found)
        if self._more is not None:
            found -= self._more @ x
        return np.negative(found, out=found)

    def inverse(self, own: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Inverses of the blocks of some vertices with themselves: entries (v,) xx, xy, yy. Raises PrecisionError.

        They are found in less time than the rows of these vertices are gone through, and none are kept.
        """
        xx, xy, yy = self._blocks_of(own) if self._more is None else self._own[:, own]
        det = xx * yy - xy * xy
        if not (det > 0).all():
            raise PrecisionError("A linear system is singular in double precision")
        return yy / det, -xy / det, xx / det

    def _blocks_of(self, own: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The blocks of the pattern of some vertices with themselves, entries as in `inverse`, which are not copied."""
        first, second = self._data[:, self.pattern.count :][:, own]
        return first[:, 0], first[:, 1], second[:, 1]

    @cached_property
    def _own(self) -> np.ndarray:
        """The blocks of vertices with themselves, (3,n) as in `inverse`.

        What is added to the pattern may join vertices of a colour: their blocks are as much greater as makes sweeps
        converge all the same (Baker, Falgout, Kolev, Yang 2011).
        """
        own = np.stack(self._blocks_of(slice(None)))
        if self._more is None:
            return own
        xx, xy, yy = own
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
        return np.stack([xx + lift[::2], xy, yy + lift[1::2]])

    def shifted(self, shift: float) -> VertexRows:
        """The matrix and a multiple of the identity."""
        found = VertexRows(self.pattern, self._data.copy())
        found._more = self._more
        found.add_diagonal(np.full(2 * len(self.pattern.order), shift))
        return found

    def between(self, motions: sp.csr_matrix) -> sp.csr_matrix:
        """What the matrix makes of every two of some motions, (2n,k) in the numbers of its rows: (k,k)."""
        # Half of what is between vertices and those of later colours, and what is between them and themselves.
        half, within = (sp.csr_matrix((motions.shape[1],) * 2) for _ in range(2))
        for k, both in enumerate(self.of_colours):
            own = self.pattern.rows(k)
            later = rows_between(motions, 2 * own.stop, motions.shape[0])
            itself = self._data[:, self.pattern.count :][:, own]
            for axis, rows in enumerate(both):
                some = motions[2 * own.start + axis : 2 * own.stop : 2].T
                half = half + some @ (rows @ later)
                for other, entries in enumerate(itself[axis].T):
                    moved = motions[2 * own.start + other : 2 * own.stop : 2]
                    moved.data *= np.repeat(entries, np.diff(moved.indptr))
                    within = within + some @ moved
                del some, moved
                give_back_often(len(self.pattern.order))
        total = within + half + half.T
        return total if self._more is None else total + motions.T @ (self._more @ motions)

    def plain(self) -> sp.csc_matrix:
        """The matrix, in the numbers of the mesh."""
        pattern, n = self.pattern, len(self.pattern.order)
        upper = []
        for k, both in enumerate(self.of_colours):
            own = pattern.rows(k)
            shifted = [sp.csr_matrix((x.data, x.indices + 2 * own.stop, x.indptr), (x.shape[0], 2 * n)) for x in both]
            upper.append(sp.vstack(shifted).tocsr()[_alternating(own.stop - own.start)])
        half = sp.vstack(upper).tocsr()
        blocks = self._data[:, pattern.count :].transpose(1, 0, 2)
        rows = half + half.T + sp.bsr_matrix((blocks, np.arange(n), np.arange(n + 1))).tocsr()
        rows = rows.tocsr() if self._more is None else rows.tocsr() + self._more
        place = np.empty(n, np.int64)
        place[pattern.order] = np.arange(n)
        unknowns = (2 * place[:, None] + np.arange(2)).ravel()
        return rows[unknowns][:, unknowns].tocsc()


def _sharing(shape: tuple[int, int], data: np.ndarray, indices: np.ndarray, start: np.ndarray) -> sp.csr_matrix:
    """A sparse matrix whose entries are parts of larger arrays, not copies of these, which it would make of itself."""
    found = sp.csr_matrix(shape)
    found.data, found.indices, found.indptr = data, indices, start
    return found


def _turned(rows: sp.csr_matrix) -> sp.csc_matrix:
    """The transpose of a matrix, whose entries are not copied either."""
    found = sp.csc_matrix(rows.shape[::-1])
    found.data, found.indices, found.indptr = rows.data, rows.indices, rows.indptr
    return found


def rows_between(rows: sp.csr_matrix, first: int, last: int) -> sp.csr_matrix:
    """The rows of a matrix from one on and before another, which are not copied."""
    start = rows.indptr[first : last + 1]
    here = slice(start[0], start[-1])
    return _sharing((len(start) - 1, rows.shape[1]), rows.data[here], rows.indices[here], start - start[0])


def _alternating(count: int) -> np.ndarray:
    """Rows 0, count, 1, count + 1, ..."""
    return (np.arange(count)[:, None] + [0, count]).ravel()


def _keys(one: np.ndarray, other: np.ndarray, n: int) -> np.ndarray:
    """Keys of pairs of vertices, whichever of both comes first."""
    return np.minimum(one, other).astype(np.int64) * n + np.maximum(one, other)


def _distinct_keys(cells: Sequence[np.ndarray], n: int) -> np.ndarray:
    """The keys of all pairs of different corners, in order, each once."""
    key = np.empty(sum(len(c) * c.shape[1] * (c.shape[1] - 1) // 2 for c in cells), np.int64)
    begin = 0
    for some in cells:
        one, other = np.triu_indices(some.shape[1], 1)
        for part in (some[k : k + AT_ONCE] for k in range(0, len(some), AT_ONCE)):
            # Where vertices follow others, two corners may be one.
            found = np.where(part[:, one] == part[:, other], -1, _keys(part[:, one], part[:, other], n)).ravel()
            key[begin : begin + len(found)] = found
            begin += len(found)
    key.sort()
    key = key[np.searchsorted(key, 0) :]
    kept = np.ones(len(key), bool)
    kept[1:] = key[1:] != key[:-1]
    return key[kept]


def numbered_pairs(cells: list[np.ndarray], n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns (p,) and rows (p,) of the pairs of corners of cells (c,k), each once, column by column; and the number of
    every pair of every cell, cell by cell and row by row of their blocks."""
    several = [c.astype(np.int32, copy=False) for c in cells]
    column = np.concatenate([np.tile(c, (1, c.shape[1])).ravel() for c in several])
    row = np.concatenate([np.repeat(c, c.shape[1], axis=1).ravel() for c in several])
    # By rows first, the columns then keep their order.
    order = order_of_numbers(row)
    order = order[order_of_numbers(column[order])].astype(np.int32)
    column, row = column[order], row[order]
    begins = np.ones(len(order), bool)
    begins[1:] = (column[1:] != column[:-1]) | (row[1:] != row[:-1])
    number = np.empty(len(order), np.int32)
    number[order] = np.cumsum(begins, dtype=np.int32) - 1
    return column[begins], row[begins], number
