"""Pair closest points of a mesh and a surface, both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.closest_point import (
    FEW_CANDIDATES,
    ClosestPoint,
    ClosestPointTracker,
    SurfacePoints,
    points_in,
    subdivision_centroids,
)
from ...mesh.geometry import face_areas, of_corners
from ...mesh.topology import expand
from ..relaxation.surface_samples import SurfaceSamples

# Samples of every triangle are this squared.
PATTERN = 2
# What the vertices weigh next to them.
VERTEX_WEIGHT = 0.5
# Rounds after which closest points are searched for again, and not only looked for near the last ones,
SEARCH_EVERY = 4
# for points farther than so many times the root of the mean square.
FAR = 3.0
# More rounds than there are.
NEVER = 1 << 30

# Barycentric coordinates (r,3) of the points of a triangle that are compared with the surface,
PLACES = subdivision_centroids(PATTERN)
# the middles of the sides, drawn in a little,
_SIDES = 0.02 / 3 + 0.98 * np.array([[0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5]])
# with these besides,
DENSE = np.concatenate([PLACES, _SIDES])
# and with more inside.
DENSER = np.concatenate([subdivision_centroids(PATTERN + 1), _SIDES])


@dataclass(frozen=True)
class ClosestPairs:
    """Points of the mesh, by triangle (k,) and barycentric coordinates (k,3), and their counterparts on the surface.

    offset (k,3): from the mesh to the surface, and its length, distance (k,); weight (k,): about one a vertex. First
    come the pairs of the surface's samples, `sample_count` of them, then those of the triangles, one after the other,
    `place_count` together, then those of the vertices.
    """

    faces: np.ndarray
    barycentric: np.ndarray
    offset: np.ndarray
    distance: np.ndarray
    weight: np.ndarray
    sample_count: int
    place_count: int

    @property
    def rms(self) -> float:
        """The root of the mean squared distance."""
        return float(np.sqrt(np.average(self.distance**2, weights=self.weight))) + 1e-300

    def largest_distance(self, m: int) -> np.ndarray:
        """The largest distance at every one of m triangles, (m,)."""
        largest = np.zeros(m)
        np.maximum.at(largest, self.faces, self.distance)
        return largest

    def rows(self, samples: np.ndarray, faces: np.ndarray, vertices: np.ndarray, m: int) -> np.ndarray:
        """The pairs of samples (s,), of all places of faces (f,) of a mesh with m triangles, and of vertices (v,)."""
        r = np.arange(self.place_count // m)
        of_faces = self.sample_count + (faces[:, None] * len(r) + r).ravel()
        return np.concatenate([samples, of_faces, self.sample_count + self.place_count + vertices])

    def overwrite(self, rows: np.ndarray, other: ClosestPairs, other_rows: np.ndarray, faces: np.ndarray) -> None:
        """Put pairs (k,) of another mesh, which lie on these faces (k,) of this one, in the place of rows (k,)."""
        self.faces[rows] = faces
        self.barycentric[rows] = other.barycentric[other_rows]
        self.offset[rows] = other.offset[other_rows]
        self.distance[rows] = other.distance[other_rows]


@dataclass(frozen=True)
class PairingStart:
    """Triangles to begin the walk to closest points at.

    mesh_faces (s,): of the mesh, for the samples; surface_faces (m r,): of the surface, for the places of the mesh's
    triangles; area_per_vertex: of samples, and of triangles; places (r,3): barycentric coordinates in every triangle;
    patch (m,): of a mesh of patches that may lie on one another, that of every triangle: its samples stay with it
    """

    mesh_faces: np.ndarray
    surface_faces: np.ndarray
    area_per_vertex: tuple[float, float] | None
    places: np.ndarray
    patch: np.ndarray | None = None


class Pairing:
    """Pairs the samples of a surface with one and the same mesh, moved and flipped little by little."""

    def __init__(self, index: ClosestPoint, samples: SurfaceSamples, start: PairingStart | None = None):
        self.index, self.samples = index, samples
        self._on_mesh = ClosestPointTracker(SEARCH_EVERY, FAR, candidates=FEW_CANDIDATES)
        self._on_surface: ClosestPointTracker | None = None
        self.area_per_vertex: tuple[float, float] | None = None
        self._patch: np.ndarray | None = None
        self.places = start.places if start else PLACES
        if start:
            self._patch = start.patch
            # Only walks stay on a patch.
            self._on_mesh = ClosestPointTracker(NEVER, start=start.mesh_faces)
            self._on_surface = ClosestPointTracker(1, FAR, start.surface_faces)
            self.area_per_vertex = start.area_per_vertex

    @property
    def mesh_faces(self) -> np.ndarray:
        """Triangles (s,) of the mesh that were the closest to the samples."""
        return np.asarray(self._on_mesh.faces)

    @property
    def surface_faces(self) -> np.ndarray:
        """Triangles (m r,) of the surface that were the closest to the points of the mesh's triangles."""
        return np.asarray(self._on_surface.faces if self._on_surface else None)

    def surface_faces_for(self, places: np.ndarray) -> np.ndarray:
        """About the triangles (m r,) of the surface that are the closest to these places (r,3) of the mesh's."""
        nearest = np.linalg.norm(places[:, None] - self.places, axis=2).argmin(axis=1)
        return self.surface_faces.reshape(-1, len(self.places))[:, nearest].ravel()

    def take_over(self, pairs: ClosestPairs, faces: np.ndarray, other: Pairing, from_faces: np.ndarray) -> None:
        """Go on from these pairs, and at faces (k,) of the mesh from where another's (k,) are."""
        self._on_mesh.faces = pairs.faces[: pairs.sample_count].copy()
        q = len(self.places)
        self.surface_faces.reshape(-1, q)[faces] = other.surface_faces.reshape(-1, q)[from_faces]

    def __call__(
        self, points: np.ndarray, triangles: np.ndarray, on: np.ndarray, twin: np.ndarray | None = None
    ) -> ClosestPairs:
        """Pair the samples with a mesh (n,3), (m,3), and its places and vertices with the surface; each way weighs 1/2.

        on (n,3): the closest points of the vertices; twin (3m,): opposite halfedges, where they are known
        """
        samples, n, area = self.samples, len(points), face_areas(points, triangles)
        mesh = ClosestPoint(points, triangles, self.index.spacing, twin, even=True)
        near = self._on_mesh(mesh, samples.points, samples.normals)
        if self._patch is not None:
            self._search_patch(mesh, self._patch, near)
        owner = np.repeat(np.arange(len(triangles)), len(self.places))
        bary = np.tile(self.places, (len(triangles), 1))
        places = points_in(points.take(triangles.T, axis=0), self.places)
        if self._on_surface is None:
            # All places of a triangle begin where its middle is.
            middles = self.index(of_corners(np.add, points[triangles]) / 3, mesh.normals, FEW_CANDIDATES).faces
            start = np.repeat(middles, len(self.places))
            self._on_surface = ClosestPointTracker(SEARCH_EVERY, FAR, start, FEW_CANDIDATES)
        far = self._on_surface(self.index, places, mesh.normals.take(owner, axis=0)).points
        corner = np.zeros(n, np.int64)
        corner[triangles.ravel()] = np.arange(triangles.size)
        at = VERTEX_WEIGHT * np.bincount(triangles.ravel(), np.repeat(area / 3, 3), n)
        if self.area_per_vertex is None:
            self.area_per_vertex = samples.area.sum() / n, (1 + VERTEX_WEIGHT) * area.sum() / n
        ours, theirs = self.area_per_vertex
        area = np.concatenate([area[owner] / len(self.places), at])
        offset = np.concatenate([samples.points - near.points, far - places, on - points])
        return ClosestPairs(
            faces=np.concatenate([near.faces, owner, corner // 3]),
            barycentric=np.concatenate([near.barycentric, bary, np.eye(3)[corner % 3]]),
            offset=offset,
            distance=np.sqrt(np.einsum("ki,ki->k", offset, offset)),
            weight=np.concatenate([samples.area / ours, area / theirs]) / 2,
            sample_count=len(near.faces),
            place_count=len(owner),
        )

    def _search_patch(self, mesh: ClosestPoint, patch: np.ndarray, near: SurfacePoints) -> None:
        """Overwrite what was found for samples that are far by what is closest on the same patch (m,)."""
        off = near.points - self.samples.points
        square = np.einsum("ki,ki->k", off, off)
        far = np.flatnonzero(square > FAR**2 * square.sum() / max(len(square), 1))
        order, size = np.argsort(patch, kind="stable"), np.bincount(patch)
        first, mine = np.cumsum(size) - size, patch[near.faces[far]]
        row, rank = expand(size[mine])
        face = order[rank + first[mine][row]]
        bary, distance = mesh.distance(self.samples.points[far[row]], face)
        best = np.lexsort((distance, row))
        best = best[np.flatnonzero(np.diff(row[best], prepend=-1))]
        near.faces[far], near.barycentric[far] = face[best], bary[best]
        near.points[far] = mesh.at(face[best], bary[best])
