"""How many vertices go where, and meshes brought to an exact number of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .embedded_flips import make_delaunay_embedded
from .errors import CountError
from .mesh_edits import Edit, collapse_edges, independent_splits, interior_edges, split_edges
from .parts import Part
from .topology import halfedges, twins

MOST_ROUNDS = 500
# In one round only edges about as short, or as long, as the most wanted ones go.
SHARE = 0.3


def least_vertices(part: Part) -> int:
    """Vertices that a surface of this topology takes at least (Heawood's bound; Jungerman, Ringel 1980)."""
    if len(part.rim):
        return 3
    euler = min(part.euler, 2)
    return int(np.ceil((7 + np.sqrt(49 - 24 * euler)) / 2 - 1e-9))


def distribute(count: int, share: np.ndarray, least: np.ndarray) -> np.ndarray:
    """Whole numbers (k,) that sum to `count`, in proportion to `share` (k,) but none below `least` (k,).

    Raises CountError if there are not enough.
    """
    if count < least.sum():
        raise CountError(f"{count} vertices are too few: this topology takes at least {least.sum()}")
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


def adjust_count(
    points: np.ndarray,
    triangles: np.ndarray,
    fixed: np.ndarray,
    locked: np.ndarray,
    count: int,
    size: Callable[[np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mesh (n,3), (m,3) with exactly `count` vertices, and which of them are fixed, (count,) bool.

    Where there are too many the shortest edges collapse, where there are too few the longest are split, next to
    `size` of their middles. Edges with the keys `locked` and vertices that are `fixed` (n,) stay, and come first.

    Raises
    ------
    CountError : no edge can collapse any more
    """
    for _ in range(MOST_ROUNDS):
        missing = count - len(points)
        if missing == 0:
            return points, triangles, fixed
        h = interior_edges(triangles, locked)
        tail, head = halfedges(triangles)
        a, b = points[tail[h]], points[head[h]]
        length = np.linalg.norm(a - b, axis=1) / size((a + b) / 2)
        edit = _split(points, triangles, h, length, missing) if missing > 0 else None
        if edit is None:
            edit = _collapse(points, triangles, h, length, fixed, -missing)
        fixed = np.where(edit.origin >= 0, fixed[np.maximum(edit.origin, 0)], False)
        points, triangles = edit.points, edit.triangles.copy()
        make_delaunay_embedded(points, triangles, twins(triangles), locked, 5)
    raise CountError(f"{count} vertices cannot be reached")


def _split(points, triangles, h, length, missing: int) -> Edit:
    order = np.argsort(-length, kind="stable")
    wanted = order[: max(int(SHARE * missing), 8)]
    return split_edges(points, triangles, independent_splits(triangles, h[wanted])[:missing])


def _collapse(points, triangles, h, length, fixed, spare: int) -> Edit:
    order = np.argsort(length, kind="stable")
    reach = 4 * spare + 32
    while True:
        edit = collapse_edges(points, triangles, h[order[:reach]], fixed, spare)
        if len(edit.points) < len(points):
            return edit
        if reach >= len(order):
            raise CountError(f"Boundaries, features and topology take at least {len(points)} vertices")
        reach *= 4
