"""Measure the Voronoi cells of a Delaunay mesh in space, read off its triangles.

The parts into which perpendicular bisectors cut a triangle are those of Meyer, Desbrun, Schroeder, Barr 2003, with
signs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Share of a third of the adjacent mass that a cell has at least.
MIN_SHARE = 0.2


@dataclass(frozen=True)
class VoronoiCells:
    """Mass (n,), first moment about the vertex (n,3) and energy of the Voronoi cells."""

    mass: np.ndarray
    moment: np.ndarray
    energy: float


def voronoi_cells(
    points: np.ndarray, triangles: np.ndarray, density: np.ndarray, delaunay: bool = True
) -> VoronoiCells:
    """Measure the cells of a Delaunay mesh (n,3), (m,3) with density (n,) at the vertices, geometric means in between.

    Every triangle is parted by the lines from its circumcentre to the middles of its sides, with signs where the
    circumcentre lies outside: each end of a side has half of the side's triangle with the circumcentre. Where the mesh
    is not `delaunay` these are no cells, and the centroid takes the place of the circumcentre.
    """
    n, corner = len(points), triangles.T
    # Coordinates apart from each other, and corners: (3,3,m). Many small arrays of threes would take twice the time.
    p = np.take(points.T, corner, axis=1).transpose(1, 0, 2)
    side = p[[2, 0, 1]] - p[[1, 2, 0]]
    square = _dot(side, side)
    double = np.sqrt(_cross_square(side[0], side[1]))
    w = _circumcentre(square) if delaunay else np.full(square.shape, 1 / 3)
    centre = sum(w[k] * p[k] for k in range(3))
    rho = density.take(corner)
    # Geometric means: where a long edge leads from many small cells to a few large ones, the arithmetic mean
    # would say that half of it belongs to the small ones, and these would draw vertices from the large.
    split_ends, middle = np.sqrt(rho[[1, 2, 0]] * rho[[2, 0, 1]]), np.cbrt(rho[0] * rho[1] * rho[2])
    half = w * (double / 4)
    mass, moment, energy = np.zeros_like(square), np.zeros_like(p), 0.0
    for i in range(3):
        v = centre - p[i]
        far = _dot(v, v)
        for k, sign in (((i + 1) % 3, -0.5), ((i + 2) % 3, 0.5)):
            u, area, total = sign * side[k], half[k], rho[i] + split_ends[k] + middle
            mass[i] += area * total / 3
            moment[i] += area / 12 * ((total + split_ends[k]) * u + (total + middle) * v)
            energy += float((area / 18 * total) @ (square[k] / 4 + _dot(u, v) + far))
    flat = corner.ravel()
    sums = [np.bincount(flat, moment[:, k].ravel(), n) for k in range(3)]
    # Where flips could not reach Delaunay cells may be small, or less than nothing: a step must not divide by that.
    typical = np.bincount(flat, np.tile(double / 6 * middle, 3), n)
    cells = np.bincount(flat, mass.ravel(), n)
    return VoronoiCells(
        np.maximum(cells, np.maximum(MIN_SHARE * typical, 1e-9 * typical.mean())), np.stack(sums, axis=1), energy
    )


def _circumcentre(square: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (3,m) of the circumcentres, from the squares of the sides opposite to the corners."""
    w = square * (square.sum(axis=0) - 2 * square)
    total = w.sum(axis=0)
    # A triangle without area has no circumcentre.
    w = np.where(total > 1e-12 * square.max(axis=0) ** 2, w / np.maximum(total, 1e-300), 1 / 3)
    w = np.clip(w, -1, 2)
    return w / w.sum(axis=0)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (..., m) of vectors (..., 3, m)."""
    return np.einsum("...im,...im->...m", a, b)


def _cross_square(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Squared length (m,) of the cross product of vectors (3,m)."""
    x, y, z = (a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1)))
    return x * x + y * y + z * z
