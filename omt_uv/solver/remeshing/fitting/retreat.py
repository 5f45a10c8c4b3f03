"""Take back a fit where faces have come to pass through one another: a thin part has two sides, and what is brought
nearer to one may go through the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...contact.self_intersections import FaceCrossings, intersecting_pairs
from ...mesh.topology import vertices_around
from ..edits.working_mesh import WorkingMesh

# Rounds in which more vertices go back.
ROUNDS = 8


def retreated(before: WorkingMesh, fitted: WorkingMesh, vertices: np.ndarray, triangles: np.ndarray) -> WorkingMesh:
    """A fitted mesh with vertices around faces that intersect where they were before the fit, as far as fewer do then.

    The mesh of a surface (n,3), (m,3) that intersects itself is left as it is.
    """
    crossings, points = FaceCrossings(fitted.triangles), fitted.points
    pairs = crossings.pairs(points)
    if not len(pairs) or len(intersecting_pairs(vertices, triangles)):
        return fitted
    best, fewest, back = points, len(pairs), np.zeros(len(points), dtype=bool)
    for _ in range(ROUNDS):
        met = np.zeros(len(fitted.triangles), dtype=bool)
        met[pairs] = True
        meeting = vertices_around(fitted.triangles, met, len(points), 0)
        if back[meeting].all():
            # That was not enough: what lies around them goes back, too.
            meeting = vertices_around(fitted.triangles, met, len(points), 1)
        back |= meeting
        points = np.where(back[:, None], before.points, fitted.points)
        pairs = crossings.pairs(points)
        if len(pairs) < fewest:
            best, fewest = points, len(pairs)
        if not fewest:
            break
    return replace(fitted, points=best)
