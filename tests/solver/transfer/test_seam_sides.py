"""Sides of seams: vertices that vouch for their neighbours, walks that do not cross, votes that the majority wins."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.cut_mesh import cut_open, on_seam
from omt_uv.solver.mesh.topology import boundary_edges
from omt_uv.solver.transfer.seam_sides import agree_on_sides, locate_corners, locate_faces, reference_vertices


def cut_square(columns=8):
    """A flat grid (n,3), (m,3), cut along its middle from side to side, and the seam."""
    V, F = meshes.grid(columns, columns)
    V = np.column_stack([V[:, :2], np.zeros(len(V))])
    middle = np.flatnonzero(np.isclose(V[:, 0], 0.5))
    middle = middle[np.argsort(V[middle, 1])]
    seams = np.column_stack([middle[:-1], middle[1:]])
    return V, F, seams, cut_open(V, F, seams)


def in_corners(F, n):
    """A triangle (n,) and barycentric coordinates (n,3) of every vertex."""
    first = np.unique(F.ravel(), return_index=True)[1]
    assert len(first) == n
    return first // 3, np.eye(3)[first % 3]


def right_of_seam(V, F):
    return V[F].mean(axis=1)[:, 0] > 0.5


def test_vertices_vouch_for_those_on_their_side_only():
    V, F, _, mesh = cut_square()
    faces, barycentric = in_corners(F, len(V))
    free = ~on_seam(mesh, faces, barycentric)
    assert free.sum() == len(V) - 9
    found = reference_vertices(mesh, F, free, V, 1 / 8)
    # Far from the seam everyone vouches for itself; on the seam, too, for there is no other.
    far = np.abs(V[:, 0] - 0.5) > 0.1
    np.testing.assert_array_equal(found[far], np.flatnonzero(far))
    np.testing.assert_array_equal(np.sign(V[found, 0] - 0.5), np.sign(V[:, 0] - 0.5))


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("turned", [False, True])
def test_neighbours_along_a_boundary_vouch_for_one_another_whichever_way_its_edges_go(turned, side):
    """One triangle, with a corner so near to the seam that it asks, and one that is far from it."""
    _, _, _, mesh = cut_square()
    lifted = np.array([[0.5, 0.4, 0], [0.5 + 0.02 * side, 0.5, 0], [0.5 + 0.4 * side, 0.5, 0]])
    free = np.array([False, True, True])
    triangle = np.array([[0, 2, 1]] if turned else [[0, 1, 2]])
    assert reference_vertices(mesh, triangle, free, lifted, 0.125).tolist() == [0, 2, 2]


def test_faces_are_found_on_the_side_from_which_the_walk_starts():
    V, F, _, mesh = cut_square()
    right = right_of_seam(V, F)
    faces, _ = in_corners(F, len(V))
    free = np.ones(len(V), bool)
    centres = V[F].mean(axis=1)
    np.testing.assert_array_equal(locate_faces(mesh, F, free, faces, centres, np.zeros(len(F), int)), np.arange(len(F)))
    # Starts from the far side end at the seam, for they cannot cross it.
    wrong = np.where(right[:, None], np.flatnonzero(~right)[0], np.flatnonzero(right)[0])[:, 0]
    for k in range(0, len(F), 7):
        found = locate_faces(mesh, F[[k]], free, np.full(len(V), wrong[k]), centres[[k]], np.array([k]))
        assert right[found[0]] != right[k]


def test_corners_are_on_the_side_of_their_face():
    V, F, _, mesh = cut_square()
    right = right_of_seam(V, F)
    faces, barycentric = in_corners(F, len(V))
    free = ~on_seam(mesh, faces, barycentric)
    triangle, weights, side, extended = locate_corners(mesh, F, np.arange(len(F)), free, V, faces, barycentric)
    assert extended == 0
    np.testing.assert_array_equal(right[triangle], np.repeat(right[:, None], 3, axis=1))
    np.testing.assert_allclose(np.einsum("tkc,tkcj->tkj", weights, V[F[triangle]]), V[F], atol=1e-12)
    # Corners of one vertex share their side just when their faces are on one side.
    np.testing.assert_array_equal(side < 0, free[F])
    for vertex in np.flatnonzero(~free):
        corner = np.flatnonzero(F.ravel() == vertex)
        mine, at = side.ravel()[corner], right[corner // 3]
        np.testing.assert_array_equal(mine[:, None] == mine, at[:, None] == at)


def test_a_corner_on_a_seam_has_a_side_also_where_the_walk_to_it_gets_stuck():
    """From the one arm of a U to the other there is a way, but none that comes nearer all the time."""
    V, F = meshes.grid(8, 8)
    middle = V[F].mean(axis=1)
    F = F[(np.abs(middle[:, 0] - 0.5) > 0.13) | (middle[:, 1] < 0.3)]
    used, F = np.unique(F, return_inverse=True)
    V, F = np.column_stack([V[used, :2], np.zeros(len(used))]), F.reshape(-1, 3)
    line = np.flatnonzero(np.isclose(V[:, 0], 0.875) & (V[:, 1] > 0.4) & (V[:, 1] < 0.9))
    line = line[np.argsort(V[line, 1])]
    mesh = cut_open(V, F, np.column_stack([line[:-1], line[1:]]))
    faces, barycentric = in_corners(F, len(V))
    free = ~on_seam(mesh, faces, barycentric)
    asked = np.flatnonzero(np.isin(F, line[1:-1]).any(axis=1))
    far = np.linalg.norm(V[F].mean(axis=1) - [0.2, 0.8, 0], axis=1).argmin()
    start = np.arange(len(F))
    start[asked] = far
    triangle, weights, side, extended = locate_corners(mesh, F, start, free, V, faces, barycentric)
    assert extended == 0
    np.testing.assert_allclose(np.einsum("tkc,tkcj->tkj", weights, V[F[triangle]]), V[F], atol=1e-12)
    inner = np.isin(F, line[1:-1])
    assert inner[asked].any() and (side[inner] >= 0).all()
    np.testing.assert_array_equal(side[free[F]], -1)


def test_a_wall_that_stands_on_a_plate_unjoined_has_its_own_values():
    plate, F = meshes.grid(4, 4)
    plate = np.column_stack([plate[:, :2], np.zeros(len(plate))])
    wall = np.column_stack([0 * plate[:, 0] + 0.4, plate[:, 0], plate[:, 1]])
    n, m = len(plate), len(F)
    mesh = cut_open(
        np.concatenate([plate, wall]), np.concatenate([F, F + n]), boundary_edges(np.concatenate([F, F + n]))
    )
    # A new mesh of the wall, whose foot was found on the plate.
    faces, barycentric = in_corners(F, n)
    faces += m
    foot = np.flatnonzero(wall[:, 2] == 0)
    for v in foot:
        corners = plate[F][:, :, :2]
        weights = np.linalg.solve(np.concatenate([corners.transpose(0, 2, 1), np.ones((m, 1, 3))], axis=1),
                                  np.tile([*wall[v, :2], 1.0], (m, 1))[:, :, None])[:, :, 0]  # fmt: skip
        faces[v] = weights.min(axis=1).argmax()
        barycentric[v] = weights[faces[v]]
    free = ~on_seam(mesh, faces, barycentric)
    assert free[foot[1:-1]].all()
    triangle, weights, _, extended = locate_corners(mesh, F, m + np.arange(m), free, wall, faces, barycentric)
    assert extended == 0 and (triangle >= m).all()
    at = np.einsum("tkc,tkcj->tkj", weights, mesh.positions[mesh.triangles[triangle]])
    np.testing.assert_allclose(at, wall[F], atol=1e-12)


def test_the_majority_wins():
    F = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]])
    triangle = np.array([[10, 0, 0], [20, 0, 0], [10, 0, 0]])
    weights = np.zeros((3, 3, 3))
    weights[:, 0] = [[1, 0, 0], [0, 1, 0], [1, 0, 0]]
    side = np.array([[5, -1, -1], [6, -1, -1], [5, -1, -1]])
    agree_on_sides(F, np.array([True, False, False, False]), triangle, weights, side)
    np.testing.assert_array_equal(side[:, 0], 5)
    np.testing.assert_array_equal(triangle[:, 0], 10)
    np.testing.assert_array_equal(weights[:, 0], [[1, 0, 0]] * 3)
    # Nobody votes for vertices that may have several sides.
    side[:, 0] = [5, 6, 5]
    agree_on_sides(F, np.zeros(4, bool), triangle, weights, side)
    np.testing.assert_array_equal(side[:, 0], [5, 6, 5])
