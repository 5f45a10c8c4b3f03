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
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..linalg.nested_dissection import vertex_graph
from ..linalg.sparse import minimum_degree
from ..mesh.charts import Chart
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.surface import Surface
from ..mesh.topology import boundary_loops
from ..refinement.boundary_barrier import crossings
from .corner_solver import Mesh, Patches
from .polygon_corners import DENTED, OPEN, STRAIGHT, Corners, convex_corners

# Rings of faces around that may move, at most, how many vertices are enough for a corner, and the most of one patch:
# a large one goes as far as the worst of its corners lets it.
RINGS, ROOM, LARGEST = 4, 50, 800
# Tries with more and more of the outlines held where they would come to cross themselves.
ATTEMPTS = 5


def keep_convex(
    surface: Surface,
    charts: Sequence[Chart],
    maps: Sequence[np.ndarray],
    fixed: Sequence[np.ndarray],
    density: Sequence[np.ndarray | None],
    weights: Sequence[float],
    spare: Sequence[float],
) -> dict[int, np.ndarray]:
    """New maps, by the number of the chart, of those in which convex polygons have corners that are not open.

    maps (n_i,2) of the charts, without folds; fixed (n_i,) bool: vertices that stay; density (m_i,) of the triangles,
    None where they get their own areas; weights of the area term; spare: by how much the area error of a chart may
    grow. Corners that cannot be opened for that, without a fold, and without an outline that crosses itself, stay as
    they are.
    """
    first = np.cumsum([0, *(len(uv) for uv in maps)])
    # In units of the map, so that no area under- or overflows.
    unit = float(np.abs(np.concatenate(maps)).max())
    w = np.concatenate([uv / unit for uv in maps]) @ [1, 1j]
    triangles = np.concatenate([c.triangles + k for c, k in zip(charts, first, strict=False)])
    corners = _mapped_corners(surface, charts, triangles, w)
    if not corners.shut(w).any():
        return {}
    mesh = _union(charts, first, density, weights, spare, w)
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


def _union(charts, first, density, weights, spare, w) -> Mesh:
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
    chart = np.repeat(np.arange(len(charts)), np.diff(begin))
    spare = np.asarray(spare, float) * np.bincount(chart, target, len(charts))
    return Mesh(positions, triangles, target, np.repeat(weights, np.diff(begin)), chart, spare)


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


def _relaxed(mesh: Mesh, w: np.ndarray, corners: Corners, fixed: np.ndarray) -> np.ndarray:
    """The map w (n,) complex with the vertices around shut corners placed anew, those `fixed` (n,) excepted."""
    triangles = mesh.triangles
    free = _around(corners.triangles[corners.shut(w)], triangles, len(w)) & ~fixed
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
    patches = Patches(mesh.of(vertices, faces, place), corners.of(here, place), free[vertices])
    moved = w.copy()
    moved[vertices] = patches.opened(w[vertices])
    return moved


def _around(shut: np.ndarray, triangles: np.ndarray, count: int) -> np.ndarray:
    """Vertices (n,) bool of shut corners (k,3), and some rings of triangles around them."""
    free = np.zeros(count, bool)
    free[shut] = True
    for _ in range(RINGS):
        more = free.copy()
        more[triangles[free[triangles].any(1)]] = True
        ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        ends = ends[more[ends].all(1)]
        graph = coo_matrix((np.ones(len(ends)), ends.T), shape=(count, count))
        if np.bincount(connected_components(graph, directed=False)[1]).max() > LARGEST:
            break
        free = more
        if free.sum() > ROOM * len(shut):
            break
    return free
