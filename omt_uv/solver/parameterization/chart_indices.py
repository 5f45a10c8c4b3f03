"""Translate between a surface and one of its charts: targets to the chart, the elements of errors back."""

from __future__ import annotations

import numpy as np

from ..analysis.density import Target
from ..errors import MeshError
from ..mesh.charts import Chart, triangle_rows
from ..mesh.surface import Surface


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
