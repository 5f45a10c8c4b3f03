"""Cut the long polygons of a closed surface into fans about their centres, for its map to the sphere.

A cap of many sides that comes as long slivers has no map of little shear: its fan has. Afterwards the centres go.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.closed_surface import ClosedSurface
from ..mesh.geometry import face_areas
from ..mesh.polygon_areas import polygon_fans


@dataclass(frozen=True)
class PolygonSurface:
    """A closed surface, its polygons (m,), any numbers or None where each triangle is its own, and the target (m,) area
    of every triangle."""

    surface: ClosedSurface
    polygons: np.ndarray | None
    target: np.ndarray


def with_polygon_fans(given: PolygonSurface) -> PolygonSurface | None:
    """The surface with its convex polygons of five corners and more as fans, centres last; None where there are none.

    The triangles of a fan ask for their areas, at the mean density of those that they replace.
    """
    if given.polygons is None:
        return None
    vertices, triangles = given.surface.vertices, given.surface.triangles
    owner = np.unique(given.polygons, return_inverse=True)[1].ravel()
    several = np.bincount(owner)[owner] > 2
    if not several.any():
        return None
    centres, fans, of_fans = polygon_fans(vertices, triangles[several], owner[several])
    if not len(fans):
        return None
    kept = ~np.isin(owner, of_fans)
    points = np.concatenate([vertices, centres])
    density = np.bincount(owner, given.target) / np.bincount(owner, face_areas(vertices, triangles))
    surface = replace(given.surface, vertices=points, triangles=np.concatenate([triangles[kept], fans]))
    return PolygonSurface(
        surface=surface,
        polygons=np.concatenate([owner[kept], of_fans]),
        target=np.concatenate([given.target[kept], face_areas(points, fans) * density[of_fans]]),
    )
