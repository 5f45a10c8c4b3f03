"""Make a grid of quads a rectangle whose rows and columns have their areas: of a strip, every quad has its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from ..errors import GridError
from ..mesh.topology import graph_components, pair_keys


@dataclass(frozen=True)
class GridRectangle:
    """uv (n,2) of the vertices, from the origin, of the area of the surface; how many columns and rows of quads."""

    uv: np.ndarray
    columns: int
    rows: int


def rectangle(V: np.ndarray, quads: np.ndarray, areas: np.ndarray) -> GridRectangle:
    """Lay a grid of quads out as a rectangle.

    Opposite edges of a quad run the same way; edges that run the same way and follow one another are a line of the
    grid. Column j is as wide as its share of the area, and so is row i: areas of quads are w_j h_i, exact where there
    is one row, and otherwise the nearest with these sums (the independence table of the areas).

    Parameters
    ----------
    V : (n,3) positions; quads : (f,4) vertices in turn; areas : (f,) of the quads

    Raises
    ------
    GridError : the quads are no grid, or form a ring

    Examples
    --------
    >>> import numpy as np
    >>> V = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0], [0, 1, 0], [1, 1, 0], [3, 1, 0.0]])
    >>> found = rectangle(V, np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), np.array([1.0, 2.0]))
    >>> found.columns * found.rows, sorted(np.ptp(found.uv, axis=0).round(6).tolist())
    (2, [1.0, 3.0])
    """
    ends = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    keys, first, edge = np.unique(pair_keys(ends[:, 0], ends[:, 1]), return_index=True, return_inverse=True)
    edge = edge.reshape(-1, 4)
    low, high = ends.min(axis=1), ends.max(axis=1)
    way = _directions(edge, len(keys))
    across = way[edge.ravel()] == 0
    n = len(V)
    place = np.stack([_lines(low, high, across, n), _lines(low, high, ~across, n)], axis=1)
    cell = place[quads].min(axis=1)
    columns, rows = (int(k) for k in cell.max(axis=0) + 1)
    if len(np.unique(cell, axis=0)) != len(quads) or columns * rows != len(quads) or n != (columns + 1) * (rows + 1):
        raise GridError("The quads of an island are not in rows and columns")
    total = float(areas.sum())
    # Every edge once, whether one quad has it or two.
    length = np.linalg.norm(V[low[first]] - V[high[first]], axis=1)
    # Edges of a way, along which the other coordinate grows.
    wide, tall = (max(float(length[mine].sum()), 1e-300) for mine in (way != 0, way == 0))
    aspect = (wide / (rows + 1)) / (tall / (columns + 1))
    size = np.sqrt(total * np.array([aspect, 1 / aspect]))
    uv = np.empty((n, 2))
    for axis in (0, 1):
        share = np.bincount(cell[:, axis], areas) / total
        uv[:, axis] = (size[axis] * np.concatenate([[0.0], np.cumsum(share)]))[place[:, axis]]
    return GridRectangle(uv, columns, rows)


def _directions(edge: np.ndarray, count: int) -> np.ndarray:
    """Which of two ways (count,) every edge runs: opposite edges (f,4) of a quad the same, neighbours the other."""
    ring = graph_components(np.concatenate([edge[:, 0], edge[:, 1]]), np.concatenate([edge[:, 2], edge[:, 3]]), count)[
        1
    ]
    one, other = ring[edge[:, 0]], ring[edge[:, 1]]
    rings = int(ring.max()) + 1
    crossing = sparse.coo_matrix((np.ones(len(one)), (one, other)), (rings, rings))
    steps = csgraph.shortest_path(crossing.tocsr(), directed=False, unweighted=True, indices=0)
    if not np.isfinite(steps).all() or (steps[one] % 2 == steps[other] % 2).any():
        raise GridError("The quads of an island are not in rows and columns")
    return (steps[ring] % 2).astype(int)


def _lines(low: np.ndarray, high: np.ndarray, along: np.ndarray, n: int) -> np.ndarray:
    """Number (n,) of the line of edges `along` on which each vertex lies, counted across from one side."""
    line = graph_components(low[along], high[along], n)[1]
    count = int(line.max()) + 1
    tail, head = line[low[~along]], line[high[~along]]
    beside = sparse.coo_matrix((np.ones(len(tail)), (tail, head)), (count, count)).tocsr()
    beside = ((beside + beside.T) > 0).astype(float)
    degree = np.asarray(beside.sum(axis=1)).ravel()
    sides = np.flatnonzero(degree == 1)
    if len(sides) != 2 or degree.max() > 2 or (tail == head).any():
        raise GridError("The quads of an island form a ring, or are not in rows and columns")
    number = csgraph.shortest_path(beside, directed=False, unweighted=True, indices=int(sides[0]))
    if not np.isfinite(number).all():
        raise GridError("The quads of an island are not in rows and columns")
    return number.astype(int)[line]
