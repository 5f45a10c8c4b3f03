"""Vertices moved so that the triangles between them come closer to the surface.

A round takes the closest points of samples of both the surface and the mesh, and moves the vertices so that the
distances along the lines between them vanish in the least squares sense (Hoppe, DeRose, Duchamp, McDonald, Stuetzle
1993; Chen, Medioni 1992), while vertices stay near the centroids of their cells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .closest import ClosestPoint, Memory, vertex_normals
from .displacement import displacements
from .draft import Draft
from .embedded_flips import make_delaunay_embedded
from .pairs import Pairing
from .progress import Progress, Steps
from .surface_samples import area_samples, joined, tip_samples
from .topology import twins
from .voronoi import voronoi_cells

ROUNDS = 7
# Samples of the surface per vertex.
SAMPLES = 6
# Vertices stay within this share of an edge of the surface.
TETHER = 0.15
# Distances below this share of an edge have no direction but the normal's.
CLOSE = 1e-3


def fit_to_surface(draft: Draft, index: ClosestPoint, density: np.ndarray, spacing: float) -> Steps[Draft]:
    """A mesh near a surface, edges about `spacing` long, with less squared distance between the two.

    density (m,) of the surface's triangles, for the cells.
    """
    points, triangles = draft.points, draft.triangles.copy()
    samples = joined(area_samples(index, SAMPLES * len(points), density), tip_samples(index, len(points)))
    twin, pairing, home = twins(triangles), Pairing(index, samples), Memory(ROUNDS + 1)
    on = home(index, points, vertex_normals(points, triangles))
    for k in range(ROUNDS):
        pairs = pairing(points, triangles, on.points)
        cells = voronoi_cells(points, triangles, density[on.faces] ** 2, draft.delaunay)
        pull = cells.moment / np.maximum(cells.mass, 1e-300)[:, None]
        off = displacements(points, triangles, twin, draft.fixed, pairs, pull, CLOSE * spacing, pairs.usual)
        moved = points + off
        if not np.isfinite(moved).all():
            break
        points = moved
        on = home(index, points, vertex_normals(points, triangles))
        points = _tethered(points, on.points, TETHER * spacing)
        if draft.delaunay:
            make_delaunay_embedded(points, triangles, twin, draft.locked)
        yield Progress("Fit", (k + 1) / ROUNDS)
    return replace(draft, points=points, triangles=triangles)


def _tethered(points: np.ndarray, on: np.ndarray, longest: float) -> np.ndarray:
    """Points (n,3) no farther than that from their closest ones on the surface (n,3).

    Few distances see a vertex at a tip, and what they say in a straight line may lead far out.
    """
    way = points - on
    distance = np.sqrt(np.einsum("ni,ni->n", way, way))
    return on + way * np.minimum(1, longest / np.maximum(distance, 1e-300))[:, None]
