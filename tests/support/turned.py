"""Bodies of revolution, where they are in space, and the rings that are found on them."""

import numpy as np

from omt_uv.solver.mesh.geometry import nearest_rotations
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.revolution.rings import rings_of_edges

ASKED = float(np.log(1.35) ** 2)


def somewhere(V, seed=0, size=7.0):
    """Places (n,3) turned, moved and scaled, and where the axis is then."""
    rng = np.random.default_rng(seed)
    turn = nearest_rotations(rng.normal(size=(1, 3, 3)))[0]
    return size * V @ turn.T + [3, -2, 5], turn[:, 2], np.array([3.0, -2, 5])


def ring_edges(V, F, owner, asked=ASKED, cost=None, without=None):
    """Ends (r,2) of the rings of a surface; without: the ends of an edge that nobody can cut."""
    tail, head = halfedges(F)
    twin = twins(F)
    h = np.flatnonzero(twin > np.arange(len(twin)))
    pair = np.stack([h, twin[h]], axis=1)
    ends = np.stack([tail[h], head[h]], axis=1)
    if without is not None:
        there = (np.sort(ends, axis=1) != np.sort(without)).any(axis=1)
        pair, ends = pair[there], ends[there]
    length = np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1)
    diagonal = owner[pair[:, 0] // 3] == owner[pair[:, 1] // 3]
    cost = np.where(diagonal, np.inf, length if cost is None else cost(ends, length))
    return ends[rings_of_edges(V, F, owner, pair, length, cost, asked)]
