"""Solve Newton's equations of large meshes by two-level additive Schwarz (Toselli, Widlund 2005).

Conjugate gradients are preconditioned part by part. The mesh falls into parts of about 500 vertices that overlap by a
ring. Their equations are factored one by one, which takes time and memory in proportion to the size of the mesh, and
what is left, how parts move as a whole, by the affine maps of every part together (Domain Decomposition Methods,
section 3). Stiff area terms do no harm, as they would to smoothers that see one vertex at a time: the parts know all of
their equations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

import numpy as np
import scipy.sparse as sp

from ..errors import PrecisionError
from ..freed_memory import give_back
from .kept_factor import ENOUGH, KEPT_ENOUGH, by_gradients, nearly
from .nested_dissection import kd_parts, vertex_graph
from .sparse import Factor, fill, minimum_degree

# Meshes of fewer vertices are factored at once.
LARGE = 50_000
# So are those of more whose factors have fewer entries for a vertex: slivers and strips hang together by few vertices,
# and parts cut them where they are stiff. A mesh of LARGE vertices as wide as it is long has 41.
LITTLE_FILL = 20
# Vertices up to which that is found out.
COUNTED = 250_000
# Vertices of a part without its overlap.
PART_SIZE = 500
# Rings of vertices that parts overlap by: a second one saves every fifth iteration, and takes longer than these.
OVERLAP = 1
# Where factors are kept, parts are factored in half of the time of all at once from so many vertices on.
LARGE_KEPT = 7000
# There parts are smaller: they are factored in three quarters of the time.
SIZE_KEPT = 250
# Iterations at most by factors that were kept, less one for each group of them that is made anew before, which takes a
# little longer than one. What these come to is a step all the same.
MOST_KEPT = 6
# From so many on, some of the factors are made anew for the next matrix: RENEWED of so many groups of parts, and of the
# coarse equations, in turn. All of them in one step would take as long as two other steps.
FEW = 5
GROUPS = 6
RENEWED = 2
# Neighbours of a vertex beyond which it is no part of any overlap.
MOST_NEIGHBOURS = 100
# Iterations at most; the equations are factored where these are not enough.
MOST = 100
# Parts whose equations are factored by one call. SuperLU asks for several times the memory that it fills: of large
# arrays what is not touched is never taken, and all is given back, where those of single parts leave holes.
TOGETHER = 64
# In so many turns what the matrix makes of the motions of all parts is found.
IN_TURN = 8
# Added to the diagonal of the coarse equations, relative to its greatest entry: a part may have hardly a free vertex.
SHIFT = 1e-12
# Vertices whose motions are found at a time: what is found on the way takes more memory than the motions.
AT_ONCE = 100_000


class AdditiveSchwarz:
    """Parts of a mesh (n,d), (m,3), and where they overlap.

    Unknown 2 i and 2 i + 1 are those of vertex i. keep: factors, for the next matrices, and make them anew some at a
    time; steps take about as long one as the other then, and some are less nearly right.
    """

    def __init__(self, points: np.ndarray, triangles: np.ndarray, size: int = PART_SIZE, keep: bool = False):
        n = len(points)
        self._keep = keep
        self._kept: _Kept | None = None
        self._last: np.ndarray | None = None
        self._ordered = False
        self._joined: list[_Joined] = []
        # Numbers that are kept take half of the memory that they are computed in.
        self._part = kd_parts(points, max(0, round(np.log2(n / size)))).astype(np.int32)
        self._count = int(self._part.max()) + 1
        graph = vertex_graph(triangles, n).tocsr()
        # A vertex with thousands of neighbours would bring all of them into every part.
        quiet = sp.diags((np.diff(graph.indptr) <= MOST_NEIGHBOURS).astype(float))
        spreading = (quiet @ graph @ quiet + sp.identity(n)).tocsr()
        spreading.eliminate_zeros()
        member = sp.csr_matrix((np.ones(n), self._part, np.arange(n + 1)), shape=(n, self._count))
        for _ in range(OVERLAP):
            member = spreading @ member
        member = member.tocsc()
        self._unknowns: list[np.ndarray] = []
        for k in range(self._count):
            v = np.sort(member.indices[member.indptr[k] : member.indptr[k + 1]])
            self._unknowns.append((2 * v[:, None] + np.arange(2)).ravel().astype(np.int32))

    def solve(self, matrix: sp.spmatrix, b: np.ndarray, w: np.ndarray, axes: Callable[[], np.ndarray]) -> np.ndarray:
        """About the solution x (2n,) of matrix x = b, symmetric positive definite; b.x > 0.

        The decrease b.x / 2 that x promises as a Newton step is within some percent of the most there is; where that
        takes too long, x is the solution. w (n,) complex: the map; axes() (n,2) complex: the direction that each
        unknown of a vertex stands for, 0 for one that stays 0, made when it is asked for since it takes as much memory
        as two maps. Raises PrecisionError.
        """
        # Its transpose is itself, by rows.
        matrix = matrix.T if sp.issparse(matrix) and matrix.format == "csc" else sp.csr_matrix(matrix)
        if self._kept is not None:
            self._renew(self._kept, matrix, w, axes)
            self._last, done = nearly(matrix, b, self._kept, self._kept.most, KEPT_ENOUGH, self._last)
            self._kept.short = not done
            return self._last
        x = self._solved_anew(matrix, b, w, axes)
        self._last = x if self._keep else None
        self._give_back()
        return x

    def _renew(self, kept: _Kept, matrix: sp.csr_matrix, w: np.ndarray, axes: Callable[[], np.ndarray]) -> None:
        """Make some of the factors anew where the last matrix took more than a few iterations by those there are, and
        in the end all where it took too many: conjugate gradients may stand still by factors of which some are good."""
        every = len(kept.groups) + 1
        kept.left = max(kept.left, every if kept.short else RENEWED if kept.calls >= FEW else 0)
        kept.calls, now = 0, min(RENEWED, kept.left)
        kept.left, kept.most = kept.left - now, MOST_KEPT - now
        for _ in range(now):
            k, kept.turn = kept.turn, (kept.turn + 1) % every
            if k < len(kept.groups):
                kept.groups[k] = self._group(matrix, k, kept.moves)
            else:
                kept.spread = affine_motions(self._part, self._count, w, axes())
                kept.coarse = self._coarse_factor(matrix, kept.spread)

    def _give_back(self) -> None:
        """Give back what is free, unless the next matrix is waited for."""
        if not self._keep:
            give_back()

    def _solved_anew(
        self, matrix: sp.csr_matrix, b: np.ndarray, w: np.ndarray, axes: Callable[[], np.ndarray]
    ) -> np.ndarray:
        """As `solve`, by new factors."""
        self.prepare(matrix)
        self._give_back()
        spread = affine_motions(self._part, self._count, w, axes())
        self._give_back()
        moves = np.diff(spread.indptr) > 0
        groups = [self._group(matrix, k, moves) for k in range(len(self._together()))]
        self._give_back()
        kept = _Kept(groups, moves, spread, self._coarse_factor(matrix, spread))
        self._give_back()
        self._kept = kept if self._keep else None
        x = by_gradients(matrix, b, kept, MOST, KEPT_ENOUGH if self._keep else ENOUGH)
        kept.calls = 0
        return Factor(matrix, "natural").solve(b) if x is None else x

    def prepare(self, matrix: sp.csr_matrix) -> None:
        """Order the unknowns of every part for little fill, by the first matrix (2n,2n), symmetric: all corners of a
        quad are neighbours there, and what a vertex follows, which no triangle says."""
        place = np.full(matrix.shape[0], -1, np.int32)
        for k, d in enumerate(self._unknowns if not self._ordered else []):
            vertices = minimum_degree(_Joined.of(matrix, [d], place).taken(matrix)[::2, ::2])
            self._unknowns[k] = d.reshape(-1, 2)[vertices].ravel()
        self._ordered = True
        if self._keep and not self._joined:
            self._joined = [_Joined.of(matrix, parts, place) for parts in self._together()]

    def _together(self) -> list[list[np.ndarray]]:
        """The unknowns of parts that are factored by one call."""
        some = min(TOGETHER, -(-self._count // GROUPS)) if self._keep else TOGETHER
        return [self._unknowns[k : k + some] for k in range(0, self._count, some)]

    def _group(self, matrix: sp.csr_matrix, k: int, moves: np.ndarray) -> list[tuple[np.ndarray, Factor]]:
        """The unknowns of the parts of a group, and the factors of their equations one after the other; nothing where
        no unknown of theirs moves (2n,) bool: vertices that follow their images are half of a mesh, or more."""
        parts = self._together()[k]
        if not any(moves[d].any() for d in parts):
            return []
        known = self._joined[k] if self._joined and self._joined[k].fits(matrix) else None
        place = np.full(matrix.shape[0], -1, np.int32)
        joined = _Joined.of(matrix, parts, place) if known is None else known
        try:
            return [(joined.unknowns, Factor(joined.taken(matrix), "natural", single=True))]
        except PrecisionError:
            return [(d, _part_factor(_Joined.of(matrix, [d], place).taken(matrix))) for d in parts]

    def _coarse_factor(self, matrix: sp.csr_matrix, spread: sp.csr_matrix) -> Factor:
        """The factors of the equations of the motions spread (2n, 6 parts)."""
        coarse = self._coarse(matrix, spread)
        return Factor(coarse + SHIFT * coarse.diagonal().max() * sp.identity(coarse.shape[0]))

    def _coarse(self, matrix: sp.csr_matrix, spread: sp.csr_matrix) -> sp.csc_matrix:
        """The equations (6 parts, 6 parts) of the motions spread (2n, 6 parts): some parts after the others, since what
        the matrix makes of all motions takes more memory than all else."""
        gather, columns, moved = spread.T.tocsr(), [], np.diff(spread.indptr)
        turns = min(1 if self._keep else IN_TURN, self._count)
        for some in np.array_split(np.arange(self._count), turns):
            here = np.repeat(np.isin(self._part, some), 2)
            entry, count = np.repeat(here, moved), np.concatenate([[0], np.cumsum(moved * here)])
            entries, place = spread.data[entry], spread.indices[entry] - 6 * some[0]
            motions = sp.csr_matrix((entries, place, count), shape=(spread.shape[0], 6 * len(some)))
            columns.append(gather @ (matrix @ motions))
        return sp.hstack(columns, format="csc")


class _Kept:
    """A preconditioner: `groups` of unknowns and factors of parts, which unknowns `moves` (2n,) bool, the motions
    `spread` of the parts and the factors `coarse` of theirs.

    calls : since the last matrix, and `most` of them; short : whether these were too few; turn : the group that is made
    anew next; left : how many there are to be made
    """

    def __init__(self, groups: list, moves: np.ndarray, spread: sp.csr_matrix, coarse: Factor):
        self.groups: list[list[tuple[np.ndarray, Factor]]] = groups
        self.moves, self.spread, self.coarse = moves, spread, coarse
        self.calls = self.turn = self.left = 0
        self.most, self.short = MOST_KEPT, False

    def __call__(self, r: np.ndarray) -> np.ndarray:
        self.calls += 1
        x = self.spread @ self.coarse.solve(self.spread.T @ r)
        for d, factor in chain.from_iterable(self.groups):
            # Parts overlap: an unknown may be there several times.
            np.add.at(x, d, factor.solve(r[d]))
        return x


def affine_motions(part: np.ndarray, count: int, w: np.ndarray, axes: np.ndarray) -> sp.csr_matrix:
    """The affine motions of all parts, (2n, 6 count), with no entries for unknowns that stay 0.

    part (n,) : of each vertex; w (n,), axes (n,2) complex : see `AdditiveSchwarz.solve`
    """
    size = np.bincount(part, minlength=count)
    middle = (np.bincount(part, w.real, count) + 1j * np.bincount(part, w.imag, count)) / size
    z = w - middle[part]
    z /= np.sqrt(np.bincount(part, np.abs(z) ** 2, count) / size)[part]
    along = axes.ravel()
    # Most unknowns are along an axis of the plane: motions across it do not move them.
    start = np.zeros(len(along) + 1, np.int64)
    np.cumsum(3 * ((along.real != 0).astype(np.int8) + (along.imag != 0)), out=start[1:])
    entries, columns = np.empty(start[-1]), np.empty(start[-1], np.int32)
    for begin in range(0, len(part), AT_ONCE):
        some, here = slice(begin, begin + AT_ONCE), slice(2 * begin, 2 * (begin + AT_ONCE))
        of, moved, place = np.repeat(part[some], 2), np.repeat(z[some], 2), start[:-1][here].copy()
        sides = along[here].real, along[here].imag
        across = sides[1] != 0
        if ((sides[0] != 0) != across).all():
            # Each is along one axis, as nearly always: three entries follow three.
            stretch, side = slice(place[0], place[0] + 3 * len(of)), np.where(across, sides[1], sides[0])
            entries[stretch] = np.column_stack([side, side * moved.real, side * moved.imag]).ravel()
            columns[stretch] = ((6 * of + 3 * across)[:, None] + np.arange(3)).ravel()
            continue
        for k, side in enumerate(sides):
            on = side != 0
            for m, motion in enumerate((1.0, moved.real[on], moved.imag[on])):
                entries[place[on] + m], columns[place[on] + m] = side[on] * motion, 6 * of[on] + 3 * k + m
            place += 3 * on
    return sp.csr_matrix((entries, columns, start), shape=(len(along), 6 * count))


def _part_factor(block: sp.csc_matrix) -> Factor:
    """Factors of the equations of one part, in single precision where that can tell them from singular ones."""
    try:
        return Factor(block, "natural", single=True)
    except PrecisionError:
        return Factor(block, "natural")


def schwarz_solver(points: np.ndarray, triangles: np.ndarray) -> AdditiveSchwarz | None:
    """Parts, whose factors are kept, of a mesh (n,d), (m,3) that is so large that it should be solved in parts.

    The order of the vertices is that of their elimination.
    """
    if hangs_by_few(points, triangles, LARGE_KEPT):
        return None
    return AdditiveSchwarz(points, triangles, SIZE_KEPT, keep=True)


def hangs_by_few(points: np.ndarray, triangles: np.ndarray, large: int | None = None) -> bool:
    """Whether a mesh (n,d), (m,3) should be factored as a whole: it has less than `large` vertices, LARGE by default,
    or is long and narrow. The order of the vertices is that of their elimination."""
    n = len(points)
    # Factors of smaller meshes have fewer entries for a vertex: these grow with the logarithm of their number.
    little = LITTLE_FILL * min(1.0, np.log(n) / np.log(LARGE))
    return n < (LARGE if large is None else large) or (n < COUNTED and fill(vertex_graph(triangles, n)) < little * n)


@dataclass(frozen=True)
class _Joined:
    """The equations of some parts side by side, as they are taken out of a matrix of a known pattern.

    unknowns (k,) : of the parts, one after the other
    source (e,) : where the entries are in the data of the matrix; indices (e,), start (k + 1,) : of the result
    pattern : indices and starts of the rows of the matrix
    """

    unknowns: np.ndarray
    source: np.ndarray
    indices: np.ndarray
    start: np.ndarray
    pattern: tuple[np.ndarray, np.ndarray]

    @staticmethod
    def of(matrix: sp.csr_matrix, parts: list[np.ndarray], place: np.ndarray) -> _Joined:
        """Of a symmetric matrix, in time that only depends on the result; place (n,) is and stays -1."""
        sources, columns, counts, begin = [], [], [], 0
        for d in parts:
            place[d] = np.arange(begin, begin + len(d))
            first, count = matrix.indptr[d], matrix.indptr[d + 1] - matrix.indptr[d]
            end = np.cumsum(count)
            entry = np.arange(end[-1]) + np.repeat(first - (end - count), count)
            column = place[matrix.indices[entry]]
            inside = column >= 0
            sources.append(entry[inside].astype(matrix.indices.dtype))
            columns.append(column[inside])
            kept = np.concatenate([[0], np.cumsum(inside)])
            counts.append(kept[end] - kept[end - count])
            place[d] = -1
            begin += len(d)
        start = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int32)
        joined = sp.csc_matrix((np.concatenate(sources), np.concatenate(columns), start), shape=(begin, begin))
        # Whoever factors them sorts them, in place.
        joined.sort_indices()
        return _Joined(
            unknowns=np.concatenate(parts),
            source=joined.data,
            indices=joined.indices,
            start=joined.indptr,
            pattern=(matrix.indices, matrix.indptr),
        )

    def fits(self, matrix: sp.csr_matrix) -> bool:
        """Whether a matrix has the pattern."""
        given = (matrix.indices, matrix.indptr)
        return all(a is b or np.array_equal(a, b) for a, b in zip(self.pattern, given, strict=True))

    def taken(self, matrix: sp.csr_matrix) -> sp.csc_matrix:
        """The equations (k,k), symmetric: rows of the matrix are columns."""
        k = len(self.unknowns)
        return sp.csc_matrix((matrix.data[self.source], self.indices, self.start), shape=(k, k))
