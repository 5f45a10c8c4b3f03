"""The double of a disk: closed, mirrored, and cut along the boundary where its edges cross it."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.double_cover import crossed_segment, double_disk
from omt_uv.solver.conformal.intrinsic_triangulation import euclidean_diagonal, from_mesh, make_delaunay
from omt_uv.solver.mesh.topology import boundary_loops, halfedges

DISKS = {"patch": meshes.quad_patch(), "bumpy": meshes.bumpy(6, 5), "random": meshes.random_disk(80)}


@pytest.fixture(params=DISKS)
def disk(request):
    V, F = DISKS[request.param]
    return V, F, boundary_loops(F)[0]


def test_the_double_is_a_closed_sphere(disk):
    V, F, loop = disk
    doubled, owner = double_disk(from_mesh(V, F), loop, len(V))
    assert (doubled.twin >= 0).all()
    np.testing.assert_array_equal(doubled.twin[doubled.twin], np.arange(6 * len(F)))
    assert len(owner) == 2 * len(V) - len(loop) == 2 + len(doubled.triangles) // 2
    tail, head = halfedges(doubled.triangles)
    np.testing.assert_array_equal(tail[doubled.twin], head)
    np.testing.assert_array_equal(doubled.log_length[doubled.twin], doubled.log_length)


def test_both_copies_have_the_lengths_of_the_disk(disk):
    V, F, loop = disk
    doubled, owner = double_disk(from_mesh(V, F), loop, len(V))
    tail, head = owner[np.stack(halfedges(doubled.triangles))]
    np.testing.assert_allclose(np.exp(doubled.log_length), np.linalg.norm(V[head] - V[tail], axis=1))


def test_only_edges_between_the_copies_cross_the_boundary(disk):
    V, F, loop = disk
    doubled, owner = double_disk(from_mesh(V, F), loop, len(V))
    assert (crossed_segment(doubled, loop, len(V)) == -1).all()
    flipped, count = make_delaunay(doubled, euclidean_diagonal)
    segment = crossed_segment(flipped, loop, len(V))
    tail, head = halfedges(flipped.triangles)
    inner = ~np.isin(owner, loop)
    crossing = inner[tail] & inner[head] & ((tail < len(V)) != (head < len(V)))
    np.testing.assert_array_equal(segment >= 0, crossing)
    np.testing.assert_array_equal(segment[flipped.twin], segment)


def test_segments_are_numbered_from_wherever_the_loop_begins(disk):
    """Which one an edge crosses hangs on no beginning: the last one, that ends where the loop begins, is as any."""
    V, F, loop = disk
    doubled, _ = double_disk(from_mesh(V, F), loop, len(V))
    flipped, _ = make_delaunay(doubled, euclidean_diagonal)
    segment, b = crossed_segment(flipped, loop, len(V)), len(loop)
    for k in range(b):
        turned = crossed_segment(flipped, np.roll(loop, -k), len(V))
        np.testing.assert_array_equal(turned, np.where(segment >= 0, (segment - k) % b, -1))
