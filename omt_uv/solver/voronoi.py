"""Voronoi cells of the vertices of a Delaunay mesh in space, read off its triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Share of a third of the adjacent area that a cell has at least.
LEAST = 0.2


@dataclass(frozen=True)
class Cells:
    """Mass (n,), first moment about the vertex (n,3) and energy of the Voronoi cells."""

    mass: np.ndarray
    moment: np.ndarray
    energy: float


def voronoi_cells(points: np.ndarray, triangles: np.ndarray, density: np.ndarray) -> Cells:
    """Cells of a Delaunay mesh (n,3), (m,3) with density (n,) at the vertices, geometric means in between.

    Every triangle is parted by the lines from its circumcentre to the middles of its sides, with signs where the
    circumcentre lies outside.
    """
    p, rho = points[triangles], density[triangles]
    e = p[:, [1, 2, 0]] - p
    square = np.einsum("mki,mki->mk", e, e)
    normal = np.cross(e[:, 0], -e[:, 2])
    double = np.sqrt(np.einsum("mi,mi->m", normal, normal))
    normal = normal / np.maximum(double, 1e-300)[:, None]
    # Barycentric coordinates of the circumcentre, from the sides opposite to the corners.
    a = square[:, [1, 2, 0]]
    w = a * (a.sum(axis=1, keepdims=True) - 2 * a)
    total = w.sum(axis=1, keepdims=True)
    # A triangle without area has no circumcentre.
    w = np.where(total > 1e-12 * a.max(axis=1, keepdims=True) ** 2, w / np.maximum(total, 1e-300), 1 / 3)
    w = np.clip(w, -1, 2)
    w = w / w.sum(axis=1, keepdims=True)
    centre = np.einsum("mk,mki->mi", w, p)
    # Geometric means in between: where a long edge leads from many small cells to a few large ones, the arithmetic mean
    # would say that half of it belongs to the small ones, and these would draw vertices from the large.
    log_rho = np.log(rho)
    middle_rho = np.exp(log_rho.mean(axis=1))
    n = len(points)
    mass, moment, energy = np.zeros(n), np.zeros((n, 3)), 0.0
    v = centre[:, None] - p
    for far, sign in ((1, 1.0), (2, -1.0)):
        u = (e if far == 1 else -e[:, [2, 0, 1]]) / 2
        side_rho = np.exp((log_rho + log_rho[:, [1, 2, 0] if far == 1 else [2, 0, 1]]) / 2)
        area = 0.5 * sign * np.einsum("mki,mi->mk", np.cross(u, v), normal)
        total = rho + side_rho + middle_rho[:, None]
        part = (area / 12)[..., None] * (
            u * (total + side_rho)[..., None] + v * (total + middle_rho[:, None])[..., None]
        )
        second = area / 6 * (np.einsum("mki,mki->mk", u, u) + np.einsum("mki,mki->mk", u, v) + (v**2).sum(-1))
        energy += float((second * total / 3).sum())
        flat = triangles.ravel()
        mass += np.bincount(flat, (area * total / 3).ravel(), n)
        for k in range(3):
            moment[:, k] += np.bincount(flat, part[..., k].ravel(), n)
    # Where flips could not reach Delaunay cells may be small, or less than nothing: a step must not divide by that.
    usual = np.bincount(triangles.ravel(), np.repeat(double / 6 * middle_rho, 3), n)
    return Cells(np.maximum(mass, np.maximum(LEAST * usual, 1e-9 * usual.mean())), moment, energy)
