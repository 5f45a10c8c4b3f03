"""The largest distances of a fitted mesh lowered: around each of them other triangles and places are tried, and what
comes nearest to the surface is kept.

Where a crest or a groove is narrower than an edge, the least squares of a fit have many minima, and these places
decide on the Hausdorff distance. Local operations that are tried and measured are Hu, Yan, Bao, Alliez, Benes 2017;
here all places, and all that is tried there, go at once, as copies of small pieces of the mesh.
"""

from __future__ import annotations

import numpy as np

from ...mesh.closest_point import ClosestPoint
from ...mesh.geometry import face_areas, vertex_normals
from ...progress import Progress, Steps
from ..edits.working_mesh import Draft
from ..relaxation.surface_samples import Samples, joined
from .closest_pairs import DENSE, DENSER, Pairing, Pairs, Start
from .fit_state import Fitting
from .local_trials import TRIALS, Batch, norms, peaks_of, put_back, shapes, sound
from .random_search import search
from .ring_patches import Patches, apart, cut_out, grown

# Distances of so many times the usual one are peaks.
PEAK = 8.0
# Rings of vertices around a peak that move; how often peaks are looked for, and how many then, next to the vertices.
RINGS = 1
PASSES, MOST = 4, 0.002
# The norm of a patch's distances has to fall by this share.
GAIN = 0.03
# What is left above so many times the usual distance is searched by random moves.
HIGH = 10.0
# How often: peaks not below this share of the highest, so many next to the vertices; one that stays counts as this much
# lower.
SEARCHES, SHARE, MOST_SEARCHED, TIRED = 60, 0.8, 0.004, 0.95
# Where distances are so many times the usual one all vertices of the surface are samples, this many times as far around
# as the next sample is, or so many rings; next to the weight of a sample, theirs is small.
LOOK, SPREAD, MOST_RINGS, WEIGHT = 3.0, 2.0, 8, 0.03
# The same for random moves, which find every place that no sample sees.
LOOK_AGAIN, MORE_RINGS = 1.5, 16


def lower_peaks(fitting: Fitting) -> Steps[Draft]:
    """The mesh of a fit with smaller largest distances to the surface, as many vertices, and the angles and lengths of
    edges not much worse."""
    usual, n = fitting.recent.usual, len(fitting.points)
    look_closer(fitting, fitting.recent.distance, LOOK * usual, MOST_RINGS, DENSE)
    pairs = fitting.pairs()
    stuck = np.zeros(len(fitting.triangles), dtype=bool)
    for k in range(PASSES):
        worst = pairs.worst(len(fitting.triangles))
        high = np.flatnonzero((worst > PEAK * usual) & ~stuck)
        high = high[np.argsort(-worst[high], kind="stable")]
        middle = apart(fitting.triangles, high, n, 2 * RINGS + 2, int(np.ceil(MOST * n)))
        if len(middle) == 0:
            break
        better = _lowered(fitting, pairs, cut_out(fitting.triangles, middle, n, RINGS), usual)
        stuck[middle[~better]] = True
        yield Progress("Fit", 0.5 * (k + 1) / PASSES)
    yield from _search(fitting, pairs, usual)
    return fitting.draft


def _search(fitting: Fitting, pairs: Pairs, usual: float) -> Steps[None]:
    """Move the corners of the highest peaks at random, and look closer before, or peaks move to where no sample is."""
    random, m, n = np.random.default_rng(0), len(fitting.triangles), len(fitting.points)
    if pairs.distance.max() <= HIGH * usual:
        return
    look_closer(fitting, pairs.distance, LOOK_AGAIN * usual, MORE_RINGS, DENSER)
    pairs, tired = fitting.pairs(), np.ones(m)
    for k in range(SEARCHES):
        worst = pairs.worst(m) * tired
        high = np.flatnonzero(worst > max(HIGH * usual, SHARE * worst.max()))
        high = high[np.argsort(-worst[high], kind="stable")]
        middle = apart(fitting.triangles, high, n, 2, int(np.ceil(MOST_SEARCHED * n)))
        if len(middle) == 0:
            break
        better = search(fitting, pairs, cut_out(fitting.triangles, middle, n, 0), HIGH * usual, random)
        tired[middle[~better]] *= TIRED
        yield Progress("Fit", 0.5 + 0.5 * (k + 1) / SEARCHES)


def look_closer(fitting: Fitting, distance: np.ndarray, far: float, most_rings: int, places: np.ndarray) -> None:
    """Add the vertices of the surface to the samples around those whose distances (s,) to the mesh are far,
    and look at these places (r,3) of its triangles."""
    pairing, index = fitting.pairing, fitting.index
    samples = pairing.samples
    s, V, T = len(samples.points), index.vertices, index.triangles
    near = np.zeros(len(V), dtype=bool)
    near[T[samples.faces[distance[:s] > far]]] = True
    pitch, edge = np.sqrt(samples.area.sum() / s), np.sqrt(face_areas(V, T).sum() / len(T))
    near = grown(T, near, min(int(np.ceil(SPREAD * pitch / edge)), most_rings))
    at, corner = np.flatnonzero(near), np.zeros(len(V), np.int64)
    corner[T.ravel()] = np.arange(T.size)
    normals = vertex_normals(V, T)[at]
    extra = Samples(V[at], normals, np.full(len(at), WEIGHT * samples.area.sum() / s), corner[at] // 3)
    mesh = ClosestPoint(fitting.points, fitting.triangles, index.spacing)
    there = np.append(pairing.there, mesh(extra.points, normals).faces)
    start = Start(there, pairing.back_of(places), pairing.per_vertex, places)
    fitting.pairing = Pairing(index, joined(samples, extra), start)


def _lowered(fitting: Fitting, pairs: Pairs, patches: Patches, usual: float) -> np.ndarray:
    """Try everything on all patches, and keep in the mesh and its pairs what is best: where something was, (p,)."""
    p = len(patches)
    batch = Batch(fitting, peaks_of(fitting, pairs, patches))
    batch.vary()
    trial = batch.run(usual)
    after = trial.pairs()
    piece = np.full(len(fitting.triangles), -1)
    piece[patches.faces] = patches.of_face
    before = norms(pairs, len(piece), piece, p)
    norm = norms(after, len(batch.piece), batch.piece, TRIALS * p).reshape(TRIALS, p)
    shape = shapes(fitting.points[patches.vertices], patches.triangles, patches.of_face, p)
    norm[~sound(shape, shapes(trial.points, trial.triangles, batch.piece, p))] = np.inf
    best = np.where(norm.min(axis=0) < (1 - GAIN) * before, norm.argmin(axis=0), -1)
    put_back(batch, trial, after, pairs, best)
    return best >= 0
