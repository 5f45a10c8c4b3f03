"""What tests ask of any triangle mesh."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.mesh.geometry import angles_from_lengths, halfedge_lengths
from omt_uv.solver.mesh.topology import boundary_loops, halfedges, pair_keys


def topology(F):
    """Euler characteristic, boundary loops; the mesh must be an oriented manifold."""
    tail, head = halfedges(F)
    _, count = np.unique(pair_keys(tail, head), return_counts=True)
    assert count.max() <= 2
    directed = tail.astype(np.int64) << 32 | head
    assert len(np.unique(directed)) == len(directed)
    return len(np.unique(F)) - len(count) + len(F), len(boundary_loops(F))


def angles(V, F):
    """Angles (m,3) opposite to the halfedges, degrees."""
    return np.degrees(angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3)))
