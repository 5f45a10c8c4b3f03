"""Solve Newton's equations of large meshes by symmetric sweeps and affine motions of parts.

Conjugate gradients are preconditioned by a sweep over the vertices, colour after colour (symmetric Gauss-Seidel), and
back, and in between by the affine motions of parts of about a hundred vertices: how these move, turn and stretch as a
whole (Toselli, Widlund 2005, section 3, has such coarse spaces). Nothing is factored but the equations of these
motions: a sweep needs nothing that the matrix does not have.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from ..freed_memory import give_back, give_back_often
from .additive_schwarz import SHIFT, AdditiveSchwarz, affine_motions, hangs_by_few
from .kept_factor import by_gradients
from .nested_dissection import kd_parts
from .sparse import Factor, minimum_degree
from .vertex_rows import VertexRows, rows_between

# Vertices of a part: of fewer, the equations of their motions take as long as the sweeps.
PART_SIZE = 100
# Motions of which factors in single precision do: in double those of a million vertices take as much memory as these.
SINGLE_FROM = 30_000
# Iterations at most; where these are not enough, parts are factored from there on.
MOST = 100


class SymmetricSweeps:
    """Parts of a mesh (n,d), (m,3), whose motions are solved for as a whole."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray):
        self._mesh = points, triangles
        self._part = kd_parts(points, max(0, round(np.log2(len(points) / PART_SIZE)))).astype(np.int32)
        self._order: np.ndarray | None = None
        self._parts: AdditiveSchwarz | None = None

    def hold(self, triangles: np.ndarray) -> None:
        """Hold other triangles (k,3) that join the same vertices and more, since they are there anyway."""
        self._mesh = self._mesh[0], triangles

    def solve(self, rows: VertexRows, b: np.ndarray, w: np.ndarray, axes: Callable[[], np.ndarray]) -> np.ndarray:
        """About the solution x (2n,) of rows x = b, symmetric positive definite; b.x > 0.

        The decrease b.x / 2 that x promises as a Newton step is within some percent of the most there is; where that
        takes too long, x is the solution. w, axes: see `AdditiveSchwarz.solve`. Raises PrecisionError.
        """
        give_back()
        if self._parts is None:
            x = self._swept(rows, b, w, axes)
            if x is not None:
                return x
            self._parts = AdditiveSchwarz(*self._mesh)
        return self._parts.solve(rows.plain(), b, w, axes)

    def _swept(self, rows: VertexRows, b: np.ndarray, w: np.ndarray, axes) -> np.ndarray | None:
        """The solution; None where it takes too many iterations."""
        order, count = rows.pattern.order, int(self._part.max()) + 1
        along = axes()[order]
        spread = affine_motions(self._part[order], count, w[order], along)
        plain = bool((along == [1, 1j]).all())
        del along
        give_back()
        total = rows.between(spread)
        motions = Motions(spread, plain)
        # Factors ask for what they may need of memory before they know how much that is.
        del spread
        give_back()
        coarse = self._coarse(total)
        del total
        precondition = _preconditioner(rows, lambda r: coarse.solve(motions.gathered(r)), motions)
        give_back()
        ordered = b.reshape(-1, 2)[order].ravel()
        found = by_gradients(rows, ordered, precondition, MOST, overwrite=True)
        if found is None:
            return None
        x = np.empty((len(order), 2))
        x[order] = found.reshape(-1, 2)
        return x.ravel()

    def _coarse(self, total: sp.csr_matrix) -> Factor:
        """Factors of the equations (6 parts, 6 parts) of the motions of parts."""
        total = total.tocsc()
        if self._order is None:
            parts = minimum_degree(total[::6, ::6])
            self._order = (6 * parts[:, None] + np.arange(6)).ravel()
        n = total.shape[0]
        return Factor(total + SHIFT * total.diagonal().max() * sp.identity(n), self._order, single=n > SINGLE_FROM)


class Motions:
    """The affine motions of parts, see `affine_motions`; plain : every vertex may go anywhere, so that both of its
    unknowns have the same entries, and those of one are kept."""

    def __init__(self, spread: sp.csr_matrix, plain: bool):
        self._spread, self._plain = spread, plain
        if plain:
            n, k = len(spread.indptr) // 2, spread.shape[1] // 2
            first = spread.indices.reshape(n, 6)[:, :3]
            # Those of a part are six columns, and three of them are for either axis.
            columns = (first - 3 * (first // 6)).ravel()
            entries = spread.data.reshape(n, 6)[:, :3].ravel()
            self._spread = sp.csr_matrix((entries, columns, 3 * np.arange(n + 1, dtype=np.int32)), shape=(n, k))

    def of(self, motions: np.ndarray, own: slice) -> np.ndarray:
        """What all motions (k,) make of the unknowns (v,2) of some vertices that follow each other."""
        if not self._plain:
            return (rows_between(self._spread, 2 * own.start, 2 * own.stop) @ motions).reshape(-1, 2)
        rows, found = rows_between(self._spread, own.start, own.stop), np.empty((own.stop - own.start, 2))
        for axis, one in enumerate(motions.reshape(-1, 2, 3).transpose(1, 0, 2)):
            found[:, axis] = rows @ one.ravel()
        return found

    def gathered(self, r: np.ndarray) -> np.ndarray:
        """What is of each motion (k,) in forces r (2n,)."""
        if not self._plain:
            return self._spread.T @ r
        parts = [(self._spread.T @ side).reshape(-1, 3) for side in r.reshape(-1, 2).T]
        return np.stack(parts, axis=1).ravel()


def _preconditioner(
    rows: VertexRows, by_parts: Callable[[np.ndarray], np.ndarray], parts: Motions
) -> Callable[[np.ndarray], np.ndarray]:
    """A sweep, what parts make of what is left then, as motions of these, and the sweep back.

    What earlier colours do to later ones is taken off what is left as they move, what later ones do to earlier ones on
    the way back: either takes half of the matrix.
    """
    colours, more = range(len(rows.of_colours)), rows.more_of_colours is not None

    def solve(x: np.ndarray, own: slice, left: np.ndarray) -> None:
        """Move the vertices `own` to where nothing of what is left (v,2) of their rows is."""
        (xx, xy, yy), (u, v) = rows.inverse(own), left.T
        x.reshape(-1, 2)[own, 0] = xx * u + xy * v
        x.reshape(-1, 2)[own, 1] = xy * u + yy * v

    def precondition(r: np.ndarray) -> np.ndarray:
        give_back_often(len(r) // 2)
        x, left, beyond = np.zeros(len(r)), r.copy(), np.zeros(len(r) if more else 0)
        for k in colours:
            own = rows.pattern.rows(k)
            here = left.reshape(-1, 2)[own]
            if more:
                beyond.reshape(-1, 2)[own] = rows.by_more(x, k)
                here = here - beyond.reshape(-1, 2)[own]
            solve(x, own, here)
            rows.to_later(x.reshape(-1, 2)[own], k, left)
        give_back_often(len(r) // 2)
        beyond = beyond if more else np.zeros(len(r))
        for k in colours:
            rows.from_later(x, k, beyond)
            if more:
                beyond.reshape(-1, 2)[rows.pattern.rows(k)] -= rows.by_more(x, k)
        motions = by_parts(beyond)
        del beyond
        give_back_often(len(r) // 2)
        for k in colours:
            own = rows.pattern.rows(k)
            moved = parts.of(motions, own)
            x.reshape(-1, 2)[own] += moved
            rows.to_later(moved, k, left)
        for k in reversed(colours):
            own = rows.pattern.rows(k)
            rows.from_later(x, k, left)
            here = left.reshape(-1, 2)[own]
            solve(x, own, here - rows.by_more(x, k) if more else here)
        return x

    return precondition


def sweeping_solver(points: np.ndarray, triangles: np.ndarray) -> SymmetricSweeps | None:
    """What solves Newton's equations of a mesh (n,d), (m,3) that is so large that they should not be factored; None for
    others. The order of the vertices is that of their elimination."""
    return None if hangs_by_few(points, triangles) else SymmetricSweeps(points, triangles)
