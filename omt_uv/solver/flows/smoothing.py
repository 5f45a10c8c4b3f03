"""Take faces that pass through one another apart by smoothing what is around them, where planes do not suffice.

Where a surface is wrapped onto another, faces may meet that were far from touching: flat ones across a groove, or what
is crumpled. Their vertices go to the means of their neighbours (the umbrella operator; Kobbelt, Campagna, Vorsatz,
Seidel 1998) until nothing meets, which leaves as much of the shape as can be, and all that is elsewhere.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..contact.new_crossings import NewCrossings, touched
from ..contact.self_intersections import FaceCrossings
from ..mesh.topology import vertices_around
from .creases import neighbours

# Times that what meets is looked for and smoothed; rings of vertices around it, one more every few rounds.
ROUNDS = 60
RINGS = 1
WIDER_EVERY = 8


def smoothed_apart(
    before: np.ndarray, after: np.ndarray, faces: FaceCrossings, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) close to `after` (n,3), and the pairs (k,2) of triangles (m,3) that still intersect there and did
    not at `before` (n,3). Only vertices `free` (n,) bool move."""
    triangles, n = faces.triangles, len(before)
    crossings = NewCrossings(before, faces)
    pairs = crossings.pairs(after)
    best, fewest, position = after, pairs, after.copy()
    if not len(pairs):
        return best, fewest
    mean = _means(triangles, n)
    for k in range(ROUNDS):
        met = np.zeros(len(triangles), bool)
        met[pairs] = True
        chosen = vertices_around(triangles, met, n, RINGS + k // WIDER_EVERY) & free
        position[chosen] = (mean @ position)[chosen]
        # What meets does so with something that has moved, or has met before.
        pairs = crossings.pairs(position, touched(after, position, triangles) | met)
        if len(pairs) < len(fewest):
            best, fewest = position.copy(), pairs
        if not len(pairs):
            break
    return best, fewest


def _means(triangles: np.ndarray, n: int) -> sp.csr_matrix:
    """Rows (n,n) that make means of the neighbours of each vertex."""
    graph = neighbours(triangles, n)
    graph.data[:] = 1.0
    count = np.maximum(np.diff(graph.indptr), 1)
    return sp.csr_matrix(sp.diags(1.0 / count) @ graph)
