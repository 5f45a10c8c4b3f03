"""Centroidal Voronoi tessellation of a surface, without cuts: every vertex to the centroid of its cell.

The energy is the integral of density^2 |x - x_i|^2 over the cells (Du, Faber, Gunzburger 1999): with the square of the
density, cells in the plane get areas inverse to the density. Cells are read off the Delaunay triangulation of the
vertices, the energy is lowered by L-BFGS (Liu, Wang, Levy, Sun, Yan, Lu, Yang 2009), and after every step the vertices
go back to the surface.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from .closest import Carrier, vertex_normals
from .embedded_flips import make_delaunay_embedded
from .geometry import vertex_areas
from .progress import Progress, Steps
from .topology import twins

MEMORY = 7
# No vertex moves farther in one step, in shares of its shortest edge's length.
REACH = 0.4
# The share of the surface's area that the mesh cuts off changes slowly.
LIFT_EVERY = 10
# Area of the surface over area of the mesh from which, and at which fully, samples of the surface are trusted.
UNSEEN = (1.1, 1.3)


@dataclass(frozen=True)
class Cells:
    """Mass (n,), first moment about the vertex (n,3) and energy of the Voronoi cells."""

    mass: np.ndarray
    moment: np.ndarray
    energy: float


def voronoi_cells(points: np.ndarray, triangles: np.ndarray, density: np.ndarray) -> Cells:
    """Cells of a Delaunay mesh (n,3), (m,3) with density (n,) at the vertices, linear in between.

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
    w = np.clip(w / np.maximum(w.sum(axis=1, keepdims=True), 1e-300), -1, 2)
    w = w / w.sum(axis=1, keepdims=True)
    centre = np.einsum("mk,mki->mi", w, p)
    middle_rho = rho.mean(axis=1)
    n = len(points)
    mass, moment, energy = np.zeros(n), np.zeros((n, 3)), 0.0
    v = centre[:, None] - p
    for far, sign in ((1, 1.0), (2, -1.0)):
        u = (e if far == 1 else -e[:, [2, 0, 1]]) / 2
        side_rho = (rho + rho[:, [1, 2, 0] if far == 1 else [2, 0, 1]]) / 2
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
    return Cells(mass, moment, energy)


class Descent:
    """Directions of L-BFGS (Nocedal, Wright 2006, algorithm 7.4), started from Lloyd's step in every round."""

    def __init__(self):
        self.pairs: deque = deque(maxlen=MEMORY)
        self.last: tuple[np.ndarray, np.ndarray] | None = None

    def reset(self) -> None:
        self.pairs.clear()
        self.last = None

    def direction(self, x: np.ndarray, gradient: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
        """Step (n,3) from x (n,3) against the gradient; diagonal (n,1) of the inverse Hessian to start from."""
        if self.last is not None:
            s, y = x - self.last[0], gradient - self.last[1]
            product = float((s * y).sum())
            if product > 1e-12 * np.sqrt(float((s * s).sum() * (y * y).sum())):
                self.pairs.append((s, y, 1 / product))
        self.last = (x.copy(), gradient.copy())
        q, alphas = gradient.copy(), []
        for s, y, r in reversed(self.pairs):
            alphas.append(r * float((s * q).sum()))
            q -= alphas[-1] * y
        q = diagonal * q
        for (s, y, r), alpha in zip(self.pairs, reversed(alphas), strict=True):
            q += (alpha - r * float((y * q).sum())) * s
        return -q


def relax(
    points: np.ndarray,
    triangles: np.ndarray,
    fixed: np.ndarray,
    locked: np.ndarray,
    rounds: int,
    carrier: Carrier,
) -> Steps[tuple[np.ndarray, np.ndarray, float]]:
    """Relax a mesh (n,3), (m,3) on a surface; points, triangles and the last mean step in edge lengths.

    Parameters
    ----------
    fixed : (n,) bool, vertices that stay; boundary vertices should be among them
    locked : sorted keys of edges that are not flipped
    carrier : the surface
    """
    triangles = triangles.copy()
    twin = twins(triangles)
    descent = Descent()
    best, moved = np.inf, 0.0
    normal = vertex_normals(points, triangles)
    points, normal, density = carrier.onto(points, normal)
    for k in range(rounds):
        make_delaunay_embedded(points, triangles, twin, locked)
        if k % LIFT_EVERY == 0:
            beyond = unseen(points, triangles, normal, carrier)
            descent.reset()
        cells = voronoi_cells(points, triangles, density**2)
        cells = beyond.correct(points, cells)
        if cells.energy > best * (1 + 1e-6):
            descent.reset()
        best = cells.energy
        gradient = -2 * cells.moment
        gradient -= np.einsum("ij,ij->i", gradient, normal)[:, None] * normal
        gradient[fixed] = 0
        step = descent.direction(points, gradient, 1 / (2 * np.maximum(cells.mass, 1e-300))[:, None])
        step -= np.einsum("ij,ij->i", step, normal)[:, None] * normal
        step[fixed] = 0
        size = np.sqrt(np.einsum("ij,ij->i", step, step))
        reach = REACH * _shortest(points, triangles)
        step *= np.minimum(1, reach / np.maximum(size, 1e-300))[:, None]
        free = ~fixed
        moved = float(np.mean(np.minimum(size, reach)[free] / reach[free])) * REACH if free.any() else 0.0
        trial = points + step
        normal = vertex_normals(trial, triangles)
        trial, normal, density = carrier.onto(trial, normal)
        trial[fixed] = points[fixed]
        points = trial
        yield Progress("Relaxation", (k + 1) / rounds)
    make_delaunay_embedded(points, triangles, twin, locked)
    return points, triangles, moved


@dataclass(frozen=True)
class Unseen:
    """Where flat triangles cut off too much: share (n,) in which to trust samples, their mass and centroid."""

    share: np.ndarray
    mass: np.ndarray
    centroid: np.ndarray

    def correct(self, points: np.ndarray, cells: Cells) -> Cells:
        """The cells of points (n,3), those of samples where these see more."""
        moment = self.mass[:, None] * (self.centroid - points)
        b = self.share[:, None]
        return Cells(
            (1 - self.share) * cells.mass + self.share * self.mass,
            (1 - b) * cells.moment + b * moment,
            cells.energy,
        )


def unseen(points: np.ndarray, triangles: np.ndarray, normals: np.ndarray, carrier: Carrier) -> Unseen:
    """Cells of samples of the surface against those of the mesh.

    A tip or a ridge that the triangles cut off weighs too little in their cells, and would lose its vertices more and
    more. The samples are too few for exact cells, but enough to find these places, and to pull there.
    """
    seen = carrier.seen_by(points, normals)
    n = len(points)
    covered = vertex_areas(points, triangles)
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    # A few samples a cell are a rough measure; the mean with the neighbours is a better one.
    valence = np.bincount(tail, minlength=n) + 2
    ratio = (np.bincount(tail, seen.area[head], n) + 2 * seen.area) / np.maximum(
        np.bincount(tail, covered[head], n) + 2 * covered, 1e-300
    )
    share = np.where(valence > 0, np.clip((ratio - UNSEEN[0]) / (UNSEEN[1] - UNSEEN[0]), 0, 1), 0)
    share = np.where(seen.mass > 0, share, 0)
    return Unseen(share, seen.mass, points + seen.moment / np.maximum(seen.mass, 1e-300)[:, None])


def _shortest(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Length of the shortest edge at every vertex, (n,)."""
    p = points[triangles]
    e = p[:, [1, 2, 0]] - p
    length = np.sqrt(np.einsum("mki,mki->mk", e, e))
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, triangles.ravel(), length.ravel())
    np.minimum.at(shortest, triangles[:, [1, 2, 0]].ravel(), length.ravel())
    return shortest
