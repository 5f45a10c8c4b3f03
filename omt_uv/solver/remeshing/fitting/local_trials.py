"""Several changes tried on pieces of a mesh, each on a copy of its own, all at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.closest_point import ClosestPointTracker
from ...mesh.geometry import angles_from_lengths, face_normals, halfedge_lengths
from ...mesh.topology import halfedges, pair_keys, twins
from ..edits.delaunay_flips import flip_where_sound
from ..edits.working_mesh import Draft
from ..relaxation.surface_samples import picked
from .closest_pairs import NEVER, Pairing, Pairs, Start
from .fit_state import Fitting
from .ring_patches import Patches

# Nothing but the steps, one of three vertices put on the peak first, or one of three edges flipped first.
TRIALS = 7
# Steps with vertices held on the peaks, and after these.
HELD_STEPS, STEPS = 2, 2
# Patches count by this norm of the largest distances of their triangles.
NORM = 8
# What a patch may come to in angle, in cosine between neighbours, and in variation of its edges, or from what it was.
LEAST_ANGLE, LEAST_COSINE, MOST_UNEVEN = np.radians(31.0), -0.5, 0.2
LEAN, STRETCH = 0.2, 1.2


@dataclass(frozen=True)
class Peaks:
    """The largest distance of every patch: in which of the patches' triangles (p,), where, as barycentric coordinates
    (p,3), and the point of the surface there (p,3). And the numbers (s,) of the samples of the surface that are nearest
    to the patches, and to which of their triangles (s,)."""

    patches: Patches
    face: np.ndarray
    barycentric: np.ndarray
    target: np.ndarray
    samples: np.ndarray
    there: np.ndarray


def peaks_of(fitting: Fitting, pairs: Pairs, patches: Patches) -> Peaks:
    """The peaks of patches of a mesh with these pairs."""
    number = np.full(len(fitting.triangles), -1)
    number[patches.faces] = np.arange(len(patches.faces))
    mine = np.flatnonzero(number[pairs.faces] >= 0)
    face = number[pairs.faces[mine]]
    order = np.argsort(pairs.distance[mine], kind="stable")
    last = np.zeros(len(patches), np.int64)
    last[patches.of_face[face[order]]] = order
    peak, bary = mine[last], pairs.barycentric[mine[last]]
    corners = fitting.points[fitting.triangles[pairs.faces[peak]]]
    target = np.einsum("pc,pcj->pj", bary, corners) + pairs.way[peak]
    samples = mine < pairs.counts[0]
    return Peaks(patches, face[last], bary, target, mine[samples], face[samples])


class Batch:
    """Copies of patches, one after the other, and a mesh of all of them on its way to the surface.

    piece (c f,): of every triangle, which of the c p patches it is of
    """

    def __init__(self, fitting: Fitting, peaks: Peaks, copies: int = TRIALS):
        patches = peaks.patches
        self.whole, self.peaks, self.patches, self.copies = fitting, peaks, patches, copies
        v, f, p = len(patches.vertices), len(patches.faces), len(patches)
        copy = np.arange(copies)[:, None]
        self.points = np.tile(fitting.points[patches.vertices], (copies, 1))
        self.triangles = (patches.triangles + v * copy[:, :, None]).reshape(-1, 3)
        self.piece = (patches.of_face + p * copy).ravel()
        self.fixed = np.tile(patches.outer | fitting.start.fixed[patches.vertices], copies)
        self.outer, self.held = np.tile(patches.outer, copies), self.fixed.copy()
        tail, head = halfedges(self.triangles)
        whole = np.tile(patches.vertices, copies)
        self.keep = np.isin(pair_keys(whole[tail], whole[head]), fitting.start.locked)
        self.locked = np.unique(pair_keys(tail[self.keep], head[self.keep]))
        self._start = Start(
            (peaks.there + f * copy).ravel(),
            np.tile(fitting.pairing.back.reshape(len(fitting.triangles), -1)[patches.faces].ravel(), copies),
            fitting.pairing.per_vertex,
            fitting.pairing.places,
            self.piece,
        )

    def vary(self) -> None:
        """Make the changes that are tried."""
        v, f = len(self.patches.vertices), len(self.patches.faces)
        nearest = np.argsort(-self.peaks.barycentric, axis=1, kind="stable")
        corners = np.take_along_axis(self.patches.triangles[self.peaks.face], nearest, axis=1)
        for k in range(3):
            moved = corners[:, k] + v * (1 + k)
            free = ~self.fixed[moved]
            self.points[moved[free]] = self.peaks.target[free]
            self.held[moved[free]] = True
            h = 3 * (self.peaks.face + f * (4 + k)) + k
            new = flip_where_sound(self.points, self.triangles, h, self.keep, self.outer)
            self.locked = np.union1d(self.locked, new)

    def mesh(self) -> Fitting:
        """The mesh of all copies as they are now."""
        whole = self.whole
        samples = picked(whole.pairing.samples, np.tile(self.peaks.samples, self.copies))
        home = ClosestPointTracker(NEVER, start=np.tile(whole.on.faces[self.patches.vertices], self.copies))
        draft = Draft(self.points, self.triangles, self.fixed, self.locked)
        return Fitting(draft, Pairing(whole.index, samples, self._start), whole.density, home, self.outer)

    def run(self, usual: float) -> Fitting:
        """The mesh of all copies after some steps."""
        trial = self.mesh()
        trial.flip()
        for k in range(HELD_STEPS + STEPS):
            held = self.held if k < HELD_STEPS else self.fixed
            if not trial.step(usual, held, firm=k < HELD_STEPS):
                break
        return trial


def norms(pairs: Pairs, m: int, piece: np.ndarray, count: int) -> np.ndarray:
    """Norm of the largest distances of the triangles (m,) of every piece, (count,); piece (m,) of each, -1 for none."""
    mine, worst = piece >= 0, pairs.worst(m)
    highest = max(float(worst.max(initial=0)), 1e-300)
    return highest * np.bincount(piece[mine], (worst[mine] / highest) ** NORM, count) ** (1 / NORM)


@dataclass(frozen=True)
class Shapes:
    """Of every piece of a mesh, (c, p) each: the least angle, the least cosine between neighbouring triangles, and the
    variation of the edges' lengths."""

    angle: np.ndarray
    cosine: np.ndarray
    uneven: np.ndarray


def shapes(points: np.ndarray, triangles: np.ndarray, piece: np.ndarray, patches: int) -> Shapes:
    """Shapes of the pieces (m,) of a mesh (n,3), (m,3)."""
    length, normal, twin = halfedge_lengths(points, triangles), face_normals(points, triangles), twins(triangles)
    count = int(piece.max()) + 1
    angle, cosine = np.full(count, np.pi), np.ones(count)
    np.minimum.at(angle, piece, angles_from_lengths(length.reshape(-1, 3)).min(axis=1))
    h = np.flatnonzero(twin >= 0)
    np.minimum.at(cosine, piece[h // 3], np.einsum("hi,hi->h", normal[h // 3], normal[twin[h] // 3]))
    owner = np.repeat(piece, 3)
    number = np.maximum(np.bincount(owner, minlength=count), 1)
    mean = np.maximum(np.bincount(owner, length, count) / number, 1e-300)
    square = np.bincount(owner, length**2, count) / number / mean**2
    uneven = np.sqrt(np.maximum(square - 1, 0))
    return Shapes(*(values.reshape(-1, patches) for values in (angle, cosine, uneven)))


def sound(before: Shapes, after: Shapes) -> np.ndarray:
    """Which pieces, (c,p) bool, are in as good a shape as can be asked for, or as before (1,p)."""
    return (
        (after.angle >= np.minimum(before.angle, LEAST_ANGLE))
        & (after.cosine >= np.minimum(before.cosine - LEAN, LEAST_COSINE))
        & (after.uneven <= np.maximum(before.uneven * STRETCH, MOST_UNEVEN))
    )


def put_back(batch: Batch, trial: Fitting, after: Pairs, pairs: Pairs, best: np.ndarray) -> None:
    """Overwrite patches of a mesh, and its pairs, by those copies that are the best, (p,), -1 for none."""
    whole, patches, peaks = batch.whole, batch.patches, batch.peaks
    v, f, s = len(patches.vertices), len(patches.faces), len(peaks.samples)
    faces, vertices = np.flatnonzero(best[patches.of_face] >= 0), np.flatnonzero(best[patches.of_vertex] >= 0)
    samples = np.flatnonzero(best[patches.of_face[peaks.there]] >= 0)
    from_face = faces + f * best[patches.of_face[faces]]
    from_vertex = vertices + v * best[patches.of_vertex[vertices]]
    from_sample = samples + s * best[patches.of_face[peaks.there[samples]]]
    points = whole.points.copy()
    points[patches.vertices[vertices]] = trial.points[from_vertex]
    whole.points = points
    whole.triangles[patches.faces[faces]] = patches.vertices[trial.triangles[from_face] % v]
    whole.twin = twins(whole.triangles)
    for all_of_them, new in zip(vars(whole.on).values(), vars(trial.on).values(), strict=True):
        all_of_them[patches.vertices[vertices]] = new[from_vertex]
    place = np.arange(pairs.counts[1] // len(whole.triangles))

    def rows(counts, sample, face, vertex):
        of_faces = counts[0] + (face[:, None] * len(place) + place).ravel()
        return np.concatenate([sample, of_faces, counts[0] + counts[1] + vertex])

    to = rows(pairs.counts, peaks.samples[samples], patches.faces[faces], patches.vertices[vertices])
    source = rows(after.counts, from_sample, from_face, from_vertex)
    pairs.faces[to] = patches.faces[after.faces[source] % f]
    for old, new in ((pairs.barycentric, after.barycentric), (pairs.way, after.way), (pairs.distance, after.distance)):
        old[to] = new[source]
    whole.pairing.put_back(pairs, patches.faces[faces], trial.pairing, from_face)
