"""Find charts that are each other's mirror image, so that one map serves both, also where quads are cut otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..analysis.density import Target
from ..mesh.charts import Chart
from ..mesh.mirror import Mirror, find_mirror, mirrored_quads
from ..mesh.polygon_areas import quad_corners, triangle_pairs
from ..mesh.surface import Surface
from .chart_map import ChartMap, in_unit_box, measured_chart

# Relative difference of densities of mirror images up to which they are the same.
SAME_DENSITY = 1e-4
# Area error, over the goal, that a map of symmetric quads may leave in the triangles that they came as.
AREA_KEPT = 1.5


def mirror_partners(charts: Sequence[Chart], targets: Sequence[Target | None]) -> dict[int, tuple[int, np.ndarray]]:
    """Charts that are the mirror image of one before them: that one, and its vertex (n,) for each of theirs.

    The mirror is one of all charts together. Targets of a pair are symmetric, too.
    """
    if len(charts) < 2:
        return {}
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    mirror = _mirror_of_all(charts)
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


def _mirror_of_all(charts: Sequence[Chart]) -> Mirror | None:
    """The mirror of all charts together, their vertices one after another."""
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    triangles = np.concatenate([c.disk + k for c, k in zip(charts, first, strict=False)])
    size = max(int(c.faces.max()) for c in charts) + 1
    owners = [np.concatenate([c.faces, size + np.arange(len(c.patches))]) for c in charts]
    size += max(len(c.patches) for c in charts)
    polygons = np.concatenate([faces + k * size for k, faces in enumerate(owners)])
    return find_mirror(np.concatenate([c.vertices for c in charts]), triangles, polygons)


def mirrored_map(chart_map: ChartMap, image: np.ndarray) -> ChartMap:
    """The map of a chart whose vertices are the mirror images of those `image` (n,) of the one mapped."""
    return replace(chart_map, uv=chart_map.uv[image] * [-1.0, 1.0])


def with_mirrored_quads(surface: Surface, charts: Sequence[Chart]) -> list[Chart]:
    """Charts in which two triangles whose mirror images are cut along the other diagonal are one polygon, a quad.

    The charts given, where these, together, are not symmetric all the same.
    """
    own = np.diff(surface.face_start)[surface.triangle_face] == 3
    rows = surface.triangle_face[own]
    pairs = rows[mirrored_quads(surface.positions, surface.corner_vertex[surface.triangles[own]])]
    if not len(pairs):
        return list(charts)
    label = np.arange(len(surface.face_start) - 1)
    label[pairs.max(axis=1)] = pairs.min(axis=1)
    joined = [_relabelled(chart, label) for chart in charts]
    return list(charts) if _mirror_of_all(joined) is None else joined


def _relabelled(chart: Chart, label: np.ndarray) -> Chart:
    """The chart with faces label[faces], but for two triangles that a cut has parted."""
    faces = label[chart.faces]
    first, second = triangle_pairs(np.unique(faces, return_inverse=True)[1].ravel())
    apart = ~quad_corners(chart.triangles, first, second)[1]
    back = np.concatenate([first[apart], second[apart]])
    faces[back] = chart.faces[back]
    return replace(chart, faces=faces)


def as_given(chart: Chart, found: ChartMap, density: np.ndarray | None, goal: float) -> ChartMap | None:
    """The map of a chart from `with_mirrored_quads`, measured on the chart (m,) as it was given, with its density.

    goal : area error asked for; None where the diagonals given have folds in the map, or areas farther off
    """
    vertices, unit = in_unit_box(chart.vertices)
    figures = measured_chart(vertices, chart, found.uv / unit, density)
    if figures.folds or figures.area_l1 > max(AREA_KEPT * goal, found.area_l1):
        return None
    return replace(found, area_l1=figures.area_l1, area_sd=figures.area_sd, angle_mean=figures.angle_mean)


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
