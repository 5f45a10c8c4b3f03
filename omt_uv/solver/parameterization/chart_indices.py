"""Translate between a surface and one of its charts: targets to the chart, the elements of errors back, any order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..analysis.density import Target
from ..errors import MeshError
from ..mesh.charts import Chart, triangle_rows
from ..mesh.surface import Surface

# Bits of each coordinate along a Morton curve, and the masks that spread them.
BITS = 21
MASKS = (0x1F00000000FFFF, 0x1F0000FF0000FF, 0x100F00F00F00F00F, 0x10C30C30C30C30C3, 0x1249249249249249)
OFF_BORDER = 0.123
# Relative difference of principal axes, and lopsidedness along them, by which they are told apart.
DISTINCT = 1e-3
# Steps in the extent of a chart by which places of triangles around vertices in one place are told apart.
SAME_MIDDLE = 1e9


def chart_target(target: Target | None, surface: Surface, chart: Chart) -> Target | None:
    """The part of a surface's target that the triangles of a chart have; None for none."""
    return None if target is None else target.of(triangle_rows(surface, chart))


def located(error: MeshError, chart: Chart) -> MeshError:
    """The same error with the element indices of the surface instead of the chart's; patches have none."""
    patched = np.concatenate([chart.faces, np.full(len(chart.patches), -1)])
    place = {"vertex": chart.vertex_ids, "edge": chart.vertex_ids, "face": patched}.get(error.kind)
    elements = error.elements
    if place is not None:
        elements = place[elements]
        elements = elements[(elements >= 0).reshape(len(elements), -1).all(axis=1)]
    return type(error)(error.cause, error.remedy, error.kind, elements)


def in_order_of_places(chart: Chart) -> tuple[Chart, np.ndarray]:
    """The chart with its vertices and triangles in an order that their places alone decide, and that order (n,).

    Vertex k is the given chart's order[k]. Vertices go along a Morton curve (Morton 1966), so that neighbours are near
    in memory; those in one place, as along a cut, by where the triangles around them are.
    """
    order = _along_curve(chart)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    triangles, turn = _lowest_first(place[chart.triangles])
    corners = np.take_along_axis(chart.corners, turn, axis=1)
    polygon = np.unique(chart.faces, return_inverse=True)[1].ravel()
    rows = np.lexsort((*triangles.T[::-1], *_polygon_keys(triangles, polygon)))
    patches = _lowest_first(place[chart.patches])[0]
    found = replace(
        chart,
        vertices=chart.vertices[order],
        triangles=triangles[rows],
        corners=corners[rows],
        faces=chart.faces[rows],
        vertex_ids=chart.vertex_ids[order],
        patches=patches[np.lexsort(patches.T[::-1])],
    )
    return found, order


def _along_curve(chart: Chart) -> np.ndarray:
    """The order (n,) of the vertices of a chart."""
    p, n = _in_own_frame(chart.vertices), len(chart.vertices)
    low, high = p.min(axis=0), p.max(axis=0)
    extent = max(float((high / 2 - low / 2).max()), float(np.finfo(float).tiny))
    # Off the borders of cells, where rounding would decide about vertices of a regular grid.
    cell = np.clip((p / 2 - low / 2) / extent * (2**BITS - 2) + OFF_BORDER, 0, 2**BITS - 1).astype(np.uint64)
    code = _spread(cell[:, 0]) | _spread(cell[:, 1]) << np.uint64(1) | _spread(cell[:, 2]) << np.uint64(2)
    order = np.argsort(code, kind="stable")
    same = code[order][1:] == code[order][:-1]
    tied = np.flatnonzero(np.append(same, False) | np.append(False, same))
    if len(tied):
        middle = p[chart.disk].mean(axis=1) / 2 - low / 2
        flat = chart.disk.ravel()
        count = np.maximum(np.bincount(flat, minlength=n), 1)
        around = [np.bincount(flat, np.repeat(x, 3), n) / count for x in middle.T]
        # Sums in another order differ by rounding.
        keys = [np.round(x / extent * SAME_MIDDLE) for x in around]
        some = order[tied]
        order[tied] = some[np.lexsort((*(x[some] for x in keys), *p[some].T, code[some]))]
    return order


def _in_own_frame(points: np.ndarray) -> np.ndarray:
    """Points (n,3) along their principal axes, as they are where these are not told apart: a pose plays no part."""
    extent = float(np.ptp(points / 2, axis=0).max())
    if not extent > 0:
        return points
    p = (points - points.mean(axis=0)) / (2 * extent)
    values, axes = np.linalg.eigh(p.T @ p / len(p))
    skew = ((p @ axes) ** 3).mean(axis=0)
    if np.diff(values).min() < DISTINCT * values[-1] or np.sort(np.abs(skew))[1] < DISTINCT * values[-1] ** 1.5:
        return points
    axes = axes * np.where(skew < 0, -1, 1)
    # The least lopsided one is across the others: a mirror image of the points is no pose of them.
    k = int(np.abs(skew).argmin())
    axes[:, k] = np.cross(axes[:, (k + 1) % 3], axes[:, (k + 2) % 3])
    return p @ axes


def _spread(x: np.ndarray) -> np.ndarray:
    """The bits of numbers (n,) below 2^21 with two zeros after each."""
    for shift, mask in zip((32, 16, 8, 4, 2), MASKS, strict=True):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x


def _lowest_first(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m,3) from their lowest vertex on, and which corners (m,3) these were."""
    turn = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3 if len(triangles) else np.zeros((0, 3), np.int64)
    return np.take_along_axis(triangles, turn, axis=1), turn


def _polygon_keys(triangles: np.ndarray, polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the polygon (m,) of each triangle: the highest vertex, the sum of all, the lowest; whichever way it is cut."""
    count, n = int(polygon.max(initial=-1)) + 1, int(triangles.max(initial=-1)) + 1
    pairs = np.unique(np.repeat(polygon, 3) * np.int64(n) + triangles.ravel())
    owner, vertex = np.divmod(pairs, n)
    first = np.searchsorted(owner, np.arange(count))
    last = np.append(first[1:], len(owner)) - 1
    total = np.bincount(owner, vertex, count)
    return vertex[last][polygon], total[polygon], vertex[first][polygon]
