"""Gather islands that no texture shows, as the remains of faces without area: they need no margin between them, and
thousands of them would fill the square with margins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .outline_raster import island_areas, side_by_side

# Islands smaller than this share of a pixel are crumbs.
SHOWN = 0.1
# As long as the margins around crumbs take less than this share of the texture, each keeps its own.
NO_MATTER = 0.01
# Otherwise they lie this many times as far apart as the largest of them is long, ...
SPACING = 1.5
# ... or as this share of a pixel, which single precision still tells from nothing.
LEAST_STEP = 1e-3


@dataclass(frozen=True)
class Gathered:
    """Islands (n_i,2) with triangles (m_i,3), of which the last is a heap of crumbs; which (k,) of those given are
    crumbs, and where in the heap all but the first begin."""

    points: list[np.ndarray]
    triangles: list[np.ndarray]
    crumb: np.ndarray
    begin: np.ndarray

    def kept(self, marks: np.ndarray) -> np.ndarray:
        """Marks (k,) bool of the islands as they were given, of those that were gathered: a heap has none."""
        return np.append(marks[~self.crumb], False) if self.crumb.any() else marks

    def apart(self, placed: Sequence[np.ndarray]) -> list[np.ndarray]:
        """The islands as they were given, from those that were gathered and then placed."""
        if not self.crumb.any():
            return list(placed)
        *others, heap = placed
        rest, parts = iter(others), iter(np.split(heap, self.begin))
        return [next(parts) if small else next(rest) for small in self.crumb]


def gathered(
    points: Sequence[np.ndarray], triangles: Sequence[np.ndarray], margin: float, texture_size: int
) -> Gathered:
    """Islands (n_i,2) with those that no texture of so many pixels shows side by side in one, where they are many.

    The islands are taken to fill the texture.
    """
    alone = Gathered(list(points), list(triangles), np.zeros(len(points), dtype=bool), np.zeros(0, np.int64))
    matter = NO_MATTER * texture_size**2
    # Nearly always there are too few islands, crumbs or not.
    if len(points) * margin**2 <= matter:
        return alone
    area = float(island_areas(points, triangles).sum())
    size = np.array([float((p.max(axis=0) - p.min(axis=0)).max()) for p in points])
    crumb = size * texture_size < SHOWN * np.sqrt(area)
    if crumb.sum() * margin**2 <= matter:
        return alone
    small, large = np.flatnonzero(crumb), np.flatnonzero(~crumb)
    step = SPACING * max(float(size[small].max()), LEAST_STEP * np.sqrt(area) / texture_size)
    across = int(np.ceil(np.sqrt(len(small))))
    place = step * np.column_stack(np.divmod(np.arange(len(small)), across))
    heap = [points[k] - points[k].min(axis=0) + place[i] for i, k in enumerate(small)]
    together, index = side_by_side(heap, [triangles[k] for k in small])
    return Gathered(
        points=[*(points[k] for k in large), together],
        triangles=[*(triangles[k] for k in large), index],
        crumb=crumb,
        begin=np.cumsum(list(map(len, heap)))[:-1],
    )
