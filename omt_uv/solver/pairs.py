"""Pairs of closest points of a mesh and a surface, both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .closest import ClosestPoint, Memory, face_normals, subdivision_centroids
from .geometry import face_areas
from .surface_samples import Samples

# Samples of every triangle are this squared; what the vertices weigh next to them.
PATTERN = 2
VERTICES = 0.5
# Rounds after which closest points are searched for again, and not only looked for near the last ones, for points
# farther than FAR times the root of the mean square.
SEARCH_EVERY, FAR = 2, 3.0


@dataclass(frozen=True)
class Pairs:
    """Points of the mesh, by triangle (k,) and barycentric coordinates (k,3), the way (k,3) to the surface and its
    length (k,), weights (k,): first those of the surface's samples, then those of the triangles and of the vertices."""

    faces: np.ndarray
    barycentric: np.ndarray
    way: np.ndarray
    distance: np.ndarray
    weight: np.ndarray

    @property
    def usual(self) -> float:
        """The root of the mean squared distance."""
        return float(np.sqrt(np.average(self.distance**2, weights=self.weight))) + 1e-300


class Pairing:
    """Pairs of the samples of a surface with one and the same mesh, moved and flipped little by little."""

    def __init__(self, index: ClosestPoint, samples: Samples):
        self.index, self.samples = index, samples
        self._there, self._back = Memory(SEARCH_EVERY, FAR), Memory(SEARCH_EVERY, FAR)

    def __call__(self, points: np.ndarray, triangles: np.ndarray, on: np.ndarray) -> Pairs:
        """Closest points of the samples on a mesh (n,3), (m,3), and of points of the mesh on the surface; each way
        weighs one half.

        on (n,3): the closest points of the vertices
        """
        samples, n, area = self.samples, len(points), face_areas(points, triangles)
        near = self._there(ClosestPoint(points, triangles, self.index.spacing), samples.points, samples.normals)
        pattern = subdivision_centroids(PATTERN)
        owner = np.repeat(np.arange(len(triangles)), len(pattern))
        bary = np.tile(pattern, (len(triangles), 1))
        places = np.einsum("qc,mcj->mqj", pattern, points[triangles]).reshape(-1, 3)
        far = self._back(self.index, places, face_normals(points, triangles)[owner]).points
        corner = np.zeros(n, np.int64)
        corner[triangles.ravel()] = np.arange(triangles.size)
        at = VERTICES * np.bincount(triangles.ravel(), np.repeat(area / 3, 3), n)
        area = np.concatenate([area[owner] / len(pattern), at])
        way = np.concatenate([samples.points - near.points, far - places, on - points])
        return Pairs(
            np.concatenate([near.faces, owner, corner // 3]),
            np.concatenate([near.barycentric, bary, np.eye(3)[corner % 3]]),
            way,
            np.sqrt(np.einsum("ki,ki->k", way, way)),
            np.concatenate([samples.area / samples.area.sum(), area / area.sum()]) / 2,
        )
