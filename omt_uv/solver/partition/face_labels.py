"""Give whole polygons to the cells of a division, each cell in one piece."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix

from ..mesh.topology import pair_keys, pair_up
from .cut_mesh import face_pieces, polygon_edges
from .division import Division


@dataclass(frozen=True)
class FaceCells:
    """cell (f,) of every polygon; mass (k,) of the polygons of every cell; empty: cells without one; torn: cells in
    several pieces"""

    cell: np.ndarray
    mass: np.ndarray
    empty: np.ndarray
    torn: np.ndarray


def follow_faces(division: Division, owner: np.ndarray, corner_vertex: np.ndarray, face_start: np.ndarray) -> FaceCells:
    """The cell that has the greatest share of each polygon, so that cells hang together where the division's do.

    owner (m,): polygon of every triangle; corner_vertex (c,), face_start (f+1,): the polygons
    """
    cells, pairs = division.cells, division.pairs
    f, k = len(face_start) - 1, len(division.asked)
    face, cell = owner[pairs.face[cells.pair]], pairs.site[cells.pair]
    # Pieces without area count a little, so that every polygon has a cell.
    floor = 1e-12 * division.asked.min()
    share = coo_matrix((cells.part + floor, (face, cell)), shape=(f, k)).tocsr()
    row = np.repeat(np.arange(f), np.diff(share.indptr))
    order = np.lexsort((share.data, row))
    last = np.flatnonzero(np.r_[row[order][1:] != row[order][:-1], True])
    label = np.full(f, -1)
    label[row[order[last]]] = share.indices[order[last]]
    mass = np.bincount(face, cells.part, f)
    label = _joined(label, mass, corner_vertex, face_start)
    _, pieces = face_pieces(corner_vertex, face_start, label)
    several = np.bincount(np.unique(np.stack([label, pieces], axis=1), axis=0)[:, 0], minlength=k)
    return FaceCells(label, np.bincount(label, mass, k), np.flatnonzero(several == 0), np.flatnonzero(several > 1))


def _joined(label: np.ndarray, mass: np.ndarray, corner_vertex: np.ndarray, face_start: np.ndarray) -> np.ndarray:
    """Labels (f,) where the lesser pieces of every cell have gone to their neighbours, ring by ring."""
    count, piece = face_pieces(corner_vertex, face_start, label)
    weight = np.bincount(piece, mass + 1e-300, count)
    of = np.zeros(count, np.int64)
    of[piece] = label
    order = np.lexsort((weight, of))
    main = np.zeros(count, bool)
    main[order[np.r_[of[order][1:] != of[order][:-1], True]]] = True
    found = np.where(main[piece], label, -1)
    a, b, polygon = polygon_edges(corner_vertex, face_start)
    first, second = pair_up(pair_keys(a, b))
    i, j = np.r_[polygon[first], polygon[second]], np.r_[polygon[second], polygon[first]]
    while True:
        free = (found[i] < 0) & (found[j] >= 0)
        if not free.any():
            # What touches nobody keeps its label, and is told as torn.
            return np.where(found < 0, label, found)
        found[i[free]] = found[j[free]]
