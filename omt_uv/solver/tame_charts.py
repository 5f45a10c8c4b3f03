"""Charts whose conformal maps double precision can hold: long or winding ones are cut into pieces.

The scale of a conformal map to the disk varies exponentially with the length of what sticks out. Cuts between charts
leave no trace in a remesh, so there may be as many as it takes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from .chart_maps import Image
from .charts import Chart, triangle_surface
from .features import all_edges, region_borders
from .parts import Part
from .preparation import prepare
from .progress import Steps, part_of
from .topology import twins

# A chart without a conformal map falls into so many pieces, so often, unless it has fewer triangles than this.
PIECES, ROUNDS, SMALLEST = 4, 3, 100


def open_charts(part: Part, lines: np.ndarray) -> list[Chart]:
    """Disks that a part falls into when it is cut along lines (e,2), and open further where that takes more cuts.

    Cuts leave no trace, so they are those that are found fastest.
    """
    return prepare(triangle_surface(part.vertices, part.triangles, lines), extremities=0).charts


def tame_charts(
    part: Part, charts: list[Chart], image_of: Callable[[np.ndarray, np.ndarray], Steps[Image]], rounds: int
) -> Steps[tuple[list[Chart], list[Image]]]:
    """The charts of a part, some of them in pieces, and the image of each, with a warning where it is not conformal.

    image_of : see `chart_maps.conformal_image`; rounds : how often charts that have none are cut into pieces
    """
    lines, images = part.features, dict[bytes, Image]()
    for k in range(rounds + 1):
        charts = open_charts(part, lines) if k else charts
        keys = [chart.faces.tobytes() for chart in charts]
        for chart, key in zip(charts, keys, strict=True):
            if key not in images:
                steps = image_of(chart.vertices, chart.disk)
                images[key] = yield from part_of(steps, k / (rounds + 1), 1 / (rounds + 1) / len(charts))
        found = [images[key] for key in keys]
        wild = [c for c, image in zip(charts, found, strict=True) if image.warnings and len(c.faces) >= SMALLEST]
        if not wild:
            break
        lines = all_edges(lines, *(_borders(part, chart.faces) for chart in wild)) if k < rounds else lines
    return charts, found


def _borders(part: Part, faces: np.ndarray) -> np.ndarray:
    """Edges (e,2) between PIECES connected pieces of the triangles `faces` (k,) of a part: each has the triangles that
    are nearer to its middle than to others, over the surface, and the middles are far apart."""
    triangles = part.triangles[faces]
    twin = twins(triangles)
    inner = np.flatnonzero(twin >= 0)
    rows, columns = inner // 3, twin[inner] // 3
    centre = part.vertices[triangles].mean(axis=1)
    # Steps of no length would be no edges of the graph.
    length = np.linalg.norm(centre[rows] - centre[columns], axis=1) + 1e-12
    graph = csr_matrix((length, (rows, columns)), shape=(len(faces),) * 2)
    distance = dijkstra(graph, indices=0)
    away = np.zeros((0, len(faces)))
    for _ in range(PIECES):
        away = np.concatenate([away, dijkstra(graph, indices=[int(distance.argmax())])])
        distance = away.min(axis=0)
    return region_borders(triangles, away.argmin(axis=0))
