"""Carry vertices along a surface: closest points on it, and which of its samples are nearest to each vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...mesh.closest_point import ClosestPoint, ClosestPointTracker
from .surface_samples import SurfaceSamples, area_samples, crest_samples

# Samples of the surface for every vertex on it: few, but enough to find what a mesh cuts off.
SAMPLES_PER_POINT = 6
# Rounds after which closest points are searched for again; see `closest_point.ClosestPointTracker`.
SEARCH_EVERY = 12


@dataclass(frozen=True)
class SampleSums:
    """Of the samples nearest to every point: their area (k,), their mass, which is area times squared density, (k,),
    and their first moment about it (k,3)."""

    area: np.ndarray
    mass: np.ndarray
    moment: np.ndarray


class SurfaceCarrier:
    """A surface with a density (m,) per triangle of its index, on which about `count` points move."""

    def __init__(self, index: ClosestPoint, density: np.ndarray, count: int):
        self.index, self.density = index, density
        self._samples = area_samples(index, SAMPLES_PER_POINT * count, density)
        self._crests = crest_samples(index)
        self._memory = ClosestPointTracker(SEARCH_EVERY)

    def begin_at(self, points: np.ndarray, normals: np.ndarray, near: np.ndarray | None) -> None:
        """Begin with points (k,3) with normals (k,3), others than the last ones, about at triangles `near` (k,), where
        these are known."""
        found = self.index.at_or_near(points, normals, near)
        self._memory = ClosestPointTracker(SEARCH_EVERY, start=found.faces)

    @property
    def faces(self) -> np.ndarray:
        """The triangle (k,) of each of the last closest points."""
        return np.asarray(self._memory.faces)

    def closest(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Closest points (k,3) to points (k,3) with normals (k,3), and the density there (k,).

        The points are to be the same each time, moved a little: the search begins at the last ones.
        """
        found = self._memory(self.index, points, normals)
        return found.points, self.density[found.faces]

    def nearest_sums(self, points: np.ndarray, normals: np.ndarray) -> tuple[SampleSums, SampleSums]:
        """Sum up the samples nearest to each of points (k,3) with normals (k,3): those of the area, and of crests.

        See `surface_samples.area_samples` and `crest_samples`.
        """
        tree = cKDTree(np.column_stack([points, self.index.normal_scale * normals]))
        return self._summed(self._samples, points, tree), self._summed(self._crests, points, tree)

    @property
    def measure(self) -> np.ndarray:
        """Area times density of every sample, (s,)."""
        return self._samples.area * self.density[self._samples.faces]

    def nearest(self, points: np.ndarray, normals: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Which of points (k,3) with normals (k,3) is nearest to every sample, (s,), among those with an edge length,
        `size` (k,), like its own."""
        s, w = self._samples, self.index.normal_scale
        target = self.index.spacing / np.sqrt(self.density[s.faces])
        # A point across a jump of the density may be the nearest, but does not count as one of this side.
        tree = cKDTree(np.column_stack([points, w * normals, 2 * w * np.log(size)]))
        return tree.query(np.column_stack([s.points, w * s.normals, 2 * w * np.log(target)]))[1].astype(np.int64)

    def _summed(self, samples: SurfaceSamples, points: np.ndarray, tree: cKDTree) -> SampleSums:
        k = len(points)
        near = tree.query(np.column_stack([samples.points, self.index.normal_scale * samples.normals]))[1].astype(
            np.int64
        )
        mass = samples.area * self.density[samples.faces] ** 2
        off = mass[:, None] * (samples.points - points.take(near, axis=0))
        moment = np.stack([np.bincount(near, off[:, j], k) for j in range(3)], axis=1)
        return SampleSums(np.bincount(near, samples.area, k), np.bincount(near, mass, k), moment)
