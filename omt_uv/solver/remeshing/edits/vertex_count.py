"""How many vertices go where, and meshes brought to an exact number of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ...mesh.closest_point import ClosestPoint
from ...mesh.topology import boundary_loops, halfedges, twins
from ..components.components import Part
from .delaunay_flips import make_delaunay_embedded
from .split_collapse import (
    ANY_COSINE,
    LEAST_COSINE,
    Edit,
    collapse_edges,
    independent_splits,
    interior_edges,
    split_edges,
)
from .working_mesh import Draft


class StuckError(Exception):
    """No edge of the draft can collapse any more."""

    def __init__(self, draft: Draft):
        super().__init__()
        self.draft = draft


# Edge lengths (k,) wanted at points (k,3).
Size: TypeAlias = Callable[[np.ndarray], np.ndarray]

MOST_ROUNDS = 500
# In one round only edges about as short, or as long, as the most wanted ones go.
SHARE = 0.5
FLIP_ROUNDS = 5


class EdgeSize:
    """The edge length wanted at points: `unit` over the square root of the density (m,)."""

    def __init__(self, index: ClosestPoint, density: np.ndarray, unit: float):
        self.index, self.density, self.unit = index, density, unit
        self.even = np.ptp(density) == 0

    def __call__(self, points: np.ndarray) -> np.ndarray:
        if self.even:
            return np.full(len(points), self.unit)
        return self.unit / np.sqrt(self.density[self.index.nearest_face(points)])


def least_vertices(part: Part) -> int:
    """Vertices that a surface of this topology takes at least, closed ones by Heawood's bound (Jungerman, Ringel 1980).

    With a boundary of B edges, 3 for every loop at the least and n at the most, there are 3 (n - euler) - B edges, for
    which there have to be enough pairs of vertices.
    """
    if part.members:
        return sum(least_vertices(member) for member in part.members)
    if len(part.rim):
        rings = 3 * len(boundary_loops(part.triangles))
        return max(rings, int(np.ceil((5 + np.sqrt(25 - 24 * part.euler)) / 2 - 1e-9)))
    euler = min(part.euler, 2)
    return int(np.ceil((7 + np.sqrt(49 - 24 * euler)) / 2 - 1e-9))


def least_faces(part: Part, vertices: int) -> int:
    """Triangles of a part with so many vertices at least: with a boundary, when all of them are on it."""
    return vertices - 2 * part.euler if len(part.rim) else 2 * (vertices - part.euler)


def distribute(count: int, share: np.ndarray, least: np.ndarray) -> np.ndarray:
    """Whole numbers (k,) that sum to `count`, in proportion to `share` (k,) but none below `least` (k,), which sum to
    less.
    """
    given = least.astype(float)
    free = np.ones(len(share), dtype=bool)
    for _ in range(len(share)):
        room = count - least[~free].sum()
        given = np.where(free, room * share / max(share[free].sum(), 1e-300), least)
        low = free & (given < least)
        if not low.any():
            break
        free &= ~low
    whole = np.maximum(np.floor(given + 1e-9).astype(np.int64), least)
    order = np.argsort(whole - given, kind="stable")
    spare = count - int(whole.sum())
    if spare > 0:
        whole[order[np.arange(spare) % len(order)]] += 1
    while spare < 0:
        richest = int(np.argmax(whole - least))
        whole[richest] -= 1
        spare += 1
    return whole


def edge_size(measure: float, rim: float, count: int) -> float:
    """Edge length of `count` vertices in equilateral triangles on this much area, with a boundary of length `rim`."""
    a, b = 2 / np.sqrt(3) * measure, rim / 2
    return float(2 * a / (-b + np.sqrt(b * b + 4 * a * count)))


def adjust_count(draft: Draft, count: int, size: Size, anyhow: bool = False) -> Draft:
    """The mesh with exactly `count` vertices.

    Where there are too many the shortest edges collapse, where there are too few the longest are split, in
    comparison with the edge length that `size` gives at points (k,3).

    Where nothing else is possible faces may turn over, if `anyhow`.

    Raises
    ------
    StuckError : no edge can collapse any more
    """
    for _ in range(MOST_ROUNDS):
        missing = count - len(draft.points)
        if missing == 0:
            return draft
        h = interior_edges(draft.triangles, draft.locked)
        tail, head = halfedges(draft.triangles)
        a, b = draft.points[tail[h]], draft.points[head[h]]
        length = np.linalg.norm(a - b, axis=1) / size((a + b) / 2)
        if missing > 0:
            draft = _split(draft, h, length, missing)
            continue
        try:
            draft = _collapse(draft, h, length, -missing, LEAST_COSINE)
        except StuckError:
            if not anyhow:
                raise
            draft = _collapse(draft, h, length, -missing, ANY_COSINE)
    raise StuckError(draft)


def _split(draft: Draft, h: np.ndarray, length: np.ndarray, missing: int) -> Draft:
    wanted = np.argsort(-length, kind="stable")[: max(int(SHARE * missing), 8)]
    chosen = independent_splits(draft.triangles, h[wanted])[:missing]
    return settled(draft, split_edges(draft.points, draft.triangles, chosen))


def _collapse(draft: Draft, h: np.ndarray, length: np.ndarray, spare: int, least_cosine: float) -> Draft:
    order = np.argsort(length, kind="stable")
    reach = 4 * spare + 32
    while True:
        edit = collapse_edges(draft.points, draft.triangles, h[order[:reach]], draft.fixed, spare, least_cosine)
        if len(edit.points) < len(draft.points):
            return settled(draft, edit)
        if reach >= len(order):
            raise StuckError(draft)
        reach *= 4


def settled(draft: Draft, edit: Edit) -> Draft:
    """The draft after an edit, Delaunay again if it is to be."""
    fixed = np.where(edit.origin >= 0, draft.fixed[np.maximum(edit.origin, 0)], False)
    triangles = edit.triangles.copy()
    if draft.delaunay:
        make_delaunay_embedded(edit.points, triangles, twins(triangles), draft.locked, FLIP_ROUNDS)
    return replace(draft, points=edit.points, triangles=triangles, fixed=fixed)
