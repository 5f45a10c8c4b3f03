"""What is said of a surface in the terms of one of its charts, and of a chart in those of the surface."""

from __future__ import annotations

import numpy as np

from ..analysis.density import Target
from ..errors import MeshError
from ..mesh.charts import Chart, triangle_rows
from ..mesh.surface import Surface
from .chart_pins import ChartPins, CornerPins, chart_pins


def chart_target(target: Target | None, surface: Surface, chart: Chart) -> dict:
    """Arguments of `chart_map.unwrap_chart` for the part of a surface's target that a chart has."""
    if target is None:
        return {}
    mine = target.of(triangle_rows(surface, chart))
    return {"density": mine.density, "region": mine.region}


def located_pins(pins: CornerPins | None, chart: Chart) -> ChartPins | None:
    """The pins of a chart; errors have the element indices of the surface."""
    try:
        return chart_pins(pins, chart)
    except MeshError as error:
        raise located(error, chart) from error


def located(error: MeshError, chart: Chart) -> MeshError:
    """The same error with the element indices of the surface instead of the chart's; patches are nobody's fault."""
    patched = np.concatenate([chart.faces, np.full(len(chart.patches), -1)])
    place = {"vertex": chart.vertex_ids, "edge": chart.vertex_ids, "face": patched}.get(error.kind)
    elements = error.elements
    if place is not None:
        elements = place[elements]
        elements = elements[(elements >= 0).reshape(len(elements), -1).all(axis=1)]
    return type(error)(error.cause, error.remedy, error.kind, elements)
