"""Smooth a map by Newton steps of single vertices within their stars: a coloured Gauss-Seidel method.

Vertices without a common face move together, one such set after the other (a coloured Gauss-Seidel sweep, the smoother
of multigrid methods). A sweep takes a tenth of the time of a Newton step on the whole mesh, which is at its worst with
such errors: the one face that folds first stops the step of all. Boundaries may move, too, as far as nothing crosses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..maps.contacts import crossings_on_the_way, loop_edges
from ..maps.energy import Elements, area_error, elements, energies, squared
from ..mesh.geometry import KEPT_HATS
from ..mesh.topology import inner_vertices, order_of_numbers, runs
from ..progress import Progress, Steps

# Least eigenvalue of a vertex's Hessian over the greatest.
CONVEX = 0.01
# Of a step, at most.
HALVINGS = 5
# Of sweeps that end at an area error, all but the first go so many times as far as a vertex asks for, if it is still
# better off there: fewer of them even the areas of a wide part (Young 1954). What comes back to a mesh is off by a
# vertex here and there at first, and best mended as it is.
BEYOND = 1.5
# A sweep lowers the area error by a fourth at least: where it is no more than so many times the goal, some of one is
# enough.
NEARLY = 1.25
# Passes that add to an independent set.
PASSES = 3
# Independent sets that make a sweep; what is in none of them waits for Newton.
SETS = 6
# A boundary vertex moves only where it might go so many times as far before edges cross.
ROOM = 6.0
# Faces of stars that are relaxed at a time, roughly.
PART = 1 << 15
# Stars with so many times the mean energy are smoothed after a step of Newton's method.
WORST = 2.0
# With so many sweeps.
AFTER_STEP = 4
# The corners of a triangle from each of them on.
TURNS = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])


def smoothed(
    faces: Elements, w: np.ndarray, area_weight: float, sweeps: int, loop=None, goal: float = 0.0
) -> Steps[np.ndarray]:
    """A map w (n,) complex without folds after sweeps over all its vertices, without folds.

    loop: a boundary, see `contacts.loop_edges`, that moves, too, and does not come to cross itself. Without it
    the boundary stays. goal: area error at which the sweeps end; a map that has no more of it stays as it is
    """
    w = w.copy()
    error, aim = (area_error(faces, w), faces) if goal else (np.inf, None)
    if error <= goal:
        return w
    found, swept = _sets(faces, len(w), loop is not None), error <= NEARLY * goal
    # What the sets have taken of it is all that is needed from here on.
    del faces
    sets = _set_by_set(found, aim, w, area_weight, goal) if aim is not None and swept else list(found)
    for k in range(int(swept), sweeps if len(sets) else 0):
        start = w.copy()
        stride = BEYOND if aim is not None and k else 1.0
        _sweep(sets, w, area_weight, stride=stride)
        # Most sweeps let no edges cross. Those that do are done again, and looked at set by set.
        if loop is not None and len(crossings_on_the_way(start, w - start, loop, (1.0, ROOM))):
            w = start
            _sweep(sets, w, area_weight, loop, stride)
        yield Progress("Smoothing", (k + 1) / sweeps)
        if aim is not None and area_error(aim, w) <= goal:
            break
    return w


def _set_by_set(found: Iterator, aim: Elements, w: np.ndarray, area_weight: float, goal: float) -> list:
    """The sets of a sweep that is made, in place, as they are found; none where the area error is down at the goal by
    then: to find those that are left takes longer than to sweep."""
    sets = []
    for one in found:
        sets.append(one)
        _sweep([one], w, area_weight)
        if area_error(aim, w) <= goal:
            return []
    return sets


def smoothed_uv(
    vertices: np.ndarray,
    triangles: np.ndarray,
    target: np.ndarray,
    uv: np.ndarray,
    area_weight: float,
    sweeps: int,
    goal: float = 0.0,
) -> Steps[np.ndarray]:
    """A map uv (n,2) of a mesh (n,3), (m,3), as large as its target areas (m,), after `smoothed` with its boundary as
    it is, (n,2)."""
    faces, w = elements(vertices, triangles, target), uv @ [1, 1j]
    w = w * np.sqrt((faces.area @ faces.ratio) / faces.areas(w).sum())
    steps = smoothed(faces, w, area_weight, sweeps, goal=goal)
    # They take the memory of six maps, and sweeps have their own.
    del faces, uv
    w = yield from steps
    return np.column_stack([w.real, w.imag])


def _sweep(sets: list, w: np.ndarray, area_weight: float, loop=None, stride: float = 1.0) -> None:
    """Move the vertices of all sets within their stars, in place, and take back what lets edges of a loop cross.

    stride : of their steps, in Newton's
    """
    for vertex, row, star in sets:
        before = None if loop is None else w.copy()
        relax(vertex, row, star, w, area_weight, 1, stride=stride)
        if before is not None:
            _uncross(w, before, loop)


def _uncross(w: np.ndarray, before: np.ndarray, loop: np.ndarray) -> None:
    """Take back, in place, what moved of edges of a boundary that cross, or would soon; before, none did."""
    tail, head = loop_edges(loop)
    # What goes right over a narrow part crosses it now, and farther on no longer.
    while len(pairs := crossings_on_the_way(before, w - before, loop, (1.0, ROOM))):
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
    many = len(faces.triangles) > KEPT_HATS
    for vertex, row, star, corner in _stars(faces.triangles, n, whole):
        taken = _Stars(faces, star.astype(np.int32), corner[:, 0].astype(np.int8)) if many else None
        yield vertex, row.astype(np.int32), taken or take_faces(faces, star, corner)


def _stars(F: np.ndarray, n: int, whole=False):
    """Independent sets of vertices, inner or all: vertices (k,); rows, faces (s,) and corners (s,3) of their stars."""
    random = np.random.default_rng(0)
    inner = np.ones(n, bool) if whole else inner_vertices(F, n)
    for _ in range(SETS):
        chosen = independent_set(F, np.where(inner, random.permutation(n), -1))
        inner &= ~chosen
        star, corner = stars(F, chosen)
        vertex, row = runs(np.take_along_axis(F[star], corner[:, :1], 1)[:, 0])
        yield vertex, row, star, corner


@dataclass(frozen=True)
class _Stars:
    """Faces (s,) of stars, and the corners (s,) that they begin with: all that is known of these faces takes several
    times the memory of a large mesh, and is taken as it is asked for."""

    faces: Elements
    star: np.ndarray
    first: np.ndarray

    def taken(self, some: slice) -> Elements:
        """Some of the faces, as `take_faces`."""
        return take_faces(self.faces, self.star[some], (self.first[some, None] + np.arange(3)) % 3)


def independent_set(F: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """Vertices (n,) bool, no two in one face, those of high rank (n,) first; none of negative rank."""
    faces = np.bincount(F.ravel(), minlength=len(rank))
    # Corners by themselves are gathered faster.
    rank, left = rank.copy(), F.T.copy()
    chosen = np.zeros(len(rank), bool)
    for k in range(PASSES):
        one, two, three = rank[left[0]], rank[left[1]], rank[left[2]]
        best = np.maximum(one, two)
        winner = np.where(three > best, left[2], np.where(two > one, left[1], left[0]))
        best = np.maximum(best, three)
        # Most faces have nobody left to win after the first pass.
        left, winner = left[:, best >= 0], winner[best >= 0]
        new = (np.bincount(winner, minlength=len(rank)) == faces) & (rank >= 0)
        chosen |= new
        if k + 1 < PASSES:
            rank[left[:, new[left[0]] | new[left[1]] | new[left[2]]]] = -1
    return chosen


def stars(F: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces (s,) around the chosen vertices (n,) bool, by vertex, and their corners (s,3) from that vertex on."""
    one, two, three = (chosen[corner] for corner in F.T)
    star = np.flatnonzero(one | two | three)
    first = np.where(one[star], 0, np.where(two[star], 1, 2))
    order = order_of_numbers(F.ravel()[3 * star + first])
    return star[order], TURNS[first[order]]


def take_faces(faces: Elements, star: np.ndarray, corner: np.ndarray) -> Elements:
    """Some faces (s,), with their corners in the order (s,3)."""
    given, place = (faces.triangles[star], faces.gradient_at(star)), 3 * np.arange(len(star))[:, None] + corner
    triangles, gradient = (np.take(x, place) for x in given)
    weight = faces.weight[star]
    # Nobody asks single vertices for the area of the surface.
    return Elements(triangles.astype(np.int32), weight, gradient, faces.ratio[star], weight)


def relax(
    vertex: np.ndarray,
    row: np.ndarray,
    faces: Elements | _Stars,
    w: np.ndarray,
    area_weight: float,
    steps: int,
    fixed=False,
    stride: float = 1.0,
) -> None:
    """Newton steps of every vertex (k,) within its star, in place, each only as far as its own energy falls.

    row (s,): which of the vertices is the first corner of a face of the stars, ascending; fixed: vertices (k,) bool
    that stay; stride: how far they go at most, in Newton's steps.
    """
    # No vertex of one part is a neighbour of those of another: what is computed of a part stays in the cache.
    parts = np.arange(0, len(row), PART)
    first = np.unique(np.concatenate([row[parts], [len(vertex)]]))
    begin = np.searchsorted(row, first)
    for a, b, c, d in zip(first[:-1], first[1:], begin[:-1], begin[1:], strict=True):
        some = faces if isinstance(faces, Elements) and d - c == len(row) else _rows(faces, slice(c, d))
        stay = np.broadcast_to(fixed, len(vertex))[a:b]
        _relax(vertex[a:b], row[c:d] - a, some, w, area_weight, (steps, stride), stay)


def _rows(faces: Elements | _Stars, some: slice) -> Elements:
    """Some of the faces, each a polygon of its own."""
    if isinstance(faces, _Stars):
        return faces.taken(some)
    return Elements(
        faces.triangles[some], faces.area[some], faces.gradient_at(some), faces.ratio[some], faces.weight[some]
    )


def _relax(
    vertex: np.ndarray,
    row: np.ndarray,
    faces: Elements,
    w: np.ndarray,
    area_weight: float,
    steps: tuple[int, float],
    fixed: np.ndarray,
) -> None:
    """`relax` of all at once; steps: how many, and their stride."""
    count, stride = steps
    k, before = len(vertex), w[vertex]
    around = _around(faces, w)
    first = value = np.bincount(row, around.energies(area_weight), k)
    for left in range(count, 0, -1):
        step = _directions(row, around, area_weight, k)
        step[fixed] = 0
        moved, value = _searched(row, around, stride * step, area_weight, value)
        w[vertex] += moved
        around = around.moved(moved[row]) if left > 1 else around
    # What was followed from step to step has its own rounding: on slivers it may have lost a fold.
    after = np.bincount(row, energies(faces, w, area_weight), k)
    worse = ~(after <= first)
    w[vertex[worse]] = before[worse]


@dataclass(frozen=True)
class _Around:
    """Faces (s,) of stars as the places of their first corners change, in which their areas are linear.

    weight, ratio : of the faces; gradient : of the first corner's hat function, complex; inner : derivative dw/dconj(z)
    det : determinants; by_area : their slopes by that corner, complex
    """

    weight: np.ndarray
    ratio: np.ndarray
    gradient: np.ndarray
    inner: np.ndarray
    det: np.ndarray
    by_area: np.ndarray

    def of(self, some: np.ndarray) -> _Around:
        """Some of the faces, (s,) bool or numbers."""
        return _Around(**{name: values[some] for name, values in vars(self).items()})

    def moved(self, step: np.ndarray) -> _Around:
        """The faces after a step (s,) complex of their first corners."""
        det = self.det + (self.by_area.real * step.real + self.by_area.imag * step.imag)
        return replace(self, inner=self.inner + 0.5 * self.gradient * step, det=det)

    def energies(self, area_weight: float) -> np.ndarray:
        """The energy of every face, (s,), infinite at a fold, as `energy.energies` has it."""
        safe = np.where(self.det > 0, self.det, 1)
        r = safe / self.ratio
        value = self.weight * (2 * squared(self.inner) / safe + area_weight * ((r + 1 / r) / 2 - 1))
        return np.where(self.det > 0, value, np.inf)


def _around(faces: Elements, w: np.ndarray) -> _Around:
    a, b = faces.derivatives(w)
    g = faces.gradient[:, 0]
    return _Around(
        weight=faces.weight,
        ratio=faces.ratio,
        gradient=g,
        inner=b,
        det=squared(a) - squared(b),
        by_area=a * g - b * g.conj(),
    )


def _searched(row, around: _Around, step: np.ndarray, area_weight: float, value: np.ndarray):
    """How far the vertices go along their steps (k,), halved until their energies (k,) fall, and the energies then."""
    k = len(step)
    moved, value, left, size = np.zeros(k, complex), value.copy(), np.flatnonzero(step != 0), 1.0
    rows, here = row, around
    if len(left) < k:
        here, rows = _star_of(left, row, around, k)
    for _ in range(HALVINGS):
        trial = size * step[left]
        new = np.bincount(rows, here.moved(trial[rows]).energies(area_weight), len(left))
        better = new < value[left]
        moved[left[better]], value[left[better]] = trial[better], new[better]
        if better.all():
            break
        here, rows = _star_of(np.flatnonzero(~better), rows, here, len(left))
        left, size = left[~better], 0.5 * size
    return moved, value


def _star_of(some: np.ndarray, row: np.ndarray, around: _Around, k: int) -> tuple[_Around, np.ndarray]:
    """The faces around some (j,) of k vertices, and whose each is, among these."""
    place = np.full(k, -1)
    place[some] = np.arange(len(some))
    kept = place[row] >= 0
    return around.of(kept), place[row[kept]]


def _directions(row, around: _Around, area_weight: float, k: int) -> np.ndarray:
    """Newton steps (k,) of single vertices, with their whole Hessian.

    By the place of its first corner a face's area changes linearly, so that there is no need of eigensystems.
    """
    g, b, det, by_area = around.gradient, around.inner, around.det, around.by_area
    inner, by_shear, over = squared(b), b * g.conj(), 1 / det
    weighted = around.weight * over
    bent = weighted * over
    slope = around.weight * (area_weight / 2) / around.ratio - bent * (area_weight / 2 * around.ratio + 2 * inner)
    bend = bent * over * (4 * inner + area_weight * around.ratio)
    even = weighted * squared(g)
    ax, ay, sx, sy = by_area.real, by_area.imag, by_shear.real, by_shear.imag
    px, py = bend * ax - 2 * bent * sx, bend * ay - 2 * bent * sy
    xx = px * ax - 2 * bent * ax * sx + even
    yy = py * ay - 2 * bent * ay * sy + even
    xy = px * ay - 2 * bent * ax * sy
    gx, gy = slope * ax + 2 * weighted * sx, slope * ay + 2 * weighted * sy
    xx, yy, xy, gx, gy = (np.bincount(row, x, k) for x in (xx, yy, xy, gx, gy))
    # Bent downwards, or hardly at all, it is made a little convex.
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    lift = np.maximum(0, CONVEX * (np.abs(mean) + half) - (mean - half))
    xx, yy = xx + lift, yy + lift
    return -(yy * gx - xy * gy + 1j * (xx * gy - xy * gx)) / (xx * yy - xy**2)
