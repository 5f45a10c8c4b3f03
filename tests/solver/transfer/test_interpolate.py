"""Values carried to a new mesh: exact where they can be, from one side of every seam, whatever the seam looks like."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.feature_edges import region_borders, sharp_edges, value_jumps
from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.cut_mesh import cut_open
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.transfer import interpolate as transfer
from omt_uv.solver.transfer.correspondence import correspond


def fine_and_coarse(turn=0.0, subdivisions=2):
    """A sphere, a coarse one on it, turned about z, and where the vertices of the coarse one lie on the fine one."""
    V, F = meshes.icosphere(subdivisions + 2)
    W, G = meshes.icosphere(subdivisions)
    c, s = np.cos(turn), np.sin(turn)
    W = W @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    on = ClosestPoint(V, F, 0.2)(W, vertex_normals(W, G))
    return V, F, W, G, on


def meridian(V, F):
    """UVs of corners: longitude and height, and the jagged edges (k,2) where the longitude starts anew."""
    longitude = np.arctan2(V[:, 1], V[:, 0])[F]
    behind = longitude.mean(axis=1)[:, None]
    longitude = longitude + 2 * np.pi * np.round((behind - longitude) / (2 * np.pi))
    uv = np.stack([longitude, V[F, 2]], axis=-1).reshape(-1, 2)
    return uv, value_jumps(F, np.arange(F.size).reshape(-1, 3), uv, 1e-6)


def laid(V, F, seams, W, G, on):
    return correspond(V, F, seams, W, G, on.faces, on.barycentric)


def edge_set(edges):
    return set(pair_keys(edges[:, 0], edges[:, 1]).tolist())


def test_a_smooth_function_is_carried_to_within_the_error_of_interpolation():
    V, F, W, G, on = fine_and_coarse(0.1)
    at = laid(V, F, np.zeros((0, 2), np.int64), W, G, on)
    wave = lambda p: np.sin(2 * p[:, 0]) * np.cos(p[:, 1] + p[:, 2])  # noqa: E731
    h = np.linalg.norm(V[F] - V[F[:, [1, 2, 0]]], axis=2).max()
    # A chord sags by h^2 / 8 times the second derivatives, here at most 5, in each of two directions.
    bound = 2 * 5 * h**2 / 8
    assert np.abs(transfer.to_vertices(at, F, wave(V)) - wave(on.points)).max() < bound
    # What is linear is carried exactly, here the positions themselves.
    assert np.abs(transfer.to_vertices(at, F, V) - on.points).max() < 1e-12
    assert set(transfer.nearest_to_vertices(at, F, np.arange(len(V)))) <= set(F.ravel())


def test_without_seams_the_corners_are_those_of_the_vertices():
    V, F, W, G, on = fine_and_coarse(0.1)
    at = laid(V, F, np.zeros((0, 2), np.int64), W, G, on)
    corners = np.arange(F.size).reshape(-1, 3)
    per_corner = transfer.to_corners(at, corners, V[F].reshape(-1, 3))
    assert np.abs(per_corner - on.points[G].reshape(-1, 3)).max() < 1e-12
    assert not len(at.seams)
    assert at.extended == 0


@pytest.mark.parametrize("turn", [0.0, 0.05, 0.11, 1.0])
def test_no_face_mixes_the_two_sides_of_a_seam_it_reaches_across(turn):
    """A jagged seam inside one island, not kept: the island is the same on both sides, the values are not."""
    V, F, W, G, on = fine_and_coarse(turn)
    uv, seams = meridian(V, F)
    at = laid(V, F, seams, W, G, on)
    new = transfer.to_corners(at, np.arange(F.size).reshape(-1, 3), uv, extend=True).reshape(-1, 3, 2)
    assert at.extended > 0
    away = np.abs(W[G][:, :, 2]).max(axis=1) < 0.8
    assert np.ptp(new[away, :, 0], axis=1).max() < 1.0
    whole_turns = (new[..., 0] - np.arctan2(W[G][..., 1], W[G][..., 0]))[away] / (2 * np.pi)
    assert np.abs(whole_turns - np.round(whole_turns)).max() < 0.02
    a, b = new[away, 1] - new[away, 0], new[away, 2] - new[away, 0]
    assert (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0).all()


def coarse_seam():
    """A fine sphere, the coarse one it came from, and a seam made of edges of the coarse one."""
    W, G = meshes.icosphere(2)
    corners = np.arange(G.size).reshape(-1, 3)
    _, coarse = meridian(W, G)
    V, F, uv = W, G, meridian(W, G)[0]
    for _ in range(2):
        V, F, corners, uv = halved(V, F, corners, uv)
    return V, F, corners, uv, W, G, coarse


def halved(V, F, corners, uv):
    """Every triangle in four, flat, with corner values interpolated; first vertices are the old ones."""
    tail, head = halfedges(F)
    _, first, inverse = np.unique(pair_keys(tail, head), return_index=True, return_inverse=True)
    middle = len(V) + inverse.reshape(-1, 3)
    a, b, c = F.T
    ab, bc, ca = middle.T
    faces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    u = uv[corners]
    m = (u + u[:, [1, 2, 0]]) / 2
    order = ((u[:, 0], m[:, 0], m[:, 2]), (u[:, 1], m[:, 1], m[:, 0]), (u[:, 2], m[:, 2], m[:, 1]),
             (m[:, 0], m[:, 1], m[:, 2]))  # fmt: skip
    values = np.concatenate([np.stack(t, axis=1) for t in order]).reshape(-1, 2)
    points = np.concatenate([V, (V[tail[first]] + V[head[first]]) / 2])
    return points, faces, np.arange(faces.size).reshape(-1, 3), values


@pytest.mark.parametrize("scale, offset", [(1.0, 0.0), (1e-4, 0.0), (1e3, 1e5)])
def test_a_seam_that_is_kept_is_followed_and_both_sides_are_exact(scale, offset):
    V, F, corners, uv, W, G, coarse = coarse_seam()
    V, W = V * scale + offset, W * scale + offset
    seams = value_jumps(F, corners, uv, 1e-6)
    assert len(seams) == 4 * len(coarse)
    on = ClosestPoint(V, F, 0.2 * scale)(W, vertex_normals(W, G))
    at = laid(V, F, seams, W, G, on)
    new = transfer.to_corners(at, corners, uv, extend=True)
    assert np.abs(new - meridian((W - offset) / scale, G)[0]).max() < 1e-6 * (1 + 1e-3 * offset)
    assert at.extended == 0
    assert edge_set(at.seams) == edge_set(coarse)


def test_a_mesh_that_is_cut_open_keeps_its_two_boundaries_apart_though_they_touch():
    """As files without shared vertices have it: every point of the cut is a point of both boundaries."""
    V, F, corners, uv, W, G, coarse = coarse_seam()
    V, F = cut_along(V, F, value_jumps(F, corners, uv, 1e-6))
    W, G = cut_along(W, G, coarse)
    on = ClosestPoint(V, F, 0.2)(W, vertex_normals(W, G))
    at = laid(V, F, np.zeros((0, 2), np.int64), W, G, on)
    assert np.abs(transfer.to_corners(at, corners, uv, extend=True) - meridian(W, G)[0]).max() < 1e-6
    # Vertices too take what is on their own side; here every boundary vertex has one longitude.
    longitude = np.zeros(len(V))
    longitude[F.ravel()] = uv[:, 0]
    assert np.abs(transfer.to_vertices(at, F, longitude)[G] - meridian(W, G)[0][:, 0].reshape(-1, 3)).max() < 1e-6
    assert not len(at.seams)
    assert at.extended == 0


def cut_along(V, F, seams):
    """A mesh whose vertices on seams are one for every side."""
    sides = cut_open(V, F, seams).sides
    points = np.zeros((sides.max() + 1, 3))
    points[sides.ravel()] = V[F.ravel()]
    return points, sides


def test_faces_take_the_value_under_them_and_borders_that_are_kept_stay():
    V, F, corners, uv, W, G, _ = coarse_seam()
    north = V[F][:, :, 2].mean(axis=1) > 0.3
    # The region of the fine mesh is a union of faces of the coarse one.
    region = W[G][:, :, 2].mean(axis=1) > 0.3
    parent = ClosestPoint(W, G, 0.1)(V[F].mean(axis=1), vertex_normals(V, F)[F[:, 0]]).faces
    north = region[parent]
    on = ClosestPoint(V, F, 0.2)(W, vertex_normals(W, G))
    at = laid(V, F, region_borders(F, north), W, G, on)
    assert (transfer.to_faces(at, np.arange(len(F)), north) == region).all()
    assert edge_set(at.seams) == edge_set(region_borders(G, region))


def test_sharp_edges_of_a_cube_are_its_edges():
    V, F = meshes.cube()
    edges = sharp_edges(V, F, 0.7)
    assert len(edges) == 12
    assert np.allclose(np.linalg.norm(V[edges[:, 0]] - V[edges[:, 1]], axis=1), np.ptp(V[:, 0]))
    assert len(sharp_edges(V, F, 1.6)) == 0


def test_values_of_any_type_come_from_the_corner_with_the_greatest_weight():
    V, F, W, G, on = fine_and_coarse(0.1)
    at = laid(V, F, np.zeros((0, 2), np.int64), W, G, on)
    names = np.array([f"vertex {k}" for k in range(len(V))])
    for k, name in enumerate(transfer.nearest_to_vertices(at, F, names)):
        of = dict(zip(at.vertex_weights[k], names[F[at.vertex_triangle[k]]], strict=True))
        assert name == of[max(of)]
    corners = np.arange(F.size).reshape(-1, 3)
    found = transfer.nearest_to_corners(at, corners, np.arange(F.size)).reshape(-1, 3)
    for face in range(len(G)):
        for c in range(3):
            of = dict(zip(at.corner_weights[face, c], corners[at.corner_triangle[face, c]], strict=True))
            assert found[face, c] == of[max(of)]
