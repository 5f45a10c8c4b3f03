"""Find the aspect of the rectangle that a disk with four corners fills by itself: the energy of a harmonic function."""

from __future__ import annotations

import numpy as np
from scipy.sparse import diags_array

from ..conformal.disk_map import boundary_turns, sharpest_corners
from ..linalg.sparse import Factor
from ..mesh.geometry import cotangent_laplacian
from ..mesh.topology import boundary_loops

RIDGE = 1e-12
# Corners of a strap are at least this share of the boundary apart, and turn by more than this angle.
NEAR = 1 / 200
SHARP = np.pi / 6


def rectangle_corners(vertices: np.ndarray, triangles: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Four vertices (4,) of the boundary loop (b,) of a disk (n,3), (m,3) for the corners of a rectangle.

    Straps have corners near to each other. Where the boundary does not turn sharply at four places, those that stand
    farther apart are better.
    """
    near = sharpest_corners(vertices, triangles, loop, NEAR)
    turn = boundary_turns(vertices, triangles, loop)[np.isin(loop, near)]
    return near if turn.min() > SHARP else sharpest_corners(vertices, triangles, loop)


def natural_aspect(vertices: np.ndarray, triangles: np.ndarray, corners: np.ndarray) -> float:
    """Height over width of the rectangle to which a disk (n,3), (m,3) with corners (4,) of its boundary is conformal.

    The function that is 0 on the left side, 1 on the right one and harmonic has this Dirichlet energy; the sides above
    and below are free, and have slope 0 across. The corners go counter-clockwise from the lower left.

    >>> square = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0.5, 0]], float)
    >>> fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> round(natural_aspect(square, fan, np.arange(4)), 6)
    0.5
    """
    loop = boundary_loops(triangles)[0]
    loop = np.roll(loop, -int(np.flatnonzero(loop == corners[0])[0]))
    n = len(vertices)
    place = np.zeros(n, np.int64)
    place[loop] = np.arange(len(loop))
    _, right, upper, left = place[corners]
    x, fixed = np.zeros(n), np.zeros(n, bool)
    x[loop[right : upper + 1]] = 1
    fixed[loop[right : upper + 1]] = True
    fixed[np.append(loop[left:], loop[0])] = True
    laplacian = cotangent_laplacian(vertices, triangles)
    if not fixed.all():
        # What hangs by faces without area alone would have no place.
        laplacian = laplacian + RIDGE * diags_array(np.maximum(laplacian.diagonal(), 1)).tocsr()
        rows = laplacian[~fixed]
        x[~fixed] = Factor(rows[:, ~fixed].tocsc()).solve(-(rows @ x))
    return float(x @ (laplacian @ x))
