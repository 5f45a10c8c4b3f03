"""Embed a disk in a convex domain by mean value weights, as they are or evened (Floater 2003; Yoshizawa, Belyaev,
Seidel 2004), with its boundary spread along that of the domain by its length.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..linalg.nested_dissection import mesh_order
from ..maps.energy import Elements
from ..maps.tutte import arc_length_parameters, evened_tutte, released_vertices, tutte
from ..transport.convex_domain import Domain
from ..transport.inverse_map import corner_parameters


def mean_value_sites(vertices, triangles, loop, corners, domain: Domain, order: np.ndarray | None = None) -> np.ndarray:
    """A milder embedding (n,2) than a conformal map, with the boundary spread by its length (Floater 2003); order (n,):
    see `nested_dissection.mesh_order`."""
    outline, places = _spread(vertices, loop, corners, domain)
    return tutte(vertices, triangles, outline, places, order=order)


def evened_sites(
    faces: Elements,
    vertices: np.ndarray,
    outline: tuple[np.ndarray, np.ndarray | None, Domain],
    area_weight: float,
    most: float,
    patient: Callable[[], bool] = lambda: False,
    order: np.ndarray | None = None,
) -> np.ndarray | None:
    """An embedding (n,2) of a disk mesh (n,3) that gives every triangle room, by weights that are evened; None where
    its energy at this area weight does not come down to `most`. patient, order : see `tutte.evened_tutte`.

    outline : the boundary (b,), corners (4,) or None, and the domain. A face with three vertices on one side of a
        rectangle has no area: one of these leaves the side.

    Raises
    ------
    FoldedUVError : an inner edge joins two corners
    PrecisionError : weights so far from one another that double precision has no such map
    """
    loop, corners, domain = outline
    loop, places = _spread(vertices, loop, corners, domain)
    if corners is not None:
        corner = np.isin(loop, corners)
        kept = ~released_vertices(faces.triangles, loop, np.cumsum(corner) - 1, corner, len(vertices))
        loop, places = loop[kept], places[kept]
    order = mesh_order(vertices, faces.triangles) if order is None else order
    sites = tutte(vertices, faces.triangles, loop, places, order=order)
    return evened_tutte(vertices, loop, sites, faces, area_weight, most, order, patient)


def _spread(vertices: np.ndarray, loop: np.ndarray, corners: np.ndarray | None, domain: Domain):
    """The boundary (b,), from its first corner on, and its places (b,2) on that of the domain, by its length."""
    if corners is not None:
        # Each side of the rectangle takes the boundary between two corners.
        loop = np.roll(loop, -int(np.flatnonzero(loop == corners[0])[0]))
    share = arc_length_parameters(vertices, loop)
    if corners is not None:
        first = np.append(share[np.isin(loop, corners)], 1.0)
        share = np.interp(share, first, corner_parameters(domain) / domain.period)
    return loop, domain.map_boundary(share)
