"""Sum the rows of a Hessian into dense blocks of triangles and quads, and these into one sparse matrix.

A row stands for the linear form dw -> Re(row . dw); the Hessian is the sum of the squares of all rows. Those of the
four triangles of a quad and of its area share four vertices, and make one block of 8 x 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
import scipy.sparse as sp

from ..freed_memory import give_back_of
from ..linalg.additive_schwarz import AdditiveSchwarz
from ..linalg.kept_factor import KeptFactor
from ..linalg.nested_dissection import LARGE, vertex_graph
from ..linalg.sparse import FillOrder, minimum_degree
from ..linalg.symmetric_sweeps import SymmetricSweeps
from ..linalg.vertex_rows import BlockPlaces, RowPattern, VertexRows, numbered_pairs
from ..maps.energy import (
    Elements,
    area_forms_of,
    by_squares,
    corner_slopes,
    sum_at_vertices,
    unit,
    without_negative,
)
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import in_turn, restricted
from ..mesh.polygon_areas import BOTH

# Triangles whose blocks are found at a time: what is found on the way stays in the processor's cache.
CHUNK = 8192
# How far the second derivative of the area term goes from its own to the one that leads to the areas at once, see
# `energy.eager_bend`, where no pressure is kept: a quarter fewer steps, most on the long way of limbs.
EAGERNESS = 0.75

# Polygons whose blocks are found at once, in meshes of more than twice as many triangles: what is found on the way
# takes four times their memory.
AT_ONCE = 100_000
# The same in meshes whose rows follow each other, where what is found of some stays in the cache.
FEW_AT_ONCE = 1 << 14
# Pairs of corners of all cells up to which it is kept where each entry of a block belongs.
MOST_PAIRS = 2 * 9 * AT_ONCE
# Vertices up to which it is kept where blocks belong: for more, memory is scarcer than the time to find it again.
MOST_PLACED = 800_000
# Axes of row and column within the block of two vertices.
AXES = ((0, 0), (1, 0), (0, 1), (1, 1))
Matrix = sp.spmatrix | VertexRows
Solver = SymmetricSweeps | AdditiveSchwarz | KeptFactor
_BothPlaces = tuple[BlockPlaces | None, BlockPlaces | None]


class Assembly:
    """Scatters dense blocks of triangles, and of quads, into one sparse matrix whose pattern never changes.

    Unknown 2 i and 2 i + 1 are the axes of vertex i. parts: what solves for a step that is nearly right, or None;
    order: in which unknowns are eliminated.
    """

    def __init__(
        self,
        triangles: np.ndarray,
        n: int,
        parts: Solver | None = None,
        quads: np.ndarray | None = None,
    ):
        self.parts, self.order = parts, FillOrder()
        cells = [triangles] if quads is None or not len(quads) else [triangles, quads]
        # The diagonal, too: a vertex may follow another, and be in no cell.
        column, row, number = numbered_pairs([*cells, np.arange(n)[:, None]], n)
        # What is kept between steps takes half of the memory that it is computed in.
        self._block = number[: len(number) - n]
        degree = np.bincount(column, minlength=n)
        start = np.cumsum(degree) - degree
        # Within column 2 j + q the rows 2 i + p follow each other; `stride` is from one of these columns to the next.
        self._stride = (2 * degree[column]).astype(np.int32)
        self._slot = (4 * start[column] + 2 * (np.arange(len(column)) - start[column])).astype(np.int32)
        self._indptr = np.concatenate([[0], np.cumsum(np.repeat(2 * degree, 2))]).astype(np.int32)
        self._indices = np.empty(4 * len(column), np.int32)
        for p, q in AXES:
            self._indices[self._slot + p + q * self._stride] = 2 * row + p
        self._every = self._every_slot(cells) if len(self._block) <= MOST_PAIRS else None
        own = np.flatnonzero(row == column)
        self._diagonal = np.column_stack([self._slot[own], self._slot[own] + 1 + self._stride[own]]).ravel()
        self._size = 2 * n

    def hessian(
        self, faces: Elements, w: np.ndarray, weight, pressure, axes, symmetry: MirrorSymmetry | None = None
    ) -> Hessian:
        """The Hessian of the energy, see `hessian_blocks`."""
        found = hessian_blocks(faces, w, weight, pressure, axes, symmetry)

        def matrix(diagonal: np.ndarray, more: sp.spmatrix | None) -> Matrix:
            plain = self.matrix(found.triangles, diagonal, found.quads)
            return plain if more is None else plain + more

        return Hessian(found.gradient, matrix, found.rest, found.scale)

    def matrix(self, blocks: np.ndarray, diagonal: np.ndarray, quads: np.ndarray | None = None) -> sp.csc_matrix:
        """Sum of the blocks (t,6,6) of triangles and (q,8,8) of quads, plus a diagonal (2n,)."""
        given = [blocks] if quads is None else [blocks, quads]
        if self._every is not None:
            several = [b.transpose(1, 2, 0).ravel() for b in given]
            every = several[0] if len(several) == 1 else np.concatenate(several)
            data: np.ndarray = np.bincount(self._every, every, len(self._indices))
            return self._with_diagonal(data, diagonal)
        cells = [b.reshape(len(b), b.shape[1] // 2, 2, b.shape[1] // 2, 2) for b in given]
        data, block = np.empty(len(self._indices)), self._block.astype(np.intp)
        for p, q in AXES:
            values = np.concatenate([c[:, :, p, :, q].ravel() for c in cells])
            data[self._slot + p + q * self._stride] = np.bincount(block, values, len(self._slot))
        return self._with_diagonal(data, diagonal)

    def pattern(self) -> sp.csc_matrix:
        """A matrix (2n,2n) with the entries that there may be, all of them 1."""
        return sp.csc_matrix((np.ones(len(self._indices)), self._indices, self._indptr), shape=(self._size,) * 2)

    def _every_slot(self, cells: list[np.ndarray]) -> np.ndarray:
        """Where each entry of all blocks belongs: four times the memory of `_block`, and a third of the time."""
        parts, found = np.split(self._block, np.cumsum([c.shape[1] * c.size for c in cells])[:-1]), []
        for block, cell in zip(parts, cells, strict=True):
            m, k = cell.shape
            where = np.empty((k, 2, k, 2, m), np.intp)
            # Pair by pair: whole rows of entries are written one after the other.
            for i, j in np.ndindex(k, k):
                at = block.reshape(m, k * k)[:, i * k + j]
                slot, stride = self._slot[at], self._stride[at]
                for p, q in AXES:
                    where[i, p, j, q] = slot + p + q * stride
            found.append(where.ravel())
        return np.concatenate(found)

    def _with_diagonal(self, data: np.ndarray, diagonal: np.ndarray) -> sp.csc_matrix:
        data[self._diagonal] += diagonal
        found = sp.csc_matrix((data, self._indices, self._indptr), shape=(self._size,) * 2)
        # Or SuperLU would look whether they are in order.
        found.has_canonical_format = True
        return found


class RowAssembly:
    """Sums dense blocks of triangles and quads of a large mesh into `VertexRows`, some polygons after the others.

    parts: what solves for a step that is nearly right; order: in which unknowns are eliminated where that is no use
    """

    def __init__(self, triangles: np.ndarray, n: int, parts: SymmetricSweeps, quads: np.ndarray):
        self.parts, self.order = parts, FillOrder()
        self._pattern = RowPattern([triangles, quads], n)
        self._places: list[_BothPlaces] | None = None

    def hessian(
        self, faces: Elements, w: np.ndarray, weight, pressure, axes, symmetry: MirrorSymmetry | None = None
    ) -> Hessian:
        """The Hessian of the energy, see `hessian_blocks`."""
        give_back_of(len(w))
        gradient, rest, scale = np.zeros(len(w), complex), None, 0.0
        places, turned = self._places_of(faces, symmetry), _turned_vertices(axes, symmetry)

        def blocks() -> Iterator[tuple[BlockPlaces, np.ndarray]]:
            nonlocal rest, scale
            for (some, here, _, _), (lone, four) in zip(in_turn(faces, FEW_AT_ONCE), places, strict=True):
                of, kept = (x if np.ndim(x) == 0 else x[here] for x in (weight, pressure))
                found = _blocks_at_once(some, w, of, kept, (*axes, turned), symmetry, gradient)
                scale += found.scale
                rest = found.rest if rest is None else rest if found.rest is None else rest + found.rest
                if lone is not None:
                    yield lone, found.triangles
                if four is not None and found.quads is not None:
                    yield four, found.quads

        data = VertexRows.summed(self._pattern, blocks())
        gradient = gradient if symmetry is None else symmetry.folded(gradient)
        return Hessian(gradient, lambda diagonal, more: self._matrix(data, diagonal, more), rest, scale)

    def _places_of(self, faces: Elements, symmetry: MirrorSymmetry | None) -> Iterable[_BothPlaces]:
        """Where the blocks of the lone triangles and of the quads of some polygons after the others belong."""
        if self._places is not None:
            return self._places
        of_cells = self._pattern.places()

        def places(cells: np.ndarray) -> BlockPlaces | None:
            return of_cells(cells if symmetry is None else symmetry.representative[cells]) if len(cells) else None

        some = (given[0] for given in in_turn(faces, FEW_AT_ONCE))
        found = ((places(x.triangles[: lone_triangles(x)]), places(corners_of_quads(x))) for x in some)
        if len(self._pattern.order) > MOST_PLACED:
            return found
        self._places = list(found)
        return self._places

    def _matrix(self, data: np.ndarray, diagonal: np.ndarray, more: sp.spmatrix | None) -> VertexRows:
        rows = VertexRows(self._pattern, data, more)
        rows.add_diagonal(diagonal)
        return rows


@dataclass(frozen=True)
class Hessian:
    """Derivatives of the energy: gradient (n,) complex, what makes the matrix with a diagonal (2n,) and a sparse matrix
    (2n,2n) or None that are added to it, a sparse matrix of longer polygons or None, the mean of the diagonal."""

    gradient: np.ndarray
    matrix: Callable[[np.ndarray, sp.spmatrix | None], Matrix]
    rest: sp.spmatrix | None
    scale: float


@overload
def assembly_of(
    faces: Elements, n: int, parts: SymmetricSweeps, symmetry: MirrorSymmetry | None = None
) -> RowAssembly: ...
@overload
def assembly_of(
    faces: Elements,
    n: int,
    parts: AdditiveSchwarz | KeptFactor | None = None,
    symmetry: MirrorSymmetry | None = None,
) -> Assembly: ...
def assembly_of(
    faces: Elements, n: int, parts: Solver | None = None, symmetry: MirrorSymmetry | None = None
) -> Assembly | RowAssembly:
    """The assembly of the elements of a mesh of n vertices, of which some may follow others."""
    first = lone_triangles(faces)
    place = np.arange(n) if symmetry is None else symmetry.representative
    lone, four = place[faces.triangles[:first]], place[corners_of_quads(faces)]
    assembly: Assembly | RowAssembly
    if isinstance(parts, SymmetricSweeps):
        assembly = RowAssembly(lone, n, parts, four)
    else:
        assembly = Assembly(lone, n, parts, four)
    if symmetry is not None and n < LARGE:
        # The order of the mesh is no order of its half: folded, its separators are neighbours of both sides.
        vertices = minimum_degree(vertex_graph(place[faces.triangles], n))
        assembly.order = FillOrder((2 * vertices[:, None] + np.arange(2)).ravel())
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
    count, turned = len(faces.area), _turned_vertices(axes, symmetry)
    gradient, scale, rest = np.zeros(len(w), complex), 0.0, None
    if len(faces.triangles) <= 2 * AT_ONCE:
        found = _blocks_at_once(faces, w, weight, pressure, (*axes, turned), symmetry, gradient)
        return found if symmetry is None else replace(found, gradient=symmetry.folded(gradient))
    first = lone_triangles(faces)
    four = (len(faces.triangles) - first) // 4
    triangles, quads = np.empty((first, 6, 6)), np.empty((four, 8, 8))
    place = np.arange(len(w))
    for begin in range(0, count, AT_ONCE):
        some = np.zeros(count, bool)
        some[begin : begin + AT_ONCE] = True
        of, kept = (x if np.ndim(x) == 0 else x[some] for x in (weight, pressure))
        found = _blocks_at_once(restricted(faces, some, place), w, of, kept, (*axes, turned), symmetry, gradient)
        here = some if faces.polygon is None else some[faces.polygon]
        triangles[here[:first]] = found.triangles
        if found.quads is not None:
            quads[some[count - four :]] = found.quads
        scale += found.scale
        rest = found.rest if rest is None else rest if found.rest is None else rest + found.rest
    gradient = gradient if symmetry is None else symmetry.folded(gradient)
    return Blocks(gradient, triangles, None if faces.polygon is None else quads, rest, scale)


def _blocks_at_once(
    faces: Elements, w: np.ndarray, weight, pressure, axes, symmetry: MirrorSymmetry | None, gradient: np.ndarray
) -> Blocks:
    """As `hessian_blocks`, of all faces at once, which add their gradient to that of all vertices (n,) complex."""
    n, first, (frame, free, _) = len(w), lone_triangles(faces), axes
    eagerness = EAGERNESS * (1 - pressure)
    a, b = faces.derivatives(w)
    slopes, kept, radial = by_squares(faces, a, b, weight, pressure, eagerness)
    _add_at_vertices(gradient, faces, corner_slopes(faces, a, b, slopes))
    blocks = triangle_blocks(faces.gradient, a, b, kept, radial)
    vertex = _in_axes(blocks, faces.triangles, axes, symmetry)
    scale = float(np.einsum("iim->", blocks)) / (2 * n)
    if faces.polygon is None:
        return Blocks(gradient, blocks.transpose(2, 0, 1), None, None, scale)
    # A view would keep the blocks of all triangles of quads.
    lone = blocks[:, :, :first].copy().transpose(2, 0, 1)
    forms = area_forms_of(faces, a, b, weight, eagerness)
    if symmetry is not None:
        _, forms = symmetry.carried(faces.triangles, forms)
    area = np.ascontiguousarray((forms * frame[vertex]).conj()).view(float)
    area *= free[vertex].reshape(-1, 6)
    return Blocks(
        gradient=gradient,
        triangles=lone,
        quads=_summed_in_quads(blocks[:, :, first:].transpose(2, 0, 1), area[first:].reshape(-1, 4, 6)),
        rest=long_forms(faces, vertex, area[:first], n),
        scale=scale,
    )


def _add_at_vertices(total: np.ndarray, faces: Elements, corner: np.ndarray) -> None:
    """Add corner values (m,3) complex to those of their vertices (n,)."""
    n, flat = len(total), faces.triangles.ravel()
    if n <= 2 * len(flat):
        total += sum_at_vertices(faces, corner, n)
        return
    # Of few of many vertices: sums of the others would take longer than all else.
    seen, place = np.zeros(n, bool), np.empty(n, np.int32)
    seen[flat] = True
    used = np.flatnonzero(seen)
    place[used] = np.arange(len(used))
    local = place[flat]
    total[used] += np.bincount(local, corner.real.ravel()) + 1j * np.bincount(local, corner.imag.ravel())


def triangle_blocks(gradient: np.ndarray, a: np.ndarray, b: np.ndarray, kept, radial) -> np.ndarray:
    """Blocks (6,6,m) of triangles with the hat gradients (m,3) and the derivatives a, b (m,) of the map, complex.

    They are the sums of the squares of the rows of `energy.face_derivatives_of`, whose `kept` and `block` are kept and
    radial here, in a quarter of the time: what two corners share takes a step z of the one to X z + Y conj(z), with X
    and Y linear in the products of their gradients, and there are no rows.
    """
    blocks = np.empty((6, 6, len(a)))
    for begin in range(0, len(a), CHUNK):
        here = slice(begin, begin + CHUNK)
        some = (tuple(x[here] for x in given) for given in (kept, radial))
        _fill_blocks(blocks[:, :, here], gradient[here], a[here], b[here], *some)
    return blocks


def _fill_blocks(blocks: np.ndarray, gradient, a, b, kept, radial) -> None:
    """`triangle_blocks` of some triangles, written to blocks (6,6,m)."""
    unit_a, unit_b = unit(a), unit(b)
    turn_a, turn_b = (np.maximum(2 * h, 0) for h in kept)
    aa, ab, bb = without_negative(*radial)
    even, odd = (aa + turn_a) / 8, (bb + turn_b) / 8
    beta, delta = (aa - turn_a) / 8 * unit_a**2, ((bb - turn_b) / 8 * unit_b**2).conj()
    mixed, crossed = ab / 4 * (unit_a * unit_b.conj()), ab / 4 * (unit_a * unit_b)
    both, apart = beta + delta, beta - delta
    # What the sum, the difference and the cross terms of the products of two gradients count in each entry.
    first = even + odd + crossed.real, mixed.real + both.real, -mixed.imag - both.imag
    second = even + odd - crossed.real, mixed.real - both.real, both.imag - mixed.imag
    skew, turn = (crossed.imag, apart.imag, apart.real), even - odd
    x, y = gradient.real.T.copy(), gradient.imag.T.copy()
    for i in range(3):
        for j in range(i, 3):
            xx, yy, xy, yx = x[i] * x[j], y[i] * y[j], x[i] * y[j], y[i] * x[j]
            products = xx + yy, xx - yy, xy + yx
            uu, vv, mean = (
                given[0] * products[0] + given[1] * products[1] + given[2] * products[2]
                for given in (first, second, skew)
            )
            turned = turn * (yx - xy)
            for p, q, entry in ((0, 0, uu), (1, 1, vv), (0, 1, mean - turned), (1, 0, mean + turned)):
                blocks[2 * i + p, 2 * j + q] = entry
                blocks[2 * j + q, 2 * i + p] = entry


def _turned_vertices(axes: tuple[np.ndarray, np.ndarray], symmetry: MirrorSymmetry | None) -> np.ndarray | None:
    """Which vertices (n,) bool have other axes than those of the plane, or follow another; None where none does."""
    frame, free = axes
    plain = (frame == 1) & free.all(axis=1)
    if symmetry is not None:
        plain = plain[symmetry.representative] & ~symmetry.flip & (symmetry.factor == 1)
    return None if plain.all() else ~plain


def _in_axes(blocks: np.ndarray, triangles: np.ndarray, axes, symmetry: MirrorSymmetry | None) -> np.ndarray:
    """Bring blocks (6,6,m) of triangles (m,3), in place, into the axes of their vertices, or of those these follow;
    these vertices (m,3)."""
    frame, free, others = axes
    found = triangles if symmetry is None else symmetry.representative[triangles]
    if others is None:
        return found
    for k, vertices in enumerate(triangles.T):
        turned = np.flatnonzero(others[vertices])
        # Rows of linear forms that say 1 and i, as forms of the steps along the axes.
        corner, forms = vertices[turned, None], np.tile(np.array([[1], [-1j]]), (len(turned), 1, 1))
        if symmetry is not None:
            corner, forms = symmetry.carried(corner, forms)
        forms = (forms * frame[corner][:, None])[:, :, 0]
        first, second = (np.stack([forms.real, -forms.imag], axis=2) * free[corner]).transpose(1, 2, 0)
        for part in (blocks[2 * k : 2 * k + 2], blocks[:, 2 * k : 2 * k + 2].swapaxes(0, 1)):
            u, v = (np.take(rows, turned, axis=1) for rows in part)
            for q in range(2):
                part[q][:, turned] = first[q] * u + second[q] * v
    return found


def _summed_in_quads(blocks: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Blocks (q,8,8) of quads from those (4q,6,6) of their triangles, and their parts (q,4,6) of the area's row."""
    columns = (2 * BOTH[:, :, None] + [0, 1]).reshape(4, 6)
    row = np.zeros((len(area), 8))
    for k in range(4):
        row[:, columns[k]] += area[:, k]
    found = row[:, :, None] * row[:, None]
    for k in range(4):
        found[:, columns[k][:, None], columns[k]] += blocks[k::4]
    return found


def quad_blocks(rows: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Blocks (q,8,8) from the rows (q,4,4,6) of four triangles each, and their parts (q,4,6) of the area's row."""
    rows = rows.reshape(-1, 4, 6)
    return _summed_in_quads(np.matmul(rows.transpose(0, 2, 1), rows), area)


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
