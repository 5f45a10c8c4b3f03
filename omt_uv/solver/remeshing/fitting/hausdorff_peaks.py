"""Lower the largest distances of a fitted mesh: other triangles and places are tried around them, and the best kept.

Where a crest or a groove is narrower than an edge, the least squares of a fit have many minima, and these places
decide on the Hausdorff distance. Local operations that are tried and measured are Hu, Yan, Bao, Alliez, Benes 2017;
here all places, and all that is tried there, go at once, as copies of small patches of the mesh.
"""

from __future__ import annotations

import numpy as np

from ...mesh.geometry import face_areas, vertex_normals
from ...progress import Progress, Steps
from ..edits.working_mesh import WorkingMesh
from ..relaxation.surface_samples import SurfaceSamples
from .closest_pairs import DENSE, DENSER, ClosestPairs
from .fit_state import FitState
from .local_trials import TRIALS, TrialBatch, acceptable, distance_norms, find_peaks, patch_shapes, put_best_back
from .random_search import search_randomly
from .ring_patches import RingPatches, cut_patches, spaced_faces, within_rings

# Distances of so many times the usual one (the root of the mean square) are peaks.
PEAK = 8.0
# Rings of vertices around a peak that move.
RINGS = 1
# How often peaks are looked for,
PASSES = 4
# and how many at once at most, next to the vertices.
MAX_PEAKS = 0.002
# Share by which the norm of a patch's distances has to fall.
GAIN = 0.03
# What is left above so many times the usual distance is searched by random moves,
HIGH = 10.0
# so often,
SEARCHES = 60
# each time the peaks not below this share of the highest,
HIGHEST = 0.8
# and so many at most, next to the vertices.
MAX_SEARCHED = 0.004
# A peak that stays counts as this much lower the next time.
DEMOTION = 0.95
# Where distances are so many times the usual one all vertices of the surface are samples,
LOOK = 3.0
# so many times as far around as the next sample is,
SPREAD = 2.0
# or so many rings.
MAX_RINGS = 8
# Their weight next to that of another sample.
EXTRA_WEIGHT = 0.03
# The same distance for random moves, which find every place that no sample sees,
LOOK_AGAIN = 1.5
# and rings.
MAX_RINGS_AGAIN = 16


def lower_peaks(state: FitState) -> Steps[WorkingMesh]:
    """Lower the largest distances of a fitted mesh to the surface; steps of the mesh.

    It has as many vertices, and the angles and lengths of its edges are not much worse.
    """
    rms, n = state.recent.rms, len(state.points)
    look_closer(state, state.recent.distance, LOOK * rms, MAX_RINGS, DENSE)
    pairs = state.pairs()
    stuck = np.zeros(len(state.triangles), dtype=bool)
    for k in range(PASSES):
        largest = pairs.largest_distance(len(state.triangles))
        middle = _highest(state, largest, (largest > PEAK * rms) & ~stuck, 2 * RINGS + 2, MAX_PEAKS)
        if len(middle) == 0:
            break
        better = _lowered(state, pairs, cut_patches(state.triangles, middle, n, RINGS), rms)
        stuck[middle[~better]] = True
        yield Progress("Fit", 0.5 * (k + 1) / PASSES)
    yield from _search(state, pairs, rms)
    return state.mesh


def _highest(state: FitState, largest: np.ndarray, high: np.ndarray, gap: int, most: float) -> np.ndarray:
    """The faces with the largest distances (m,) among those that are `high` (m,) bool, so many edges apart, and no more
    than `most` times as many as vertices."""
    faces, n = np.flatnonzero(high), len(state.points)
    faces = faces[np.argsort(-largest[faces], kind="stable")]
    return spaced_faces(state.triangles, faces, n, gap, int(np.ceil(most * n)))


def _search(state: FitState, pairs: ClosestPairs, rms: float) -> Steps[None]:
    """Move the corners of the highest peaks at random, and look closer before, or peaks move to where no sample is."""
    random, m, n = np.random.default_rng(0), len(state.triangles), len(state.points)
    if pairs.distance.max() <= HIGH * rms:
        return
    look_closer(state, pairs.distance, LOOK_AGAIN * rms, MAX_RINGS_AGAIN, DENSER)
    pairs, priority = state.pairs(), np.ones(m)
    for k in range(SEARCHES):
        largest = pairs.largest_distance(m) * priority
        middle = _highest(state, largest, largest > max(HIGH * rms, HIGHEST * largest.max()), 2, MAX_SEARCHED)
        if len(middle) == 0:
            break
        better = search_randomly(state, pairs, cut_patches(state.triangles, middle, n, 0), HIGH * rms, random)
        priority[middle[~better]] *= DEMOTION
        yield Progress("Fit", 0.5 + 0.5 * (k + 1) / SEARCHES)


def look_closer(state: FitState, distance: np.ndarray, far: float, most_rings: int, places: np.ndarray) -> None:
    """Add the vertices of the surface to the samples around those whose distances (s,) to the mesh are far, and look at
    these places (r,3) of its triangles."""
    samples, index = state.pairing.samples, state.index
    s, V, T = len(samples.points), index.vertices, index.triangles
    near = np.zeros(len(V), dtype=bool)
    near[T[samples.faces[distance[:s] > far]]] = True
    pitch, edge = np.sqrt(samples.area.sum() / s), np.sqrt(face_areas(V, T).sum() / len(T))
    near = within_rings(T, near, min(int(np.ceil(SPREAD * pitch / edge)), most_rings))
    # Tips, and those around what was looked at before, are samples already.
    corners = T[samples.faces]
    near[corners[(V[corners] == samples.points[:, None]).all(axis=2)]] = False
    at, corner = np.flatnonzero(near), np.zeros(len(V), np.int64)
    corner[T.ravel()] = np.arange(T.size)
    normals = vertex_normals(V, T)[at]
    area = np.full(len(at), EXTRA_WEIGHT * samples.area.sum() / s)
    state.add_samples(SurfaceSamples(points=V[at], normals=normals, area=area, faces=corner[at] // 3), places)


def _lowered(state: FitState, pairs: ClosestPairs, patches: RingPatches, rms: float) -> np.ndarray:
    """Try all changes on all patches, and keep the best in the mesh and its pairs: where one was good, (p,) bool."""
    p = len(patches)
    batch = TrialBatch(state, find_peaks(state, pairs, patches))
    batch.vary()
    trial = batch.run(rms)
    after = trial.pairs()
    owner = np.full(len(state.triangles), -1)
    owner[patches.faces] = patches.of_face
    before = distance_norms(pairs, len(owner), owner, p)
    norm = distance_norms(after, len(batch.owner), batch.owner, TRIALS * p).reshape(TRIALS, p)
    shape = patch_shapes(state.points[patches.vertices], patches.triangles, patches.of_face, p)
    norm[~acceptable(shape, patch_shapes(trial.points, trial.triangles, batch.owner, p, trial.twin))] = np.inf
    best = np.where(norm.min(axis=0) < (1 - GAIN) * before, norm.argmin(axis=0), -1)
    put_best_back(batch, trial, after, pairs, best)
    return best >= 0
