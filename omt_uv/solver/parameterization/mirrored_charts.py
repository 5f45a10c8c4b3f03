"""Find charts that are each other's mirror image, so that one map serves both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..analysis.density import Target
from ..mesh.charts import Chart
from ..mesh.mirror import find_mirror
from .chart_map import ChartMap

# Relative difference of densities of mirror images up to which they are the same.
SAME_DENSITY = 1e-4


def mirror_partners(charts: Sequence[Chart], targets: Sequence[Target | None]) -> dict[int, tuple[int, np.ndarray]]:
    """Charts that are the mirror image of one before them: that one, and its vertex (n,) for each of theirs.

    The mirror is one of all charts together. Targets of a pair are symmetric, too.
    """
    if len(charts) < 2:
        return {}
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    triangles = np.concatenate([c.disk + k for c, k in zip(charts, first, strict=False)])
    size = max(int(c.faces.max()) for c in charts) + 1
    owners = [np.concatenate([c.faces, size + np.arange(len(c.patches))]) for c in charts]
    size += max(len(c.patches) for c in charts)
    polygons = np.concatenate([faces + k * size for k, faces in enumerate(owners)])
    mirror = find_mirror(np.concatenate([c.vertices for c in charts]), triangles, polygons)
    if mirror is None:
        return {}
    owner = np.repeat(np.arange(len(charts)), np.diff(first))
    found = {}
    for k, chart in enumerate(charts):
        image = mirror.image[first[k] : first[k + 1]]
        j = int(owner[image[0]])
        same = j < k and len(charts[j].vertices) == len(chart.vertices) and (owner[image] == j).all()
        if same and _same_targets(charts, targets, j, k, image - first[j]):
            found[k] = (j, image - first[j])
    return found


def mirrored_map(chart_map: ChartMap, image: np.ndarray) -> ChartMap:
    """The map of a chart whose vertices are the mirror images of those `image` (n,) of the one mapped."""
    return replace(chart_map, uv=chart_map.uv[image] * [-1.0, 1.0])


def _same_targets(charts, targets, j: int, k: int, image: np.ndarray) -> bool:
    """Whether the targets of charts j and k are mirror images, vertex by vertex."""
    one, two = targets[j], targets[k]
    if one is None or two is None:
        return one is two
    for name in ("density", "region"):
        a, b = getattr(one, name), getattr(two, name)
        if (a is None) != (b is None):
            return False
        if a is not None:
            at, here = _at_vertices(charts[j], a), _at_vertices(charts[k], b)
            if np.abs(at[image] - here).max() > SAME_DENSITY * np.abs(at).max():
                return False
    return True


def _at_vertices(chart: Chart, values: np.ndarray) -> np.ndarray:
    """Mean of values (m,) of a chart's triangles around its vertices, (n,)."""
    flat, n = chart.triangles.ravel(), len(chart.vertices)
    return np.bincount(flat, np.repeat(values, 3), n) / np.maximum(np.bincount(flat, minlength=n), 1)
