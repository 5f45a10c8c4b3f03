"""Straighten folds of a carried map where they are, by local Tutte systems and least steps, and move nothing else.

A map sampled at the vertices of another mesh may turn a face over where the map shears much within one face, or where
its boundary is crooked. Vertices around such faces are placed anew as averages of their neighbours with everything
around them fixed; the patch grows by a ring where that is not enough. Faces that only have vertices on boundaries
are pushed open.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, identity

from ..errors import PrecisionError
from ..linalg.sparse import solve_general
from ..mesh.geometry import halfedge_lengths, signed_areas
from ..mesh.topology import halfedges, pair_keys, pair_up, vertices_around
from .tutte import mean_value_weights

# Rings of vertices around folds that are placed anew, at most.
MOST_RINGS = 6
# A face with less area than this share of the square of its longest side is as good as folded.
LEAST_AREA = 1e-6
# What is pushed open gets this share of the area of the faces around it.
PUSHED_AREA = 0.05
# Rounds of that, at most.
PUSH_ROUNDS = 30


def straighten_folds(triangles: np.ndarray, uv: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, int]:
    """UVs (3t,2) of the corners of faces (t,3) without folds that the map they come from does not have.

    side (t,): -1, 0 or 1, which way the map they come from lies under each face. Where single faces of that map lie
    another way than those around them, nothing is asked of the new ones. Returns the UVs, and how many faces are left
    folded.
    """
    extent = np.ptp(uv, axis=0).max(initial=0.0)
    if not (extent > 0 and np.isfinite(uv).all()):
        return uv, 0
    points, faces, boundary = uv_vertices(triangles, uv, 1e-7 * extent)
    side = _agreed(faces, np.sign(side).astype(np.int64))
    moved = _pushed(_averaged(points, faces, side, boundary), faces, side)
    left = int(_folded(moved, faces, side).sum())
    return np.where((moved != points).any(axis=1)[faces.ravel(), None], moved[faces.ravel()], uv), left


def inner_folds_straightened(uv: np.ndarray, triangles: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """A map (n,2) whose vertices around folds are averages of their neighbours, but for those `fixed` (n,) bool."""
    return _averaged(uv, triangles, np.ones(len(triangles), np.int64), fixed)


def uv_vertices(triangles: np.ndarray, uv: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (3t,2) of a mesh (t,3) joined where they are one vertex and about `tolerance` apart at most.

    Returns the map (u,2), its faces (t,3), and which of its vertices (u,) are on an boundary.
    """
    key = np.column_stack([triangles.ravel(), np.round(uv / tolerance).astype(np.int64)])
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    faces = inverse.reshape(-1, 3).astype(np.int64)
    tail, head = halfedges(faces)
    _, index, count = np.unique(pair_keys(tail, head), return_index=True, return_counts=True)
    open_edges = index[count == 1]
    boundary = np.zeros(len(first), dtype=bool)
    boundary[tail[open_edges]] = boundary[head[open_edges]] = True
    return uv[first], faces, boundary


def _agreed(faces: np.ndarray, side: np.ndarray) -> np.ndarray:
    """The sides (t,) where those of the faces across the edges agree with them on the whole, 0 elsewhere."""
    first, second = pair_up(pair_keys(*halfedges(faces)))
    a, b = first // 3, second // 3
    around = np.bincount(np.concatenate([a, b]), side[np.concatenate([b, a])], len(side))
    return np.where(around * side >= 0, side, 0)


def _folded(uv: np.ndarray, faces: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Faces (t,) bool that lie another way than `side` (t,) says, or have hardly an area; none where that is 0."""
    longest = halfedge_lengths(uv, faces).reshape(-1, 3).max(axis=1)
    return (side * signed_areas(uv, faces) <= LEAST_AREA * longest**2) & (side != 0)


def _area_around(uv: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Mean area (t,) of the faces that share a vertex with each; maps may differ in scale by powers of ten."""
    area = np.abs(signed_areas(uv, faces))
    count = np.bincount(faces.ravel(), minlength=len(uv))
    mean = np.bincount(faces.ravel(), np.repeat(area, 3), len(uv)) / np.maximum(count, 1)
    return mean[faces].mean(axis=1)


def _averaged(uv: np.ndarray, faces: np.ndarray, side: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """The map (u,2) with vertices around folded faces at averages of their neighbours, those `fixed` (u,) excepted.

    The weights are mean value weights of the map itself (Floater 2003), all angles taken as positive: they reproduce
    what is valid and pull straight what is not, see `untangle.untangle`.
    """
    best, folded = uv, _folded(uv, faces, side)
    if not folded.any():
        return uv
    fewest, chosen = int(folded.sum()), np.zeros(len(uv), dtype=bool)
    weights = _mean_value_matrix(uv, faces)
    for rings in range(MOST_RINGS):
        chosen |= vertices_around(faces, folded, len(uv), rings)
        candidate = _solved(uv, weights, np.flatnonzero(chosen & ~fixed))
        folded = _folded(candidate, faces, side)
        if folded.sum() < fewest:
            best, fewest = candidate, int(folded.sum())
        if fewest == 0:
            break
    return best


def _mean_value_matrix(uv: np.ndarray, faces: np.ndarray) -> csr_matrix:
    """Mean value weights (u,u), every row with the sum 1."""
    at_tail, at_head = mean_value_weights(halfedge_lengths(uv, faces).reshape(-1, 3))
    tail, head = halfedges(faces)
    rows, columns = np.concatenate([tail, head]), np.concatenate([head, tail])
    data = np.concatenate([at_tail.ravel(), at_head.ravel()])
    total = np.bincount(rows, data, len(uv))
    return csr_matrix((data / total[rows], (rows, columns)), shape=(len(uv),) * 2)


def _solved(uv: np.ndarray, weights: csr_matrix, free: np.ndarray) -> np.ndarray:
    """The map with the vertices `free` (k,) at the weighted averages of their neighbours; as it is if none are."""
    if len(free) == 0:
        return uv
    rows, solved = weights[free], uv.copy()
    solved[free] = 0
    system = identity(len(free), format="csr") - rows[:, free]
    try:
        solved[free] = solve_general(system, rows @ solved)
    except PrecisionError:
        # Nothing around them is fixed: an island whose every face is folded has no shape to go by.
        return uv
    return solved


def _pushed(uv: np.ndarray, faces: np.ndarray, side: np.ndarray) -> np.ndarray:
    """The map with the vertices of folded faces, on boundaries too, moved until each of these has a little area.

    Every round takes, for each such face by itself, the least step that gives it the area.
    """
    best = current = uv
    goal = PUSHED_AREA * _area_around(uv, faces)
    folded = _folded(uv, faces, side)
    pushed, fewest = folded, int(folded.sum())
    for _ in range(PUSH_ROUNDS):
        if fewest == 0:
            break
        area = side * signed_areas(current, faces)
        low = np.flatnonzero(pushed & (area < goal / 2))
        current = current.copy()
        np.add.at(
            current, faces[low].ravel(), _area_steps(current[faces[low]], side[low], (goal - area)[low]).reshape(-1, 2)
        )
        folded = _folded(current, faces, side)
        pushed = pushed | folded
        if folded.sum() < fewest:
            best, fewest = current, int(folded.sum())
    return best


def _area_steps(corners: np.ndarray, side: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """Least steps (k,3,2) of the corners (k,3,2) of faces that add the missing areas (k,) to first order."""
    across = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    gradient = 0.5 * side[:, None, None] * np.stack([-across[..., 1], across[..., 0]], axis=-1)
    return gradient * (missing / np.maximum((gradient**2).sum(axis=(1, 2)), 1e-300))[:, None, None]
