"""The two maps of a disk chart between which remeshing goes to and fro: conformal, and measure-preserving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .conformal import conformal_disk
from .domain import Disk
from .embedding import arc_length_parameters, tutte
from .errors import PrecisionError, TransportError
from .first_map import SITE_RESOLUTION, centroid_map
from .geometry import halfedge_lengths, vertex_areas
from .progress import Steps, part_of
from .topology import boundary_loops
from .transport import transport
from .untangle import untangle


@dataclass(frozen=True)
class ChartMaps:
    """Conformal and measure-preserving image (n,2) of a chart in the unit disk, boundaries on the circle."""

    conformal: np.ndarray
    preserving: np.ndarray
    warnings: tuple[str, ...]


def chart_maps(vertices: np.ndarray, triangles: np.ndarray, density: np.ndarray) -> Steps[ChartMaps]:
    """Maps of a disk (n,3), (m,3) with density (m,).

    The second is the inverse of the optimal transport to the first (see `transport.py`), straightened by one linear
    system (see `untangle.py`). Where one of them leaves double precision there is a milder one, and a warning.
    """
    warnings: list[str] = []
    loop = boundary_loops(triangles)[0]
    circle = Disk()
    mild = None
    try:
        conformal = (yield from part_of(conformal_disk(vertices, triangles), 0.0, 0.5)).uv
        if halfedge_lengths(conformal, triangles).min() < SITE_RESOLUTION:
            mild = "A conformal map puts neighbours too close together"
    except PrecisionError as error:
        mild = error.cause
    if mild:
        warnings.append(f"{mild}; samples were carried to a mean value map instead")
        conformal = tutte(vertices, triangles, loop, circle.map_boundary(arc_length_parameters(vertices, loop)))
    try:
        mass = vertex_areas(vertices, triangles, density)
        cells = yield from part_of(transport(conformal, mass, circle, tolerance=1e-2), 0.5, 0.5)
        uv = centroid_map(cells, circle, loop, None, warnings)
        uv, _ = untangle(uv, vertices, triangles, loop, uv[loop])
    except TransportError as error:
        warnings.append(f"{error.cause}; samples were spread without transport")
        uv = conformal
    return ChartMaps(conformal, uv, tuple(warnings))
