"""Vertices moved onto poles and cones: exactly there, without a change of area, nothing far away touched."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import icosphere
from sphere_shapes import random_rotation, random_sphere

from omt_uv.solver.globe.pole_vertices import CONES, POLES, move_vertices_onto, push, singular_points
from omt_uv.solver.globe.projections import EQUIRECT, LAMBERT, OCTAHEDRAL
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas


def test_octahedral_cones_are_vertices():
    P, F = random_sphere(900, 1)
    points, found = move_vertices_onto(P, F, CONES)
    assert (found >= 0).all() and (points[found] == CONES).all()
    assert (signed_volumes(points, F) > 0).all()


@pytest.mark.parametrize("distance", [1e-7, 0.02, 0.4])
def test_a_push_moves_one_point_and_keeps_areas(distance):
    P, _ = icosphere(4)
    end = np.array([0.0, 0, 1])
    start = np.array([np.sin(distance), 0, np.cos(distance)])
    # Tiny triangles, whose sides stay straight.
    corners = P[:, None] + 1e-5 * np.random.default_rng(0).normal(size=(len(P), 3, 3))
    corners = (corners / np.linalg.norm(corners, axis=2, keepdims=True)).reshape(-1, 3)
    moved = push(np.concatenate([corners, [start]]), start, end, 12.0, np.pi / 2)
    assert np.allclose(moved[-1], end, atol=1e-6 * distance)
    assert (moved[:-1][corners[:, 2] < -1e-3] == corners[corners[:, 2] < -1e-3]).all()
    tiny = np.arange(len(corners)).reshape(-1, 3)
    before, after = (signed_volumes(p, tiny) for p in (corners, moved))
    assert np.abs(after / before - 1)[np.abs(before) > 1e-11].max() < 5e-3


def test_cylinders_need_the_poles_and_the_octahedron_the_middles_of_its_sides():
    np.testing.assert_array_equal(singular_points(EQUIRECT), POLES)
    np.testing.assert_array_equal(singular_points(LAMBERT), POLES)
    np.testing.assert_array_equal(singular_points(OCTAHEDRAL), CONES)


def test_vertices_that_are_there_already_stay_and_so_does_all_else():
    P, F = icosphere(3)
    found, vertices = move_vertices_onto(P, F, P[[5, 77]])
    assert vertices.tolist() == [5, 77]
    np.testing.assert_array_equal(found, P)


@pytest.mark.parametrize("targets", [POLES, CONES], ids=["poles", "cones"])
def test_every_face_stays_and_the_sphere_is_covered_once(targets):
    P, F = random_sphere(900, 1)
    found, vertices = move_vertices_onto(P, F, targets)
    np.testing.assert_array_equal(found[vertices], targets)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(spherical_areas(found, F).sum(), 4 * np.pi, rtol=1e-12)
    # What is farther away than half of the distance of two targets is as it was; nothing is so far from both poles.
    far = (P @ targets.T).max(axis=1) < np.cos(np.pi / len(targets))
    assert far.any() == (len(targets) == 4)
    np.testing.assert_array_equal(found[far], P[far])


def test_a_push_turns_with_the_sphere():
    P, _ = random_sphere()
    R, (start, end) = random_rotation(), P[:2]
    turned = push(P @ R.T, R @ start, R @ end, 3.0, 2.0)
    np.testing.assert_allclose(turned, push(P, start, end, 3.0, 2.0) @ R.T, atol=1e-12)


def test_a_push_that_is_too_far_moves_nothing():
    P, _ = random_sphere()
    np.testing.assert_array_equal(push(P, P[0], P[1], 12.0, 1e-3), P)
