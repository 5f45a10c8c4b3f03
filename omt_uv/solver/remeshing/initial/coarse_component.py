"""Coarsen a fine disk before it is decimated to samples: of most of its vertices nothing would be left in any case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import PrecisionError
from ...maps.tutte import arc_length_parameters, tutte
from ...mesh.geometry import face_areas
from ...mesh.topology import boundary_loops
from ...progress import Steps
from ...refinement.mesh_hierarchy import coarsen_disk
from ...transport.convex_domain import Disk
from ..components.components import Component
from .component_maps import ComponentMaps

# Vertices for every sample that are left,
PER_SAMPLE = 2
# and at least: fewer take no time in any case.
FEWEST = 20_000
# A disk that has not this many times as many stays as it is: coarsening has its price.
WORTHWHILE = 2


@dataclass(frozen=True)
class CoarseComponent:
    """A coarse mesh of a component, its density (t,), by which it has the same measure, and at its vertices (c,)."""

    maps: ComponentMaps
    density: np.ndarray
    at_vertices: np.ndarray


def coarse_component(
    maps: ComponentMaps, count: int, density: np.ndarray, at_vertices: np.ndarray
) -> Steps[CoarseComponent | None]:
    """Coarsen a disk with density (m,), and at_vertices (n,), to what `count` samples need.

    All vertices of the boundary stay. None for a disk that is not much finer, and for one that double precision does
    not embed.
    """
    goal = max(PER_SAMPLE * count, FEWEST)
    component = maps.component
    if len(component.vertices) <= WORTHWHILE * goal:
        return None
    # Of a chart: its triangles have areas.
    chart = maps.charts[0]
    loop = boundary_loops(chart.triangles)[0]
    try:
        circle = Disk().map_boundary(arc_length_parameters(chart.vertices, loop))
        flat = tutte(chart.vertices, chart.triangles, loop, circle)
    except PrecisionError:
        return None
    mass = face_areas(chart.vertices, chart.triangles) * density[chart.faces]
    coarse = yield from coarsen_disk(chart.vertices, chart.triangles, flat, mass, goal, whole_boundary=True)
    kept, m = chart.vertex_ids[coarse.kept], len(coarse.triangles)
    thinned = Component(
        vertices=component.vertices[kept],
        triangles=coarse.triangles,
        # Where its triangles lie in the input is of no interest.
        faces=np.zeros(m, np.int64),
        input_barycentric=np.zeros((m, 3, 3)),
        features=np.zeros((0, 2), np.int64),
        to_reopen=np.zeros(0, np.int64),
        shift=np.zeros((m, 3)),
    )
    return CoarseComponent(ComponentMaps(thinned), coarse.mass / np.maximum(thinned.area, 1e-300), at_vertices[kept])
