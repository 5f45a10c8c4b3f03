"""A component in the order of its places is the same, in whatever order a file has it."""

import meshes
import numpy as np

from omt_uv.solver.cutting.component_order import in_order
from omt_uv.solver.mesh.topology import halfedges, twins


def test_the_order_of_a_file_plays_no_part():
    V, F = meshes.head()
    random = np.random.default_rng(0)
    shuffle = random.permutation(len(V))
    other = np.roll(np.argsort(shuffle)[F], 1, axis=1)[random.permutation(len(F))]
    found = []
    for positions, triangles in ((V, F), (V[shuffle], other)):
        twin = twins(triangles)
        first = np.flatnonzero(twin > np.arange(len(twin)))
        pair = np.column_stack([first, twin[first]])
        order = in_order(positions, triangles, pair)
        tail, head = halfedges(order.triangles)
        # The halfedges of a pair run along one edge, against each other.
        assert np.array_equal(tail[order.pair[:, 0]], head[order.pair[:, 1]])
        # Each pair is where the edge that it was given for is.
        given = np.sort(np.column_stack([ends[pair[order.pairs, 0]] for ends in halfedges(triangles)]), axis=1)
        new = np.sort(order.vertices[np.column_stack([tail, head])[order.pair[:, 0]]], axis=1)
        assert np.array_equal(given, new)
        found.append((positions[order.vertices], order.triangles, order.pair))
    assert all(np.array_equal(a, b) for a, b in zip(*found, strict=True))
