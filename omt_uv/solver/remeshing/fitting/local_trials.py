"""Try several changes on patches of a mesh, each on a copy of its own, all at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.closest_point import ClosestPointTracker
from ...mesh.geometry import angles_from_lengths, face_normals, halfedge_lengths
from ...mesh.topology import halfedges, pair_keys, twins
from ..edits.delaunay_flips import flip_if_valid
from ..edits.working_mesh import WorkingMesh
from ..relaxation.surface_samples import select_samples
from .closest_pairs import NEVER, ClosestPairs, Pairing, PairingStart
from .fit_state import FitState, PatchSource
from .ring_patches import RingPatches

# Nothing but the steps, one of three vertices put on the peak first, or one of three edges flipped first.
TRIALS = 7
# Steps with vertices held on the peaks,
HELD_STEPS = 1
# and after these.
FREE_STEPS = 2
# Patches count by this norm of the largest distances of their triangles.
NORM = 8
# Angle, radians, to which a patch may come, or stay below where it was,
MIN_ANGLE = np.radians(31.0)
# cosine between the normals of neighbours,
MIN_COSINE = -0.5
# or by so much less than it was,
COSINE_LOSS = 0.2
# and standard deviation of its edges' lengths, in means,
MAX_VARIATION = 0.2
# or so many times what it was.
VARIATION_GAIN = 1.2


@dataclass(frozen=True)
class PatchPeaks:
    """The largest distance of every patch, and the samples that belong to the patches.

    face (p,): in which of the patches' triangles it is; barycentric (p,3): where; target (p,3): the point of the
    surface there; samples (s,): the numbers of the samples of the surface that are nearest to the patches, sample_faces
    (s,): to which of their triangles
    """

    patches: RingPatches
    face: np.ndarray
    barycentric: np.ndarray
    target: np.ndarray
    samples: np.ndarray
    sample_faces: np.ndarray


def find_peaks(state: FitState, pairs: ClosestPairs, patches: RingPatches) -> PatchPeaks:
    """Find the largest distance of every patch of a mesh with these pairs."""
    number = np.full(len(state.triangles), -1)
    number[patches.faces] = np.arange(len(patches.faces))
    mine = np.flatnonzero(number[pairs.faces] >= 0)
    face = number[pairs.faces[mine]]
    order = np.argsort(pairs.distance[mine], kind="stable")
    last = np.zeros(len(patches), np.int64)
    last[patches.of_face[face[order]]] = order
    peak, bary = mine[last], pairs.barycentric[mine[last]]
    corners = state.points[state.triangles[pairs.faces[peak]]]
    target = np.einsum("pc,pcj->pj", bary, corners) + pairs.offset[peak]
    samples = mine < pairs.sample_count
    return PatchPeaks(
        patches=patches,
        face=face[last],
        barycentric=bary,
        target=target,
        samples=mine[samples],
        sample_faces=face[samples],
    )


class TrialBatch:
    """Copies of patches, one after the other, and a mesh of all of them on its way to the surface.

    owner (c f,): of every triangle, which of the c p patches it is of
    """

    def __init__(self, state: FitState, peaks: PatchPeaks, copies: int = TRIALS):
        patches = peaks.patches
        self.whole, self.peaks, self.patches, self.copies = state, peaks, patches, copies
        v, f, p = len(patches.vertices), len(patches.faces), len(patches)
        copy = np.arange(copies)[:, None]
        self.points = np.tile(state.points[patches.vertices], (copies, 1))
        self.triangles = (patches.triangles + v * copy[:, :, None]).reshape(-1, 3)
        self.owner = (patches.of_face + p * copy).ravel()
        self.fixed = np.tile(patches.outer | state.start.fixed[patches.vertices], copies)
        self.outer, self.held = np.tile(patches.outer, copies), self.fixed.copy()
        tail, head = halfedges(self.triangles)
        whole = np.tile(patches.vertices, copies)
        self.keep = np.isin(pair_keys(whole[tail], whole[head]), state.start.locked)
        self.locked = np.unique(pair_keys(tail[self.keep], head[self.keep]))
        surface_faces = state.pairing.surface_faces.reshape(len(state.triangles), -1)[patches.faces]
        self._start = PairingStart(
            mesh_faces=(peaks.sample_faces + f * copy).ravel(),
            surface_faces=np.tile(surface_faces.ravel(), copies),
            area_per_vertex=state.pairing.area_per_vertex,
            places=state.pairing.places,
            patch=self.owner,
        )

    def vary(self) -> None:
        """Change the copies, each in its way: see TRIALS."""
        v, f = len(self.patches.vertices), len(self.patches.faces)
        nearest = np.argsort(-self.peaks.barycentric, axis=1, kind="stable")
        corners = np.take_along_axis(self.patches.triangles[self.peaks.face], nearest, axis=1)
        for k in range(3):
            moved = corners[:, k] + v * (1 + k)
            free = ~self.fixed[moved]
            self.points[moved[free]] = self.peaks.target[free]
            self.held[moved[free]] = True
            h = 3 * (self.peaks.face + f * (4 + k)) + k
            new = flip_if_valid(self.points, self.triangles, h, self.keep, self.outer)
            self.locked = np.union1d(self.locked, new)

    def mesh(self) -> FitState:
        """The mesh of all copies as they are now."""
        whole = self.whole
        samples = select_samples(whole.pairing.samples, np.tile(self.peaks.samples, self.copies))
        memory = ClosestPointTracker(NEVER, start=np.tile(whole.on.faces[self.patches.vertices], self.copies))
        mesh = WorkingMesh(self.points, self.triangles, self.fixed, self.locked)
        return FitState(mesh, Pairing(whole.index, samples, self._start), whole.density, memory, self.outer)

    def run(self, rms: float) -> FitState:
        """The mesh of all copies after some steps."""
        trial = self.mesh()
        trial.flip()
        for k in range(HELD_STEPS + FREE_STEPS):
            held = self.held if k < HELD_STEPS else self.fixed
            if not trial.step(rms, held, keep_centroids=k < HELD_STEPS):
                break
        return trial


def distance_norms(pairs: ClosestPairs, m: int, owner: np.ndarray, count: int) -> np.ndarray:
    """Norm of the largest distances of every patch's triangles, (count,); owner (m,): patch of each, -1 for none."""
    mine, largest = owner >= 0, pairs.largest_distance(m)
    highest = max(float(largest.max(initial=0)), 1e-300)
    return highest * np.bincount(owner[mine], (largest[mine] / highest) ** NORM, count) ** (1 / NORM)


@dataclass(frozen=True)
class PatchShapes:
    """Of every patch, (c,p) each: the least angle, radians, the least cosine between the normals of neighbours, and the
    standard deviation of the edges' lengths, in means."""

    angle: np.ndarray
    cosine: np.ndarray
    variation: np.ndarray


def patch_shapes(
    points: np.ndarray, triangles: np.ndarray, owner: np.ndarray, patches: int, twin: np.ndarray | None = None
) -> PatchShapes:
    """Measure the shapes of the patches of a mesh (n,3), (m,3), (c,p) for p `patches`; owner (m,): patch of each.

    twin (3m,): opposite halfedges, where they are known
    """
    length, normal = halfedge_lengths(points, triangles), face_normals(points, triangles)
    twin = twins(triangles) if twin is None else twin
    count = int(owner.max()) + 1
    angle, cosine = np.full(count, np.pi), np.ones(count)
    np.minimum.at(angle, owner, angles_from_lengths(length.reshape(-1, 3)).min(axis=1))
    h = np.flatnonzero(twin >= 0)
    np.minimum.at(cosine, owner[h // 3], np.einsum("hi,hi->h", normal[h // 3], normal[twin[h] // 3]))
    of_halfedge = np.repeat(owner, 3)
    number = np.maximum(np.bincount(of_halfedge, minlength=count), 1)
    mean = np.maximum(np.bincount(of_halfedge, length, count) / number, 1e-300)
    square = np.bincount(of_halfedge, length**2, count) / number / mean**2
    variation = np.sqrt(np.maximum(square - 1, 0))
    return PatchShapes(*(values.reshape(-1, patches) for values in (angle, cosine, variation)))


def acceptable(before: PatchShapes, after: PatchShapes) -> np.ndarray:
    """Which patches, (c,p) bool, are in as good a shape as can be asked for, or as before (1,p)."""
    return (
        (after.angle >= np.minimum(before.angle, MIN_ANGLE))
        & (after.cosine >= np.minimum(before.cosine - COSINE_LOSS, MIN_COSINE))
        & (after.variation <= np.maximum(before.variation * VARIATION_GAIN, MAX_VARIATION))
    )


def put_best_back(
    batch: TrialBatch, trial: FitState, after: ClosestPairs, pairs: ClosestPairs, best: np.ndarray
) -> None:
    """Overwrite patches of a mesh, and its pairs, in place by those copies that are the best, (p,), -1 for none."""
    whole, patches, peaks = batch.whole, batch.patches, batch.peaks
    v, f, s = len(patches.vertices), len(patches.faces), len(peaks.samples)
    faces, vertices = np.flatnonzero(best[patches.of_face] >= 0), np.flatnonzero(best[patches.of_vertex] >= 0)
    samples = np.flatnonzero(best[patches.of_face[peaks.sample_faces]] >= 0)
    from_face = faces + f * best[patches.of_face[faces]]
    from_vertex = vertices + v * best[patches.of_vertex[vertices]]
    from_sample = samples + s * best[patches.of_face[peaks.sample_faces[samples]]]
    source = PatchSource(
        vertices=patches.vertices[vertices],
        from_vertices=from_vertex,
        faces=patches.faces[faces],
        from_faces=from_face,
        triangles=patches.vertices[trial.triangles[from_face] % v],
    )
    rows = pairs.rows(peaks.samples[samples], source.faces, source.vertices, len(whole.triangles))
    from_rows = after.rows(from_sample, from_face, from_vertex, len(trial.triangles))
    pairs.overwrite(rows, after, from_rows, patches.faces[after.faces[from_rows] % f])
    whole.take_over(trial, source, pairs)
