"""Sum the rows of a Hessian into dense blocks of triangles and quads, and these into one sparse matrix.

A row stands for the linear form dw -> Re(row . dw); the Hessian is the sum of the squares of all rows. Those of the
four triangles of a quad and of its area share four vertices, and make one block of 8 x 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..linalg.additive_schwarz import AdditiveSchwarz
from ..linalg.kept_factor import KeptFactor
from ..linalg.nested_dissection import LARGE, vertex_graph
from ..linalg.sparse import minimum_degree
from ..maps.energy import Elements, area_forms, face_derivatives, sum_at_vertices
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import restricted
from ..mesh.polygon_areas import BOTH

# Quads whose rows are dense at a time: 17 rows of 8 numbers each.
CHUNK = 20_000
# How far the second derivative of the area term goes from its own to the one that leads to the areas at once, see
# `energy.eager_bend`, where no pressure is kept: a quarter fewer steps, most on the long way of limbs.
EAGERNESS = 0.75

# Polygons whose blocks are found at once, in large meshes: what is found on the way takes four times their memory.
AT_ONCE = 100_000
# Axes of row and column within the block of two vertices.
AXES = ((0, 0), (1, 0), (0, 1), (1, 1))


class Assembly:
    """Scatters dense blocks of triangles, and of quads, into one sparse matrix whose pattern never changes.

    Unknown 2 i and 2 i + 1 are the axes of vertex i. parts: what solves for a step that is nearly right, or None;
    order: in which unknowns are eliminated, see `sparse.Factor`.
    """

    order: str | np.ndarray = "natural"

    def __init__(
        self,
        triangles: np.ndarray,
        n: int,
        parts: AdditiveSchwarz | KeptFactor | None = None,
        quads: np.ndarray | None = None,
    ):
        self.parts = parts
        cells = [triangles] if quads is None or not len(quads) else [triangles, quads]
        # The diagonal, too: a vertex may follow another, and be in no cell.
        pairs = [_pairs(c, n) for c in cells]
        key = np.unique(np.concatenate([*pairs, np.arange(n, dtype=np.int64) * (n + 1)]))
        self._block = np.concatenate([np.searchsorted(key, k) for k in pairs])
        column, row = np.divmod(key, n)
        degree = np.bincount(column, minlength=n)
        start = np.cumsum(degree) - degree
        # Within column 2 j + q the rows 2 i + p follow each other; `stride` is from one of these columns to the next.
        self._stride = (2 * degree[column]).astype(np.int32)
        self._slot = 4 * start[column] + 2 * (np.arange(len(key)) - start[column])
        self._indptr = np.concatenate([[0], np.cumsum(np.repeat(2 * degree, 2))])
        self._indices = np.empty(4 * len(key), np.int32)
        for p, q in AXES:
            self._indices[self._slot + p + q * self._stride] = 2 * row + p
        self._every = self._every_slot(cells) if len(triangles) <= 2 * AT_ONCE else None
        own = np.flatnonzero(row == column)
        self._diagonal = np.column_stack([self._slot[own], self._slot[own] + 1 + self._stride[own]]).ravel()
        self._size = 2 * n

    def matrix(self, blocks: np.ndarray, diagonal: np.ndarray, quads: np.ndarray | None = None) -> sp.csc_matrix:
        """Sum of the blocks (t,6,6) of triangles and (q,8,8) of quads, plus a diagonal (2n,)."""
        given = [blocks] if quads is None else [blocks, quads]
        if self._every is not None:
            data: np.ndarray = np.bincount(self._every, np.concatenate([b.ravel() for b in given]), len(self._indices))
            return self._with_diagonal(data, diagonal)
        cells = [b.reshape(len(b), b.shape[1] // 2, 2, b.shape[1] // 2, 2) for b in given]
        data = np.empty(len(self._indices))
        for p, q in AXES:
            values = np.concatenate([c[:, :, p, :, q].ravel() for c in cells])
            data[self._slot + p + q * self._stride] = np.bincount(self._block, values, len(self._slot))
        return self._with_diagonal(data, diagonal)

    def _every_slot(self, cells: list[np.ndarray]) -> np.ndarray:
        """Where each entry of all blocks belongs: four times the memory of `_block`, and a third of the time."""
        axis, parts = np.arange(2), np.split(self._block, np.cumsum([c.shape[1] * c.size for c in cells])[:-1])
        of_cells = [b.reshape(-1, c.shape[1], 1, c.shape[1], 1) for b, c in zip(parts, cells, strict=True)]
        return np.concatenate(
            [(self._slot[b] + axis[:, None, None] + self._stride[b] * axis).ravel() for b in of_cells]
        )

    def _with_diagonal(self, data: np.ndarray, diagonal: np.ndarray) -> sp.csc_matrix:
        data[self._diagonal] += diagonal
        return sp.csc_matrix((data, self._indices, self._indptr), shape=(self._size,) * 2)


def _pairs(cells: np.ndarray, n: int) -> np.ndarray:
    """Keys (c k k,) of the pairs of corners of cells (c,k), row by row: column times n plus row of their block."""
    k = cells.shape[1]
    return (np.tile(cells, (1, k)).astype(np.int64) * n + np.repeat(cells, k, axis=1)).ravel()


def assembly_of(
    faces: Elements, n: int, parts: AdditiveSchwarz | KeptFactor | None = None, symmetry: MirrorSymmetry | None = None
) -> Assembly:
    """The assembly of the elements of a mesh of n vertices, of which some may follow others."""
    first = lone_triangles(faces)
    place = np.arange(n) if symmetry is None else symmetry.representative
    assembly = Assembly(place[faces.triangles[:first]], n, parts, place[corners_of_quads(faces)])
    if symmetry is not None and n < LARGE:
        # The order of the mesh is no order of its half: folded, its separators are neighbours of both sides.
        vertices = minimum_degree(vertex_graph(place[faces.triangles], n))
        assembly.order = (2 * vertices[:, None] + np.arange(2)).ravel()
    return assembly


def lone_triangles(faces: Elements) -> int:
    """How many triangles come before those of the quads."""
    return len(faces.triangles) - (0 if faces.quads is None else 4 * len(faces.quads.convex))


def corners_of_quads(faces: Elements) -> np.ndarray:
    """Corners (q,4) of the quads."""
    four = faces.triangles[lone_triangles(faces) :].reshape(-1, 4, 3)
    return np.column_stack([four[:, 0], four[:, 1, 2]])


@dataclass(frozen=True)
class Blocks:
    """Derivatives of the energy: gradient (n,) complex, blocks (t,6,6) of triangles and (q,8,8) of quads, a sparse
    matrix for longer polygons or None, and the mean of the diagonal."""

    gradient: np.ndarray
    triangles: np.ndarray
    quads: np.ndarray | None
    rest: sp.spmatrix | None
    scale: float


def hessian_blocks(
    faces: Elements,
    w: np.ndarray,
    weight,
    pressure,
    axes: tuple[np.ndarray, np.ndarray],
    symmetry: MirrorSymmetry | None = None,
) -> Blocks:
    """Gradient and projected Hessian at a map w (n,) complex, in axes: a frame (n,), and which count, free (n,2).

    weight : of the area term, one or (p,) of the polygons; pressure : see `energy.face_derivatives`
    """
    count = len(faces.area)
    if count <= 2 * AT_ONCE:
        return _blocks_at_once(faces, w, weight, pressure, axes, symmetry)
    first = lone_triangles(faces)
    four = (len(faces.triangles) - first) // 4
    triangles, quads = np.empty((first, 6, 6)), np.empty((four, 8, 8))
    gradient, scale, rest = np.zeros(len(w), complex), 0.0, None
    place = np.arange(len(w))
    for begin in range(0, count, AT_ONCE):
        some = np.zeros(count, bool)
        some[begin : begin + AT_ONCE] = True
        of, kept = (x if np.ndim(x) == 0 else x[some] for x in (weight, pressure))
        found = _blocks_at_once(restricted(faces, some, place), w, of, kept, axes, symmetry)
        here = some if faces.polygon is None else some[faces.polygon]
        triangles[here[:first]] = found.triangles
        if found.quads is not None:
            quads[some[count - four :]] = found.quads
        gradient, scale = gradient + found.gradient, scale + found.scale
        rest = found.rest if rest is None else rest if found.rest is None else rest + found.rest
    return Blocks(gradient, triangles, None if faces.polygon is None else quads, rest, scale)


def _blocks_at_once(faces: Elements, w: np.ndarray, weight, pressure, axes, symmetry: MirrorSymmetry | None) -> Blocks:
    """As `hessian_blocks`, of all faces at once."""
    n, first, (frame, free) = len(w), lone_triangles(faces), axes
    eagerness = EAGERNESS * (1 - pressure)
    local = face_derivatives(faces, w, weight, pressure, eagerness)
    gradient, vertex, forms = sum_at_vertices(faces, local.gradient, n), faces.triangles, local.rows
    if symmetry is not None:
        gradient = symmetry.folded(gradient)
        vertex, forms = symmetry.carried(vertex, forms)
    rows = np.ascontiguousarray((forms * frame[vertex][:, None, :]).conj()).view(float)
    rows *= free[vertex].reshape(-1, 1, 6)
    blocks = np.matmul(rows[:first].transpose(0, 2, 1), rows[:first])
    scale = np.einsum("mkd,mkd->", rows, rows) / (2 * n)
    if faces.polygon is None:
        return Blocks(gradient, blocks, None, None, scale)
    forms = area_forms(faces, w, weight, eagerness)
    if symmetry is not None:
        _, forms = symmetry.carried(faces.triangles, forms)
    area = np.ascontiguousarray((forms * frame[vertex]).conj()).view(float)
    area *= free[vertex].reshape(-1, 6)
    return Blocks(
        gradient=gradient,
        triangles=blocks,
        quads=quad_blocks(rows[first:].reshape(-1, 4, 4, 6), area[first:].reshape(-1, 4, 6)),
        rest=long_forms(faces, vertex, area[:first], n),
        scale=scale,
    )


def quad_blocks(rows: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Blocks (q,8,8) from the rows (q,4,4,6) of four triangles each, and their parts (q,4,6) of the area's row."""
    columns = (2 * BOTH[:, :, None] + [0, 1]).reshape(4, 6)
    blocks = np.empty((len(rows), 8, 8))
    for begin in range(0, len(rows), CHUNK):
        here = slice(begin, begin + CHUNK)
        full = np.zeros((len(rows[here]), 17, 8))
        for k in range(4):
            full[:, 4 * k : 4 * k + 4, columns[k]] = rows[here, k]
            full[:, 16, columns[k]] += area[here, k]
        np.matmul(full.transpose(0, 2, 1), full, out=blocks[here])
    return blocks


def long_forms(faces: Elements, vertex: np.ndarray, area: np.ndarray, n: int) -> sp.spmatrix | None:
    """The squares of the rows of polygons of several triangles that are no quads, from their triangles' (t,6)."""
    if faces.polygon is None or faces.alone is None:
        return None
    several = np.flatnonzero(~faces.alone[: len(area)])
    if not len(several):
        return None
    columns = (2 * vertex[several][:, :, None] + [0, 1]).reshape(-1, 6)
    owner = np.repeat(faces.polygon[several], 6)
    forms = sp.csr_matrix((area[several].ravel(), (owner, columns.ravel())), shape=(len(faces.area), 2 * n))
    return (forms.T @ forms).tocsc()
