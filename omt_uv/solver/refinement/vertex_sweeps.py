"""Smooth a map by Newton steps of single vertices within their stars: a coloured Gauss-Seidel method.

Vertices without a common face move together, one such set after the other (a coloured Gauss-Seidel sweep, the smoother
of multigrid methods). A sweep takes a tenth of the time of a Newton step on the whole mesh, which is at its worst with
such errors: the one face that folds first stops the step of all. Boundaries may move, too, as far as nothing crosses.
"""

from __future__ import annotations

import numpy as np

from ..maps.energy import Elements, energies, squared
from ..mesh.topology import halfedges, twins
from ..progress import Progress, Steps
from .boundary_barrier import crossings, loop_edges

# Least eigenvalue of a vertex's Hessian over the greatest.
CONVEX = 0.01
# Of a step, at most.
HALVINGS = 5
# Passes that add to an independent set.
PASSES = 3
# Independent sets that make a sweep; what is in none of them waits for Newton.
SETS = 8
# A boundary vertex moves only where it might go so many times as far before edges cross.
ROOM = 6.0
# Stars with so many times the mean energy are smoothed after a step of Newton's method.
WORST = 2.0
# With so many sweeps.
AFTER_STEP = 4


def smoothed(faces: Elements, w: np.ndarray, area_weight: float, sweeps: int, loop=None) -> Steps[np.ndarray]:
    """A map w (n,) complex without folds after sweeps over all its vertices, without folds.

    loop: a boundary, see `boundary_barrier.loop_edges`, that moves, too, and does not come to cross itself. Without it
    the boundary stays.
    """
    w = w.copy()
    sets = list(_sets(faces, len(w), loop is not None))
    for k in range(sweeps):
        for vertex, row, star in sets:
            before = None if loop is None else w.copy()
            relax(vertex, row, star, w, area_weight, 1)
            if before is not None:
                _uncross(w, before, loop)
        yield Progress("Smoothing", (k + 1) / sweeps)
    return w


def _uncross(w: np.ndarray, before: np.ndarray, loop: np.ndarray) -> None:
    """Take back, in place, what moved of edges of a boundary that cross, or would soon."""
    tail, head = loop_edges(loop)
    # What goes right over a narrow part crosses it now, and farther on no longer.
    while len(pairs := np.concatenate([crossings(before + k * (w - before), loop) for k in (1, ROOM)])):
        ends = np.concatenate([tail[pairs].ravel(), head[pairs].ravel()])
        if not (w[ends] != before[ends]).any():
            w[tail] = before[tail]
            return
        w[ends] = before[ends]


class Smoother:
    """Sweeps over the worst vertices of maps of a mesh (m,3) of n vertices, between two steps of Newton's method.

    After a step some faces have little left of their area, and Newton's method takes many steps to give it back, long
    after it is done with all others. For single vertices it is a small matter.
    """

    def __init__(self, triangles: np.ndarray, n: int):
        self._sets = list(_stars(triangles, n))

    def smoothed(self, faces: Elements, w: np.ndarray, area_weight: float, sweeps: int = AFTER_STEP) -> np.ndarray:
        """A map w (n,) complex without folds after sweeps over the vertices whose stars have most of the energy."""
        star = np.bincount(faces.triangles.ravel(), np.repeat(energies(faces, w, area_weight), 3), len(w))
        bad = star > WORST * star.mean()
        sets = []
        for vertex, row, around, corner in self._sets:
            kept = bad[vertex]
            place, rows = np.cumsum(kept) - 1, kept[row]
            sets.append((vertex[kept], place[row[rows]], take_faces(faces, around[rows], corner[rows])))
        w = w.copy()
        for _ in range(sweeps):
            for vertex, row, around in sets:
                relax(vertex, row, around, w, area_weight, 1)
        return w


def _sets(faces: Elements, n: int, whole=False):
    """Independent sets of vertices, inner or all: vertices (k,), and the rows (s,) and faces of their stars."""
    for vertex, row, star, corner in _stars(faces.triangles, n, whole):
        yield vertex, row, take_faces(faces, star, corner)


def _stars(F: np.ndarray, n: int, whole=False):
    """Independent sets of vertices, inner or all: vertices (k,); rows, faces (s,) and corners (s,3) of their stars."""
    random = np.random.default_rng(0)
    inner = np.ones(n, bool)
    if not whole:
        tail, head = halfedges(F)
        boundary = twins(F) < 0
        inner[tail[boundary]] = inner[head[boundary]] = False
    for _ in range(SETS):
        chosen = independent_set(F, np.where(inner, random.permutation(n), -1))
        inner &= ~chosen
        star, corner = stars(F, chosen)
        vertex, row = np.unique(np.take_along_axis(F[star], corner[:, :1], 1)[:, 0], return_inverse=True)
        yield vertex, row, star, corner


def independent_set(F: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """Vertices (n,) bool, no two in one face, those of high rank (n,) first; none of negative rank."""
    faces = np.bincount(F.ravel(), minlength=len(rank))
    rank = rank.copy()
    chosen = np.zeros(len(rank), bool)
    for _ in range(PASSES):
        here = rank[F]
        wins = here.argmax(1)
        winner = np.take_along_axis(F, wins[:, None], 1)[:, 0]
        chosen |= (np.bincount(winner, minlength=len(rank)) == faces) & (rank >= 0)
        rank[F[chosen[F].any(1)]] = -1
    return chosen


def stars(F: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces (s,) around the chosen vertices (n,) bool, by vertex, and their corners (s,3) from that vertex on."""
    star = np.flatnonzero(chosen[F].any(1))
    corner = (chosen[F[star]].argmax(1)[:, None] + np.arange(3)) % 3
    order = np.argsort(np.take_along_axis(F[star], corner[:, :1], 1)[:, 0], kind="stable")
    return star[order], corner[order]


def take_faces(faces: Elements, star: np.ndarray, corner: np.ndarray) -> Elements:
    """Some faces (s,), with their corners in the order (s,3)."""
    triangles, gradient = (np.take_along_axis(x[star], corner, 1) for x in (faces.triangles, faces.gradient))
    return Elements(
        triangles=triangles,
        area=faces.area[star],
        gradient=gradient,
        ratio=faces.ratio[star],
        weight=faces.weight[star],
    )


def relax(
    vertex: np.ndarray, row: np.ndarray, faces: Elements, w: np.ndarray, area_weight: float, steps: int, fixed=False
) -> None:
    """Newton steps of every vertex (k,) within its star, in place, each only as far as its own energy falls.

    row (s,): which of the vertices is the first corner of a face of the stars; fixed: vertices (k,) bool that stay.
    """
    k = len(vertex)
    value = np.bincount(row, energies(faces, w, area_weight), k)
    for _ in range(steps):
        step = _directions(row, faces, w, area_weight, k)
        moving = np.ones(k, bool) & ~np.asarray(fixed)
        for _ in range(HALVINGS):
            trial = w.copy()
            trial[vertex[moving]] += step[moving]
            new = np.bincount(row, energies(faces, trial, area_weight), k)
            better = moving & (new < value)
            w[vertex[better]] += step[better]
            value = np.where(better, new, value)
            moving &= ~better
            if not moving.any():
                break
            step *= 0.5


def _directions(row, faces: Elements, w, area_weight: float, k: int) -> np.ndarray:
    """Newton steps (k,) of single vertices, with their whole Hessian.

    By the place of its first corner a face's area changes linearly, so that there is no need of eigensystems.
    """
    a, b = faces.derivatives(w)
    g, inner = faces.gradient[:, 0], squared(b)
    det = squared(a) - inner
    by_area, by_shear = a * g - b * g.conj(), b * g.conj()
    slope = faces.weight * (area_weight / 2 * (1 / faces.ratio - faces.ratio / det**2) - 2 * inner / det**2)
    bend = faces.weight * (4 * inner + area_weight * faces.ratio) / det**3
    mixed, even = -2 * faces.weight / det**2, faces.weight * squared(g) / det
    down = slope * by_area + 2 * faces.weight / det * by_shear
    xx = bend * by_area.real**2 + 2 * mixed * by_area.real * by_shear.real + even
    yy = bend * by_area.imag**2 + 2 * mixed * by_area.imag * by_shear.imag + even
    xy = bend * by_area.real * by_area.imag + mixed * (by_area * by_shear).imag
    xx, yy, xy, gx, gy = (np.bincount(row, x, k) for x in (xx, yy, xy, down.real, down.imag))
    # Bent downwards, or hardly at all, it is made a little convex.
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    lift = np.maximum(0, CONVEX * (np.abs(mean) + half) - (mean - half))
    xx, yy = xx + lift, yy + lift
    return -(yy * gx - xy * gy + 1j * (xx * gy - xy * gx)) / (xx * yy - xy**2)
