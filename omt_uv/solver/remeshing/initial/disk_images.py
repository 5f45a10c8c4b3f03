"""Map a disk chart to the unit disk twice: conformally, and with given areas, from the conformal map by transport."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...conformal.disk_map import conformal_disk
from ...errors import PrecisionError, TransportError
from ...maps.tutte import arc_length_parameters, tutte
from ...maps.untangle import untangle
from ...mesh.geometry import halfedge_lengths, vertex_areas
from ...mesh.topology import boundary_loops
from ...parameterization.initial_map import SITE_RESOLUTION
from ...progress import Steps
from ...transport.convex_domain import Disk
from ...transport.inverse_map import centroid_map
from ...transport.semidiscrete import transport

# Samples need no exact maps: angle sums of the flat metric may be off by this, radians,
ANGLE_TOLERANCE = 1e-2
# and areas by this share.
AREA_TOLERANCE = 0.1


@dataclass(frozen=True)
class DiskImage:
    """Image (n,2) of a chart in the unit disk, boundaries on the circle, and why it is not the one asked for."""

    uv: np.ndarray
    warnings: tuple[str, ...]


def conformal_image(vertices: np.ndarray, triangles: np.ndarray) -> Steps[DiskImage]:
    """Map a disk (n,3), (m,3) conformally; where that leaves double precision by mean values, and a warning."""
    try:
        uv = (yield from conformal_disk(vertices, triangles, ANGLE_TOLERANCE)).uv
        if halfedge_lengths(uv, triangles).min() >= SITE_RESOLUTION:
            return DiskImage(uv, ())
        mild = "A conformal map puts neighbours too close together"
    except PrecisionError as error:
        mild = error.cause
    loop = boundary_loops(triangles)[0]
    uv = tutte(vertices, triangles, loop, Disk().map_boundary(arc_length_parameters(vertices, loop)))
    return DiskImage(uv, (f"{mild}; samples were carried to a mean value map instead",))


def preserving_image(
    vertices: np.ndarray, triangles: np.ndarray, conformal: np.ndarray, density: np.ndarray
) -> Steps[DiskImage]:
    """Map a disk (n,3), (m,3) so that areas times density (m,) are kept, from the conformal map (n,2).

    It is the inverse of the optimal transport (see `solver.transport`), straightened by one linear system (see
    `maps.untangle`); where that fails the conformal map itself, and a warning.
    """
    warnings: list[str] = []
    loop, circle = boundary_loops(triangles)[0], Disk()
    try:
        mass = vertex_areas(vertices, triangles, density)
        cells = yield from transport(conformal, mass, circle, tolerance=AREA_TOLERANCE)
        uv = centroid_map(cells.cells.centroid, circle, loop, None, warnings)
        uv, _ = untangle(uv, vertices, triangles, loop, uv[loop])
    except TransportError as error:
        warnings.append(f"{error.cause}; samples were spread without transport")
        uv = conformal
    return DiskImage(uv, tuple(warnings))
