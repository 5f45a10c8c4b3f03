"""Lower the largest distances of a fitted mesh once more, by random moves of the corners of the triangles there.

The largest of distances to closest points has kinks wherever these jump, as they do in a groove: steps of least
squares, whose closest points stay, end above its minima, and random ones with closest points found anew go on
(a (1, c)-evolution strategy: Rechenberg 1973).
"""

from __future__ import annotations

import numpy as np

from ...mesh.geometry import cross3, face_normals, least_angles
from ...mesh.topology import halfedges
from .closest_pairs import ClosestPairs
from .fit_state import FitState
from .local_trials import TrialBatch, acceptable, distance_norms, find_peaks, patch_shapes, put_best_back
from .ring_patches import RingPatches
from .shape_terms import smallness

# Copies of every patch at least, the first of which stays as it is,
COPIES = 16
# and of all patches together about.
COPIES_TOGETHER = 32
# How often these are made.
ROUNDS = 8
# Shortest and longest moves, in edges, evenly over their logarithms.
SHORTEST = 0.02
LONGEST = 0.15
# Share of them along the normal.
ALONG_NORMAL = 0.5
# Share of the corners that move.
MOVING = 0.6
# Share by which a move has to lower the cost,
GAIN = 0.002
# which is the distance, next to the target, and so much times how small angles are.
SHAPE_WEIGHT = 0.03
# Angle, radians, to which angles may come down.
MIN_ANGLE = np.radians(36.0)


def search_randomly(
    state: FitState, pairs: ClosestPairs, patches: RingPatches, target: float, random: np.random.Generator
) -> np.ndarray:
    """Move what is not on the outer ring of patches at random: where that lowered distances, (p,) bool.

    Below the `target` shapes alone count. No angle gets smaller than it was and than MIN_ANGLE. A (1, c)-evolution
    strategy (Rechenberg 1973) with c copies, on a norm of the largest distances.
    """
    copies = max(COPIES, COPIES_TOGETHER // len(patches))
    batch = TrialBatch(state, find_peaks(state, pairs, patches), copies)
    trial, p, v = batch.mesh(), len(patches), len(patches.vertices)
    kept = state.points[patches.vertices]
    before = patch_shapes(kept, patches.triangles, patches.of_face, p)
    limit = np.minimum(least_angles(kept, patches.triangles), MIN_ANGLE)
    free = ~_fixed_in(state, batch)
    better = np.zeros(p, dtype=bool)
    for _ in range(ROUNDS):
        moves = _moves(kept, patches, copies, random) * free[:, None]
        trial.place((kept + moves).reshape(-1, 3))
        after = trial.pairs()
        norm = distance_norms(after, len(batch.owner), batch.owner, copies * p).reshape(copies, p)
        bad = np.bincount(batch.owner, smallness(trial.points, trial.triangles), copies * p).reshape(copies, p)
        cost = np.maximum(norm / target, 1) + SHAPE_WEIGHT * bad
        ok = acceptable(before, patch_shapes(trial.points, trial.triangles, batch.owner, p, trial.twin))
        small = (least_angles(trial.points, trial.triangles).reshape(copies, -1) < limit).ravel()
        ok &= np.bincount(batch.owner, small, copies * p).reshape(copies, p) == 0
        cost[1:][~ok[1:]] = np.inf
        best = np.where(cost.min(axis=0) < (1 - GAIN) * cost[0], cost.argmin(axis=0), 0)
        kept = trial.points.reshape(copies, v, 3)[best[patches.of_vertex], np.arange(v)]
        better |= best > 0
    put_best_back(batch, trial, after, pairs, np.where(better, best, -1))
    return better


def _fixed_in(state: FitState, batch: TrialBatch) -> np.ndarray:
    """Vertices (v,) bool of patches that stay: fixed ones, the outer ring, and the boundary."""
    tail, head = halfedges(state.triangles)
    boundary, edge = np.zeros(len(state.points), dtype=bool), state.twin < 0
    boundary[tail[edge]] = boundary[head[edge]] = True
    vertices = batch.patches.vertices
    return batch.fixed[: len(vertices)] | boundary[vertices]


def _moves(points: np.ndarray, patches: RingPatches, copies: int, random: np.random.Generator) -> np.ndarray:
    """Random moves (c,v,3) of vertices (v,3) in the frames of the triangles in the middle, none in the first copy."""
    middle = patches.triangles[patches.middle]
    along, up = points[middle[:, 1]] - points[middle[:, 0]], face_normals(points, middle)
    length = np.linalg.norm(along, axis=1, keepdims=True)
    frame = np.stack([along, cross3(up, along), ALONG_NORMAL * length * up], axis=1)
    shape = (copies, len(points), 1)
    size = SHORTEST * (LONGEST / SHORTEST) ** random.random((copies, len(patches), 1))[:, patches.of_vertex]
    size *= random.random(shape) < MOVING
    size[0] = 0
    return size * np.einsum("cvk,vkj->cvj", random.standard_normal((*shape[:2], 3)), frame[patches.of_vertex])
