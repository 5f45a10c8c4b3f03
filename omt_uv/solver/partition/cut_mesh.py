"""Cut the triangles of a mesh along the cells of a division: a mesh whose faces belong to one cell each.

A point of the cut mesh is a vertex, or lies on an edge where two cells meet, or in a triangle where three do: that
names it, so that triangles agree about their points without comparing places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.topology import graph_components, next_corners, pair_keys
from .division import Division


@dataclass(frozen=True)
class CellMesh:
    """CellPieces that tile a mesh and belong to one cell each.

    positions (n,3); corner_vertex (c,), face_start (f+1,) as in `mesh.surface.Surface`; cell (f,), triangle (f,): what
    every face belongs to; barycentric (c,3): of every corner in its face's triangle; halfedge (c,): 3 t + k where the
    edge that starts there lies on side k of the triangle t, -1 where it parts cells
    """

    positions: np.ndarray
    corner_vertex: np.ndarray
    face_start: np.ndarray
    cell: np.ndarray
    triangle: np.ndarray
    barycentric: np.ndarray
    halfedge: np.ndarray

    def torn(self) -> np.ndarray:
        """Cells (k,) in several pieces, joined along edges."""
        count, label = face_pieces(self.corner_vertex, self.face_start, self.cell)
        pieces = np.unique(np.stack([self.cell, label], axis=1), axis=0)[:, 0]
        return np.flatnonzero(np.bincount(pieces, minlength=int(self.cell.max()) + 1) > 1)


def face_pieces(corner_vertex: np.ndarray, face_start: np.ndarray, cell: np.ndarray) -> tuple[int, np.ndarray]:
    """Pieces (f,) of polygons of the same cell (f,) that hang together across edges, and how many; corners (c,),
    face_start (f+1,)."""
    a, b, owner = polygon_edges(corner_vertex, face_start)
    # Two at an edge of many faces are enough to join them: those next to one another in the order of their cells.
    key = pair_keys(a, b)
    order = np.lexsort((cell[owner], key))
    i, j = order[:-1], order[1:]
    same = (key[i] == key[j]) & (cell[owner[i]] == cell[owner[j]])
    return graph_components(owner[i[same]], owner[j[same]], len(cell))


def polygon_edges(corner_vertex: np.ndarray, face_start: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tail, head and polygon (c,) of the edge that starts at every corner (c,) of polygons with face_start (f+1,)."""
    size = np.diff(face_start)
    return corner_vertex, corner_vertex[next_corners(face_start)], np.repeat(np.arange(len(size)), size)


def cut_along_cells(positions: np.ndarray, triangles: np.ndarray, division: Division) -> CellMesh:
    """The mesh (n,3), (m,3) of a division, cut along its cells; triangles without area stay out of it.

    >>> import numpy as np
    >>> from omt_uv.solver.partition import cut_along_cells, divide
    >>> from omt_uv.solver.progress import drain
    >>> square, two = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    >>> mesh = cut_along_cells(square, two, drain(divide(square, two, 3)))
    >>> sorted(set(mesh.cell.tolist())), len(mesh.torn())
    ([0, 1, 2], 0)
    """
    pairs, cells = division.pairs, division.cells
    polygons = cells.polygons
    row, slot = np.nonzero(polygons.used())
    before = (slot - 1) % polygons.count[row]
    sides = np.sort(np.stack([polygons.label[row, before], polygons.label[row, slot]], axis=1), axis=1)
    face, cell = pairs.face[cells.pair], pairs.site[cells.pair]
    vertex = _named(triangles, face[row], cell[row], sides)
    s, t = polygons.points[row, slot].T
    barycentric = np.stack([s, t, 1 - s - t], axis=1)
    # Points in a row of a sliver may be one.
    again = (vertex == vertex[_behind(row)]) & (np.bincount(row)[row] > 1)
    keep = ~again
    size = np.bincount(row[keep], minlength=len(cell))
    keep &= (size >= 3)[row]
    faces = np.flatnonzero(size >= 3)
    names, first, corner_vertex = np.unique(vertex[keep], return_index=True, return_inverse=True)
    corner_barycentric = barycentric[keep]
    own = triangles[face[row[keep][first]]]
    label = polygons.label[row, slot][keep]
    places = np.einsum("kc,kcd->kd", corner_barycentric[first], positions[own])
    return CellMesh(
        positions=places,
        corner_vertex=corner_vertex.ravel(),
        face_start=np.r_[0, np.cumsum(size[faces])],
        cell=cell[faces],
        triangle=face[faces],
        barycentric=corner_barycentric,
        halfedge=np.where(label < 0, 3 * face[row[keep]] - label - 1, -1),
    )


def _behind(row: np.ndarray) -> np.ndarray:
    """The place before each (k,) in its row, the last one for the first; rows (k,) ascend."""
    first = np.flatnonzero(np.r_[True, row[1:] != row[:-1]])
    behind = np.arange(len(row)) - 1
    behind[first] = np.r_[first[1:], len(row)] - 1
    return behind


def _named(triangles: np.ndarray, face: np.ndarray, cell: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """A number (k,) for each point of polygons, the same for what is one point; vertices keep theirs.

    face (k,), cell (k,): of the polygon; sides (k,2), ascending: labels of the two that meet there
    """
    inner = sides >= 0
    corner = ~inner.any(axis=1)
    on_edge = inner.sum(axis=1) == 1
    # A side -k starts at the corner k - 1.
    tail = np.where(sides < 0, -sides - 1, 0)
    name = np.zeros((len(face), 4), np.int64)
    # Corner 0 is between the sides -1 and -3, the others between two that follow each other.
    which = np.where((sides[:, 0] == -3) & (sides[:, 1] == -1), 0, tail.max(axis=1))
    name[corner, 0] = triangles[face[corner], which[corner]]
    a = triangles[face[on_edge], tail[on_edge, 0]]
    b = triangles[face[on_edge], (tail[on_edge, 0] + 1) % 3]
    other = sides[on_edge, 1]
    name[on_edge] = np.stack(
        [-1 - np.minimum(a, b), np.maximum(a, b), np.minimum(cell[on_edge], other), np.maximum(cell[on_edge], other)],
        axis=1,
    )
    within = inner.all(axis=1)
    three = np.sort(np.column_stack([cell[within], sides[within]]), axis=1)
    n = int(triangles.max()) + 1
    name[within] = np.column_stack([-1 - n - face[within], three])
    return np.unique(name, axis=0, return_inverse=True)[1].ravel()
