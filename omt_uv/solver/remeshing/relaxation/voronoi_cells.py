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
    """Mass (n,), first moment about the vertex (n,3) and energy of the Voronoi cells, and the shortest side of every
    triangle (m,)."""

    mass: np.ndarray
    moment: np.ndarray
    energy: float
    shortest: np.ndarray


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
    w, double = _circumcentre(square)
    if not delaunay:
        w = np.full(square.shape, 1 / 3)
    if np.ptp(density):
        mass, moment, energy, middle = _parts(side, square, w, double, density.take(corner))
    else:
        middle = np.full_like(double, density[0])
        mass, moment, energy = _even_parts(side, square, w, double, float(density[0]))
    flat = corner.ravel()
    sums = [np.bincount(flat, moment[:, k].ravel(), n) for k in range(3)]
    # Where flips could not reach Delaunay cells may be small, or less than nothing: a step must not divide by that.
    typical = np.bincount(flat, np.tile(double / 6 * middle, 3), n)
    cells = np.bincount(flat, mass.ravel(), n)
    return VoronoiCells(
        np.maximum(cells, np.maximum(MIN_SHARE * typical, 1e-9 * typical.mean())),
        np.stack(sums, axis=1),
        energy,
        np.sqrt(np.minimum.reduce(square)),
    )


def _parts(
    side: np.ndarray, square: np.ndarray, w: np.ndarray, double: np.ndarray, rho: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """Mass (3,m) and moment (3,3,m) of what each corner has of its triangle, their energy, and the density in the
    middle (m,); sides (3,3,m) opposite to the corners with their squares (3,m), shares w (3,m) of the centre, twice the
    areas (m,), densities (3,m)."""
    # Geometric means: where a long edge leads from many small cells to a few large ones, the arithmetic mean
    # would say that half of it belongs to the small ones, and these would draw vertices from the large.
    middle, half = np.cbrt(rho[0] * rho[1] * rho[2]), w * (double / 4)
    mass, moment, energy = np.empty_like(square), np.empty_like(side), 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        between = (square[j] + square[k] - square[i]) / 2
        # Of the ways from the corner to the others and, with the shares w, to the centre: e_j, e_k, w_j e_j + w_k e_k.
        far = w[j] ** 2 * square[k] + w[k] ** 2 * square[j] + 2 * w[j] * w[k] * between
        along, mass[i], to_centre = [], 0, 0
        for a, b in ((j, k), (k, j)):
            # The part at the side to corner a, which is opposite to b.
            split = np.sqrt(rho[i] * rho[a])
            total = rho[i] + split + middle
            mass[i] += half[b] * (total / 3)
            along.append(half[b] * ((total + split) / 24))
            to_centre = to_centre + half[b] * ((total + middle) / 12)
            reach = square[b] * ((1 + 2 * w[a]) / 4) + w[b] / 2 * between + far
            energy += float((half[b] * total) @ reach) / 18
        moment[i] = (along[0] + to_centre * w[j]) * side[k] - (along[1] + to_centre * w[k]) * side[j]
    return mass, moment, energy, middle


def _even_parts(
    side: np.ndarray, square: np.ndarray, w: np.ndarray, double: np.ndarray, rho: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Mass, moment and energy as of `_parts` where the density is the same everywhere: two ends of a side have as much
    of its triangle, and what depends on where on the side they are cancels."""
    half = w * (double * (rho / 4))
    mass, moment, energy = np.empty_like(square), np.empty_like(side), 0.0
    far = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        between = square[j] + square[k] - square[i]
        far.append(w[j] ** 2 * square[k] + w[k] ** 2 * square[j] + w[j] * w[k] * between)
        np.add(half[j], half[k], out=mass[i])
        to_centre = mass[i] / 3
        moment[i] = (half[k] / 6 + to_centre * w[j]) * side[k] - (half[j] / 6 + to_centre * w[k]) * side[j]
    for i in range(3):
        energy += float(half[i] @ (square[i] + far[(i + 1) % 3] + far[(i + 2) % 3])) / 6
    return mass, moment, energy


def _circumcentre(square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (3,m) of the circumcentres, from the squares of the sides opposite to the corners, and
    twice the areas (m,)."""
    w = square * (square.sum(axis=0) - 2 * square)
    # By Heron's formula the square of four times the area.
    total = w.sum(axis=0)
    double = np.sqrt(np.maximum(total, 0)) / 2
    # A triangle without area has no circumcentre.
    w = np.where(total > 1e-12 * square.max(axis=0) ** 2, w / np.maximum(total, 1e-300), 1 / 3)
    w = np.clip(w, -1, 2)
    return w / w.sum(axis=0), double


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (..., m) of vectors (..., 3, m)."""
    return np.einsum("...im,...im->...m", a, b)
