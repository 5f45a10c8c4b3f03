"""The largest distances of a fitted mesh lowered once more: the corners of the triangles there move at random, and what
lowers the distances is kept.

The largest of distances to closest points has kinks wherever these jump, as they do in a groove: steps of least
squares, whose closest points stay, end above its minima, and random ones with closest points found anew go on
(a (1, c)-evolution strategy: Rechenberg 1973).
"""

from __future__ import annotations

import numpy as np

from ...mesh.geometry import face_normals, least_angles
from ...mesh.topology import halfedges
from .closest_pairs import Pairs
from .fit_state import Fitting
from .local_trials import Batch, norms, peaks_of, put_back, shapes, sound
from .ring_patches import Patches
from .shape_terms import smallness

# Copies of every patch, the first of which stays as it is, are at least so many, and of all patches about so many
# together; how often these are made.
COPIES, TOGETHER, ROUNDS = 16, 32, 12
# Lengths of moves, in edges, evenly over their logarithms; along the normal this share of them; and how many of the
# corners move.
SHORTEST, LONGEST, ALONG_NORMAL, MOVING = 0.02, 0.15, 0.5, 0.6
# What a move has to lower the cost by: distances, next to those that are enough, and angles that are small.
GAIN, SHAPE = 0.002, 0.03
# Angles may come down to this.
LEAST_ANGLE = np.radians(36.0)


def search(fitting: Fitting, pairs: Pairs, patches: Patches, enough: float, random: np.random.Generator) -> np.ndarray:
    """Move what is not on the outer ring of patches at random: where that lowered distances, (p,) bool.

    Down to `enough`: from there on shapes alone count. No angle gets smaller than it was and than LEAST_ANGLE.
    """
    copies = max(COPIES, TOGETHER // len(patches))
    batch = Batch(fitting, peaks_of(fitting, pairs, patches), copies)
    trial, p, v = batch.mesh(), len(patches), len(patches.vertices)
    kept = fitting.points[patches.vertices]
    before = shapes(kept, patches.triangles, patches.of_face, p)
    limit = np.minimum(least_angles(kept, patches.triangles), LEAST_ANGLE)
    free = ~_held(fitting, batch)
    better = np.zeros(p, dtype=bool)
    for _ in range(ROUNDS):
        moves = _moves(kept, patches, copies, random) * free[:, None]
        trial.place((kept + moves).reshape(-1, 3))
        after = trial.pairs()
        norm = norms(after, len(batch.piece), batch.piece, copies * p).reshape(copies, p)
        bad = np.bincount(batch.piece, smallness(trial.points, trial.triangles), copies * p).reshape(copies, p)
        cost = np.maximum(norm / enough, 1) + SHAPE * bad
        ok = sound(before, shapes(trial.points, trial.triangles, batch.piece, p))
        small = (least_angles(trial.points, trial.triangles).reshape(copies, -1) < limit).ravel()
        ok &= np.bincount(batch.piece, small, copies * p).reshape(copies, p) == 0
        cost[1:][~ok[1:]] = np.inf
        best = np.where(cost.min(axis=0) < (1 - GAIN) * cost[0], cost.argmin(axis=0), 0)
        kept = trial.points.reshape(copies, v, 3)[best[patches.of_vertex], np.arange(v)]
        better |= best > 0
    put_back(batch, trial, after, pairs, np.where(better, best, -1))
    return better


def _held(fitting: Fitting, batch: Batch) -> np.ndarray:
    """Vertices (v,) bool of patches that stay: fixed ones, the outer ring, and the boundary."""
    tail, head = halfedges(fitting.triangles)
    rim, edge = np.zeros(len(fitting.points), dtype=bool), fitting.twin < 0
    rim[tail[edge]] = rim[head[edge]] = True
    vertices = batch.patches.vertices
    return batch.fixed[: len(vertices)] | rim[vertices]


def _moves(points: np.ndarray, patches: Patches, copies: int, random: np.random.Generator) -> np.ndarray:
    """Random moves (c,v,3) of vertices (v,3) in the frames of the triangles in the middle, none in the first copy."""
    middle = patches.triangles[patches.middle]
    along, up = points[middle[:, 1]] - points[middle[:, 0]], face_normals(points, middle)
    length = np.linalg.norm(along, axis=1, keepdims=True)
    frame = np.stack([along, np.cross(up, along), ALONG_NORMAL * length * up], axis=1)
    shape = (copies, len(points), 1)
    size = SHORTEST * (LONGEST / SHORTEST) ** random.random((copies, len(patches), 1))[:, patches.of_vertex]
    size *= random.random(shape) < MOVING
    size[0] = 0
    return size * np.einsum("cvk,vkj->cvj", random.standard_normal((*shape[:2], 3)), frame[patches.of_vertex])
