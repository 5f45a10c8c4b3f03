"""Polygons that are convex on the surface kept convex in the map, whichever way they are cut into triangles.

The refinement keeps the triangles of one triangulation positive. Who draws the mesh may use another one, and a quad
whose image is a dart is folded there. Where that is so, the vertices around are placed anew by a few Newton steps on
the refinement's energy, with a barrier for the area of every corner, the triangle of a vertex and its two neighbours:

    share of the polygon * [ (r + 1/r)/2 - 1 ],     r = (area + slack) / (wanted + slack).

A slack lets corners in that are not open yet, and goes as they open; then the barrier weakens, so that the faces get
their areas back (an interior point method with a first phase).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .charts import Chart, Surface
from .contact import crossings
from .corners import DENTED, OPEN, STRAIGHT, Barrier, Corners, convex_corners
from .dissection import vertex_graph
from .energy import elements, energies, gradient
from .geometry import face_areas, signed_areas
from .linear import minimum_degree
from .newton import ARMIJO, FOLD_SHARE, Assembly, Free, Problem, fold_shares, newton_direction
from .topology import boundary_loops, halfedges

# Rings of faces around that may move, at most, and how many vertices are enough for every corner.
RINGS, ROOM = 4, 50
STRENGTH = 30.0
# Rounds that open and that settle, of so many Newton steps; corners that are shut start a round at this r.
OPENING, SETTLING, STEPS, LEAST = 6, 4, 3, 0.1
# A patch whose area error grew by more than GROWTH gets a weight of the area term so many times as large.
GROWTH, HEAVIER = 1.25, 1.5
PRESSURE, HALVINGS = 0.3, 12
# Tries with more and more of the outlines held where they would come to cross themselves.
ATTEMPTS = 5


def opened(
    surface: Surface,
    charts: Sequence[Chart],
    maps: Sequence[np.ndarray],
    fixed: Sequence[np.ndarray],
    density: Sequence[np.ndarray | None],
    weights: Sequence[float],
) -> dict[int, np.ndarray]:
    """New maps, by the number of the chart, of those in which convex polygons have corners that are not open.

    maps (n_i,2) of the charts, without folds; fixed (n_i,) bool: vertices that stay; density (m_i,) of the triangles,
    None where they get their own areas; weights of the area term. Corners that cannot be opened without a fold, or
    without an outline that crosses itself, stay as they are.
    """
    first = np.cumsum([0, *(len(uv) for uv in maps)])
    # In units of the map, so that no area under- or overflows.
    unit = float(np.abs(np.concatenate(maps)).max())
    w = np.concatenate([uv / unit for uv in maps]) @ [1, 1j]
    triangles = np.concatenate([c.triangles + k for c, k in zip(charts, first, strict=False)])
    corners = _mapped_corners(surface, charts, triangles, w)
    if not corners.shut(w).any():
        return {}
    mesh = _union(charts, first, density, weights, w)
    held = np.concatenate(fixed)
    for attempt in range(ATTEMPTS):
        moved = _relaxed(mesh, w, corners, held)
        changed = np.unique(np.searchsorted(first, np.flatnonzero(moved != w), side="right") - 1)
        loops = [boundary_loops(charts[k].disk)[0] + first[k] for k in changed]
        crossed = [_crossed(w, moved, loop, attempt == ATTEMPTS - 2) for loop in loops]
        if not any(map(len, crossed)):
            break
        held[np.concatenate(crossed)] = True
    new = {int(k): maps[k].copy() for k in changed}
    for k, uv in new.items():
        mine = slice(first[k], first[k + 1])
        rows = np.flatnonzero(moved[mine] != w[mine])
        uv[rows] = unit * np.column_stack([moved.real, moved.imag])[mine][rows]
    return new


@dataclass(frozen=True)
class _Mesh:
    """Positions (n,3), triangles (m,3), the areas (m,) they shall have, weights (m,) of the area term."""

    positions: np.ndarray
    triangles: np.ndarray
    target: np.ndarray
    weight: np.ndarray

    def of(self, vertices: np.ndarray, faces: np.ndarray, place: np.ndarray) -> _Mesh:
        """Some of the vertices (k,) and faces (m,) bool, vertex v as place[v]."""
        return _Mesh(self.positions[vertices], place[self.triangles[faces]], self.target[faces], self.weight[faces])


def _union(charts, first, density, weights, w) -> _Mesh:
    """All charts side by side, patches over holes included; they ask for their own areas."""
    positions = np.concatenate([c.vertices for c in charts])
    low, high = positions.min(axis=0) / 2, positions.max(axis=0) / 2
    positions = (positions / 2 - low) / (high - low).max()
    triangles = np.concatenate([c.disk + k for c, k in zip(charts, first, strict=False)])
    target = face_areas(positions, triangles)
    covered = signed_areas(np.column_stack([w.real, w.imag]), triangles)
    begin = np.cumsum([0, *(len(c.disk) for c in charts)])
    for k, (chart, values) in enumerate(zip(charts, density, strict=True)):
        own = slice(begin[k], begin[k] + len(chart.triangles))
        if values is not None:
            target[own] *= values
        # Pins give a chart a scale of its own.
        target[begin[k] : begin[k + 1]] *= covered[own].sum() / target[own].sum()
    return _Mesh(positions, triangles, target, np.repeat(weights, np.diff(begin)))


def _mapped_corners(surface: Surface, charts: Sequence[Chart], triangles: np.ndarray, w: np.ndarray) -> Corners:
    """The corners of convex polygons as vertices of all charts, counter-clockwise in the map."""
    corner, polygon, share = convex_corners(surface, straight=True)
    vertex = np.full(len(surface.corner_vertex), -1)
    vertex[np.concatenate([c.corners.ravel() for c in charts])] = triangles.ravel()
    a, b, c = w[triangles].T
    owner = np.concatenate([c.faces for c in charts])
    area = np.bincount(owner, 0.5 * ((b - a).conj() * (c - a)).imag, len(surface.face_start) - 1)
    ears = vertex[corner]
    kept = (ears >= 0).all(1) & (area[polygon] > 0)
    ears, polygon = ears[kept], polygon[kept]
    share, whole = share[kept], area[polygon]
    wanted = np.maximum(share, STRAIGHT)
    found = Corners(ears, wanted * whole, whole, np.where(share < STRAIGHT, share - DENTED, OPEN * wanted) * whole)
    # Polygons may have been turned over for the map.
    turned = np.bincount(polygon, found.areas(w), len(area))[polygon] < 0
    return replace(found, triangles=np.where(turned[:, None], ears[:, [0, 2, 1]], ears))


def _crossed(w: np.ndarray, moved: np.ndarray, loop: np.ndarray, all_of_it: bool) -> np.ndarray:
    """Vertices of an outline (b,) about the places where it crosses itself, or all of it, if it did not before."""
    pairs = crossings(moved, loop)
    if not len(pairs) or len(crossings(w, loop)):
        return loop[:0]
    return loop if all_of_it else np.unique([np.roll(loop, -k)[pairs] for k in range(-2, 4)])


def _relaxed(mesh: _Mesh, w: np.ndarray, corners: Corners, fixed: np.ndarray) -> np.ndarray:
    """The map w (n,) complex with the vertices around shut corners placed anew, those `fixed` (n,) excepted."""
    shut, triangles = corners.shut(w), mesh.triangles
    free = np.zeros(len(w), bool)
    free[corners.triangles[shut]] = True
    for _ in range(RINGS):
        free[triangles[free[triangles].any(1)]] = True
        if free.sum() > ROOM * shut.sum():
            break
    free &= ~fixed
    here = free[corners.triangles].any(1)
    near = free.copy()
    near[corners.triangles[here]] = True
    faces = near[triangles].any(1)
    if not free.any():
        return w
    vertices = np.unique(triangles[faces])
    place = np.full(len(w), -1)
    place[vertices] = np.arange(len(vertices))
    joined = place[np.concatenate([triangles[faces], corners.triangles[here]])]
    vertices = vertices[minimum_degree(vertex_graph(joined, len(vertices)))]
    place[vertices] = np.arange(len(vertices))
    patches = _Patches(mesh.of(vertices, faces, place), corners.of(here, place), free[vertices])
    moved = w.copy()
    moved[vertices] = patches.opened(w[vertices])
    return moved


class _Patches:
    """Patches of a mesh, each of which goes its own way; unknowns in the order of their elimination."""

    def __init__(self, mesh: _Mesh, corners: Corners, free: np.ndarray):
        n, triangles = len(free), mesh.triangles
        self.faces = elements(mesh.positions, triangles, mesh.target)
        self.assembly, self.motion = Assembly(triangles, n), Free(~free)
        self.weight, self.corners = mesh.weight, corners
        self.strength = STRENGTH * corners.whole / mesh.target.sum()
        every = np.concatenate([triangles, corners.triangles])
        tail, head = halfedges(every)
        joined = free[tail] & free[head]
        graph = coo_matrix((np.ones(joined.sum()), (tail[joined], head[joined])), shape=(n, n))
        self.count, self.of_vertex = connected_components(graph, directed=False)
        moving = np.take_along_axis(every, free[every].argmax(1)[:, None], 1)[:, 0]
        self.of_face, self.of_corner = np.split(self.of_vertex[moving], [len(triangles)])

    def opened(self, w: np.ndarray) -> np.ndarray:
        """The map w (n,) with corners opened in those patches where fewer are shut afterwards."""
        given, strength, weight = w, self.strength, self.weight
        for _ in range(OPENING):
            shut = self.corners.shut(w)
            if not shut.any():
                break
            w = self._stepped(w, weight, self._barrier(w, strength))
            strength = np.where(shut, 2 * strength, strength)
        for k in range(SETTLING):
            worse = (self._lack(w) > GROWTH * self._lack(given)) & (k > 1)
            weight = np.where(worse[self.of_face], HEAVIER * weight, weight)
            w = self._stepped(w, weight, self._barrier(w, self.strength * 0.1**k))
        fewer = self._shut(w) < self._shut(given)
        return np.where(fewer[self.of_vertex], w, given)

    def _barrier(self, w, strength) -> Barrier:
        wanted = self.corners.wanted
        slack = np.maximum(LEAST * wanted - self.corners.areas(w), 0) / (1 - LEAST)
        # What is open stays so.
        return Barrier(self.corners, np.where(self.corners.open(w), -OPEN * wanted, slack), strength)

    def _shut(self, w):
        return np.bincount(self.of_corner, self.corners.shut(w), self.count)

    def _lack(self, w):
        return np.bincount(self.of_face, np.abs(self.faces.areas(w) - self.faces.area * self.faces.ratio), self.count)

    def _stepped(self, w, weight, barrier: Barrier) -> np.ndarray:
        """The map after some Newton steps, of which every patch takes as much as it may."""
        problem = Problem(self.faces, self.assembly, self.motion, weight, (barrier,))
        value = self._values(w, weight, barrier)
        for _ in range(STEPS):
            step, _ = newton_direction(problem, w, PRESSURE)
            down = gradient(self.faces, w, weight) + barrier.derivatives(w)[0]
            slope = np.bincount(self.of_vertex, (step.conj() * down).real, self.count)
            far = np.full(self.count, 1 / FOLD_SHARE)
            np.minimum.at(far, self.of_face, fold_shares(*self.faces.derivatives(w), *self.faces.derivatives(step)))
            share = FOLD_SHARE * far
            for _ in range(HALVINGS):
                trial = self._values(w + share[self.of_vertex] * step, weight, barrier)
                waiting = ~(trial <= value + ARMIJO * share * slope)
                if not waiting.any():
                    break
                share[waiting] *= 0.5
            share[waiting] = 0
            w, value = w + share[self.of_vertex] * step, np.where(waiting, value, trial)
        return w

    def _values(self, w, weight, barrier: Barrier) -> np.ndarray:
        of_faces = np.bincount(self.of_face, energies(self.faces, w, weight), self.count)
        return of_faces + np.bincount(self.of_corner, barrier.energies(w), self.count)
