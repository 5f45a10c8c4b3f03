"""Pairs of closest points of a mesh and a surface, both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.closest_point import ClosestPoint, ClosestPointTracker, SurfacePoints, subdivision_centroids
from ...mesh.geometry import face_areas, face_normals
from ...mesh.topology import expand
from ..relaxation.surface_samples import Samples

# Samples of every triangle are this squared; what the vertices weigh next to them.
PATTERN = 2
VERTICES = 0.5
# Rounds after which closest points are searched for again, and not only looked for near the last ones, for points
# farther than FAR times the root of the mean square.
SEARCH_EVERY, FAR = 4, 3.0
NEVER = 1 << 30

PLACES = subdivision_centroids(PATTERN)
# The middles of the sides besides, drawn in a little; and more inside.
_SIDES = 0.02 / 3 + 0.98 * np.array([[0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]])
DENSE = np.concatenate([PLACES, _SIDES])
DENSER = np.concatenate([subdivision_centroids(PATTERN + 1), _SIDES])


@dataclass(frozen=True)
class Pairs:
    """Points of the mesh, by triangle (k,) and barycentric coordinates (k,3), the way (k,3) to the surface and its
    length (k,), weights (k,), about one a vertex: first those of the surface's samples, then those of the triangles,
    one after the other, then those of the vertices; counts: how many of each."""

    faces: np.ndarray
    barycentric: np.ndarray
    way: np.ndarray
    distance: np.ndarray
    weight: np.ndarray
    counts: tuple[int, int, int]

    @property
    def usual(self) -> float:
        """The root of the mean squared distance."""
        return float(np.sqrt(np.average(self.distance**2, weights=self.weight))) + 1e-300

    def worst(self, m: int) -> np.ndarray:
        """The largest distance at every one of m triangles, (m,)."""
        worst = np.zeros(m)
        np.maximum.at(worst, self.faces, self.distance)
        return worst


@dataclass(frozen=True)
class Start:
    """Triangles to begin the walk to closest points at: of the mesh for the samples (s,), of the surface for the points
    of the mesh's triangles (m r,); the area of samples, and of triangles, for one vertex; barycentric coordinates (r,3)
    of the triangles' points; and of a mesh in pieces that may lie on one another, the piece (m,) of every triangle: its
    samples stay with it."""

    there: np.ndarray
    back: np.ndarray
    per_vertex: tuple[float, float] | None
    places: np.ndarray
    piece: np.ndarray | None = None


class Pairing:
    """Pairs of the samples of a surface with one and the same mesh, moved and flipped little by little."""

    def __init__(self, index: ClosestPoint, samples: Samples, start: Start | None = None):
        self.index, self.samples = index, samples
        self._there, self._back = ClosestPointTracker(SEARCH_EVERY, FAR), ClosestPointTracker(SEARCH_EVERY, FAR)
        self.per_vertex: tuple[float, float] | None = None
        self._piece: np.ndarray | None = None
        self.places = start.places if start else PLACES
        if start:
            self._piece = start.piece
            # Only walks stay on a piece.
            self._there, self._back = (
                ClosestPointTracker(NEVER, start=start.there),
                ClosestPointTracker(1, FAR, start.back),
            )
            self.per_vertex = start.per_vertex

    @property
    def there(self) -> np.ndarray:
        """Triangles (s,) of the mesh that were the closest to the samples."""
        return np.asarray(self._there.faces)

    @property
    def back(self) -> np.ndarray:
        """Triangles (m q,) of the surface that were the closest to the points of the mesh's triangles."""
        return np.asarray(self._back.faces)

    def back_of(self, places: np.ndarray) -> np.ndarray:
        """About the triangles (m r,) of the surface that are the closest to these places (r,3) of the mesh's."""
        nearest = np.linalg.norm(places[:, None] - self.places, axis=2).argmin(axis=1)
        return self.back.reshape(-1, len(self.places))[:, nearest].ravel()

    def put_back(self, pairs: Pairs, faces: np.ndarray, other: Pairing, others: np.ndarray) -> None:
        """Go on from these pairs, and at triangles (k,) of the mesh from where another's (k,) are."""
        self._there.faces = pairs.faces[: pairs.counts[0]].copy()
        q = len(self.places)
        self.back.reshape(-1, q)[faces] = other.back.reshape(-1, q)[others]

    def __call__(self, points: np.ndarray, triangles: np.ndarray, on: np.ndarray) -> Pairs:
        """Closest points of the samples on a mesh (n,3), (m,3), and of points of the mesh on the surface; each way
        weighs one half.

        on (n,3): the closest points of the vertices
        """
        samples, n, area = self.samples, len(points), face_areas(points, triangles)
        mesh = ClosestPoint(points, triangles, self.index.spacing)
        near = self._there(mesh, samples.points, samples.normals)
        if self._piece is not None:
            self._look_around(mesh, self._piece, near)
        owner = np.repeat(np.arange(len(triangles)), len(self.places))
        bary = np.tile(self.places, (len(triangles), 1))
        places = np.einsum("qc,mcj->mqj", self.places, points[triangles]).reshape(-1, 3)
        far = self._back(self.index, places, face_normals(points, triangles)[owner]).points
        corner = np.zeros(n, np.int64)
        corner[triangles.ravel()] = np.arange(triangles.size)
        at = VERTICES * np.bincount(triangles.ravel(), np.repeat(area / 3, 3), n)
        if self.per_vertex is None:
            self.per_vertex = samples.area.sum() / n, (1 + VERTICES) * area.sum() / n
        ours, theirs = self.per_vertex
        area = np.concatenate([area[owner] / len(self.places), at])
        way = np.concatenate([samples.points - near.points, far - places, on - points])
        return Pairs(
            np.concatenate([near.faces, owner, corner // 3]),
            np.concatenate([near.barycentric, bary, np.eye(3)[corner % 3]]),
            way,
            np.sqrt(np.einsum("ki,ki->k", way, way)),
            np.concatenate([samples.area / ours, area / theirs]) / 2,
            (len(near.faces), len(owner), n),
        )

    def _look_around(self, mesh: ClosestPoint, piece: np.ndarray, near: SurfacePoints) -> None:
        """Compare what was found for samples that are far with all triangles of the same piece (m,)."""
        off = near.points - self.samples.points
        square = np.einsum("ki,ki->k", off, off)
        far = np.flatnonzero(square > FAR**2 * square.sum() / max(len(square), 1))
        order, size = np.argsort(piece, kind="stable"), np.bincount(piece)
        first, mine = np.cumsum(size) - size, piece[near.faces[far]]
        row, rank = expand(size[mine])
        face = order[rank + first[mine][row]]
        bary, distance = mesh.distance(self.samples.points[far[row]], face)
        best = np.lexsort((distance, row))
        best = best[np.flatnonzero(np.diff(row[best], prepend=-1))]
        near.faces[far], near.barycentric[far] = face[best], bary[best]
        near.points[far] = mesh.at(face[best], bary[best])
