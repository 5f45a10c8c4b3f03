"""Share out vertices, and bring meshes to an exact number of them by splits and collapses."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ...mesh.closest_point import ClosestPoint
from ...mesh.geometry import lengths
from ...mesh.topology import boundary_loops, halfedges
from ..components.components import Component
from .delaunay_flips import make_delaunay_embedded
from .split_collapse import (
    ANY_COSINE,
    MIN_COSINE,
    Edit,
    collapse_edges,
    independent_splits,
    interior_edges,
    shortest_first,
    split_edges,
)
from .working_mesh import WorkingMesh


class StuckError(Exception):
    """No edge of the mesh can collapse any more."""

    def __init__(self, mesh: WorkingMesh):
        super().__init__()
        self.mesh = mesh


# Target edge lengths (k,) at points (k,3).
SizeFunction: TypeAlias = Callable[[np.ndarray], np.ndarray]

# Rounds of splits or collapses; each makes up for much of the difference.
MAX_ROUNDS = 500
# Share of the missing vertices that one round may split: only edges about as long as the longest go.
ROUND_SHARE = 0.5
# Rounds of flips after each.
FLIP_ROUNDS = 5


class SizingField:
    """Target edge length at points: `length` over the square root of the density (m,) of the surface's triangles."""

    def __init__(self, index: ClosestPoint, density: np.ndarray, length: float):
        self.index, self.density, self.length = index, density, length
        self.even = np.ptp(density) == 0

    def __call__(self, points: np.ndarray) -> np.ndarray:
        if self.even:
            return np.full(len(points), self.length)
        return self.length / np.sqrt(self.density[self.index.nearest_face(points)])


def min_vertex_count(component: Component) -> int:
    """Vertices that a component of this topology takes at least; closed, by Heawood's bound (Jungerman, Ringel 1980).

    With a boundary of B edges, 3 for every loop at the least and n at the most, there are 3 (n - euler) - B edges, for
    which there have to be enough pairs of vertices.
    """
    if component.members:
        return sum(min_vertex_count(member) for member in component.members)
    if len(component.boundary_edges):
        rings = 3 * len(boundary_loops(component.triangles))
        return max(rings, int(np.ceil((5 + np.sqrt(25 - 24 * component.euler)) / 2 - 1e-9)))
    euler = min(component.euler, 2)
    return int(np.ceil((7 + np.sqrt(49 - 24 * euler)) / 2 - 1e-9))


def min_face_count(component: Component, vertices: int) -> int:
    """Triangles of a component with so many vertices at least: with a boundary, when all of them are on it."""
    return vertices - 2 * component.euler if len(component.boundary_edges) else 2 * (vertices - component.euler)


def apportion(count: int, proportion: np.ndarray, least: np.ndarray) -> np.ndarray:
    """Whole numbers (k,) that sum to `count`, in `proportion` (k,) but none below `least` (k,), by largest remainders.

    `least` sums to `count` at the most.
    """
    given = least.astype(float)
    free = np.ones(len(proportion), dtype=bool)
    for _ in range(len(proportion)):
        room = count - least[~free].sum()
        given = np.where(free, room * proportion / max(proportion[free].sum(), 1e-300), least)
        low = free & (given < least)
        if not low.any():
            break
        free &= ~low
    whole = np.maximum(np.floor(given + 1e-9).astype(np.int64), least)
    order = np.argsort(whole - given, kind="stable")
    surplus = count - int(whole.sum())
    if surplus > 0:
        whole[order[np.arange(surplus) % len(order)]] += 1
    while surplus < 0:
        richest = int(np.argmax(whole - least))
        whole[richest] -= 1
        surplus += 1
    return whole


def edge_length(measure: float, boundary: float, count: int) -> float:
    """Edge length of `count` vertices in equilateral triangles on this much area, with a boundary of this length."""
    a, b = 2 / np.sqrt(3) * measure, boundary / 2
    return float(2 * a / (-b + np.sqrt(b * b + 4 * a * count)))


def reach_vertex_count(mesh: WorkingMesh, count: int, sizing: SizeFunction, allow_folds: bool = False) -> WorkingMesh:
    """Bring a mesh to exactly `count` vertices.

    Where there are too many the shortest edges collapse, where there are too few the longest are split, in
    comparison with the edge length that `sizing` gives at points (k,3). Where nothing else is possible faces may fold,
    if `allow_folds`.

    Raises
    ------
    StuckError : no edge can collapse any more
    """
    for _ in range(MAX_ROUNDS):
        deficit = count - len(mesh.points)
        if deficit == 0:
            return mesh
        h = interior_edges(mesh.triangles, mesh.locked, mesh.twin)
        tail, head = halfedges(mesh.triangles)
        a, b = (mesh.points.take(end[h], axis=0) for end in (tail, head))
        length = lengths(a - b) / sizing((a + b) / 2)
        if deficit > 0:
            mesh = _split(mesh, h, length, deficit)
            continue
        try:
            mesh = _collapse(mesh, h, length, -deficit, MIN_COSINE)
        except StuckError:
            if not allow_folds:
                raise
            mesh = _collapse(mesh, h, length, -deficit, ANY_COSINE)
    raise StuckError(mesh)


def _split(mesh: WorkingMesh, h: np.ndarray, length: np.ndarray, deficit: int) -> WorkingMesh:
    longest = np.argsort(-length, kind="stable")[: max(int(ROUND_SHARE * deficit), 8)]
    chosen = independent_splits(mesh.triangles, h[longest], mesh.twin)[:deficit]
    return after_edit(mesh, split_edges(mesh.points, mesh.triangles, chosen, mesh.twin))


def _collapse(mesh: WorkingMesh, h: np.ndarray, length: np.ndarray, surplus: int, min_cosine: float) -> WorkingMesh:
    order = shortest_first(length)
    reach = 4 * surplus + 32
    while True:
        edit = collapse_edges(
            mesh.points, mesh.triangles, h[order[:reach]], mesh.fixed, surplus, min_cosine, twin=mesh.twin
        )
        if len(edit.points) < len(mesh.points):
            return after_edit(mesh, edit)
        if reach >= len(order):
            raise StuckError(mesh)
        reach *= 4


def after_edit(mesh: WorkingMesh, edit: Edit) -> WorkingMesh:
    """Carry a mesh through an edit; Delaunay again if it is to be."""
    fixed = np.where(edit.origin >= 0, mesh.fixed[np.maximum(edit.origin, 0)], False)
    triangles, twin = edit.triangles.copy(), edit.twin.copy()
    if mesh.delaunay:
        make_delaunay_embedded(edit.points, triangles, twin, mesh.locked, FLIP_ROUNDS)
    near = None
    if mesh.near is not None:
        # A new vertex, of which there are the last ones, is about where an end of its edge is.
        near = np.append(mesh.near[edit.origin[edit.origin >= 0]], mesh.near[edit.split_ends[:, 0]])
    return mesh.turned_into(edit.points, triangles, twin, fixed, near)
