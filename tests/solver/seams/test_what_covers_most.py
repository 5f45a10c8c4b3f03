"""Of several places where a map lies on itself, that one comes first where most of it does."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.seams import parting
from omt_uv.solver.seams.parting import PolygonGraph


def ring(turns, count, at):
    """A strip that goes around so many times, and a map of it that lies on itself with what is more than once."""
    V, F = meshes.grid(count, 2, width=turns, height=1.0)
    (chart,) = strict_charts(triangle_surface(V, F))
    turn, radius = 2 * np.pi * chart.vertices[:, 0], 2 + chart.vertices[:, 1]
    return chart, np.column_stack([radius * np.cos(turn) + at, radius * np.sin(turn)])


@pytest.mark.parametrize("turns", [(1.4, 1.2, 1.3), (1.2, 1.4, 1.3), (1.3, 1.2, 1.4)], ids=str)
def test_what_covers_most_comes_first(turns):
    rings = [ring(each, round(30 * each), 10.0 * k) for k, each in enumerate(turns)]
    starts = np.cumsum([0, *(len(chart.vertices) for chart, _ in rings)])
    faces = np.cumsum([0, *(int(chart.faces.max()) + 1 for chart, _ in rings)])
    chart = replace(
        rings[0][0],
        vertices=np.concatenate([chart.vertices for chart, _ in rings]),
        triangles=np.concatenate([c.triangles + start for (c, _), start in zip(rings, starts[:-1], strict=True)]),
        faces=np.concatenate([c.faces + start for (c, _), start in zip(rings, faces[:-1], strict=True)]),
        vertex_ids=np.concatenate([c.vertex_ids + start for (c, _), start in zip(rings, starts[:-1], strict=True)]),
    )
    pairs = parting._covering(chart, np.concatenate([uv for _, uv in rings]), PolygonGraph.of(chart))
    found = [int(np.searchsorted(faces, one[0], side="right") - 1) for one, _ in pairs]
    assert found == np.argsort(-np.array(turns)).tolist()
