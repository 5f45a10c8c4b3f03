"""Cut the polygons of a chart for its map: quads along their shorter diagonal, others into fans about their centres.

Which way an importer, or a modeller, has cut them then plays no part, and a cap of thousands of sides is a fan of good
triangles instead of slivers. Polygons that are not convex stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..maps.polygon_elements import polygon_mesh
from ..mesh.charts import Chart
from ..mesh.edge_flips import shorter_diagonals
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.polygon_areas import polygon_fans


@dataclass(frozen=True)
class PolygonDisk:
    """A chart as it is mapped.

    vertices (n+k,3): those of the chart, then the centres of fans; triangles (t,3), those of patches over holes last;
    polygons (t,): whose triangle each is, negative for patches.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    polygons: np.ndarray


def polygon_disk(vertices: np.ndarray, chart: Chart) -> PolygonDisk:
    """The chart, with its vertices at (n,3), cut for its map."""
    faces = _numbered(chart.faces)
    cut = polygon_mesh(chart.triangles, faces, most=len(faces))
    quads = shorter_diagonals(vertices, cut.quads, chart.disk)
    own = faces[cut.rows[: len(cut.triangles)]]
    of_quads = faces[cut.rows[len(cut.triangles) :]].reshape(-1, 2)[:, 0]
    centres, fans, of_fans = polygon_fans(vertices, cut.triangles, own)
    kept = ~np.isin(own, of_fans)
    halves = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return PolygonDisk(
        vertices=np.concatenate([vertices, centres]),
        triangles=np.concatenate([cut.triangles[kept], halves, fans, chart.patches]),
        polygons=np.concatenate([own[kept], np.repeat(of_quads, 2), of_fans, -1 - np.arange(len(chart.patches))]),
    )


def of_polygon_disk(values: np.ndarray, vertices: np.ndarray, chart: Chart, disk: PolygonDisk, patch: float):
    """Values (m,) per area of a chart's triangles as those (t,) of the disk: one a polygon, `patch` over holes."""
    faces = _numbered(chart.faces)
    area = face_areas(vertices, chart.triangles)
    mean = np.bincount(faces, area * values) / np.bincount(faces, area)
    return np.where(disk.polygons >= 0, mean[disk.polygons], patch)


def with_centres(uv: np.ndarray, triangles: np.ndarray, count: int) -> np.ndarray:
    """A map (n,2) of a chart's vertices with the centres of its fans, `count` vertices in all, in the middle of each.

    triangles (t,3): those of the disk
    """
    n = len(uv)
    corner = triangles[(triangles >= n).any(axis=1)]
    centre = corner.max(axis=1, initial=0) - n
    others = [corner[corner < n].reshape(-1, 2)[:, k] for k in range(2)]
    total = sum(np.column_stack([np.bincount(centre, uv[o, k], count - n) for k in range(2)]) for o in others)
    return np.concatenate([uv, total / np.maximum(2 * np.bincount(centre, minlength=count - n), 1)[:, None]])


def cut_as_mapped(chart: Chart, uv: np.ndarray) -> Chart:
    """The chart with quads that are folded in the map uv (n,2) cut along the other diagonal, where that is not."""
    folded = signed_areas(uv, chart.triangles) <= 0
    if not folded.any():
        return chart
    rows = np.flatnonzero(np.isin(chart.faces, chart.faces[folded]))
    cut = polygon_mesh(chart.triangles[rows], chart.faces[rows])
    pairs = rows[cut.rows[len(cut.triangles) :]].reshape(-1, 2)
    other = cut.quads[:, [[0, 1, 3], [1, 2, 3]]]
    better = (signed_areas(uv, other.reshape(-1, 3)).reshape(-1, 2) > 0).all(axis=1)
    triangles, corners = chart.triangles.copy(), chart.corners.copy()
    pairs, other = pairs[better], other[better]
    # Each vertex of a quad, and its corner, from the two triangles that it had.
    vertex, corner = (x[pairs].reshape(-1, 1, 6) for x in (chart.triangles, chart.corners))
    place = (vertex[:, :, None, :] == other[:, :, :, None]).argmax(axis=3)
    triangles[pairs] = other
    corners[pairs] = np.take_along_axis(corner, place.reshape(-1, 1, 6), axis=2).reshape(-1, 2, 3)
    return replace(chart, triangles=triangles, corners=corners)


def _numbered(faces: np.ndarray) -> np.ndarray:
    """Faces (m,) by numbers from 0 in the order in which they come, whatever they are called."""
    _, first, label = np.unique(faces, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[label.ravel()]
