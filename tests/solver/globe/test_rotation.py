"""Rotations of a globe: proper, the inverse of any turn of the map, and what markers say."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import cube, head, icosphere
from sphere_shapes import random_rotation, random_sphere

from omt_uv.solver.globe.projections import EQUIRECT, to_plane
from omt_uv.solver.globe.rotation import MarkerError, along_axes, by_markers, nearest_rotation


def random_points(count=4000, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize("make", [head, cube, lambda: icosphere(2)])
def test_axes_undo_any_rotation_of_the_map(make):
    V, F = make()
    direction = V - V.mean(axis=0)
    points = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    expected = along_axes(points, V, F)
    R = random_rotation()
    assert np.linalg.det(expected) == pytest.approx(1)
    assert np.allclose(along_axes(points @ R.T, 7 * V + 3, F) @ R, expected, atol=1e-9)


def test_axes_of_a_sphere_are_its_own():
    V, F = icosphere(3)
    assert np.allclose(along_axes(V, V, F), np.eye(3), atol=1e-12)


def test_a_surface_that_looks_inwards_has_north_up_and_the_front_in_the_middle():
    V, F = head()
    direction = V - V.mean(axis=0)
    points = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    outside = along_axes(points, V, F)
    # Turned inside out it maps to the mirror image.
    inside = along_axes(points * [-1, 1, 1], V, F[:, ::-1]) * [-1, 1, 1]
    assert np.allclose((points @ inside.T)[:, 1:], (points @ outside.T)[:, 1:], atol=0.05)


@pytest.mark.parametrize("seed", range(5))
def test_markers_give_pole_meridian_and_side(seed):
    pole, meridian, side = random_points(3, seed)
    if np.linalg.det([pole, meridian, side]) < 0:
        meridian, side = side, meridian
    R = by_markers(pole, meridian)
    assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1)
    assert np.allclose(R @ pole, [0, 0, 1])
    assert np.allclose(to_plane(R @ meridian, EQUIRECT)[0], 0.5)
    R = by_markers(pole, meridian, side)
    assert np.allclose(R @ pole, [0, 0, 1])
    west, east = to_plane(np.stack([R @ meridian, R @ side]), EQUIRECT)[:, 0]
    assert 0.25 < west <= 0.5 + 1e-12 or 0.5 < west < 0.75
    assert 0 < (east - west) % 1 < 0.5


@pytest.mark.parametrize("pole", [[0.0, 0, 1], [0, 0, -1], [1, 0, 0]])
def test_a_pole_alone_comes_to_the_north(pole):
    assert np.allclose(by_markers(np.array(pole)) @ pole, [0, 0, 1])


def test_markers_without_a_direction_are_refused():
    x, y, z = np.eye(3)
    with pytest.raises(MarkerError, match="meridian"):
        by_markers(z, -z)
    with pytest.raises(MarkerError, match="west"):
        by_markers(z, -y, -x)
    with pytest.raises(MarkerError, match="no middle"):
        by_markers(0 * x)


def test_the_nearest_rotation_is_the_one_that_was_done():
    P, _ = random_sphere(50)
    R, weight = random_rotation(), np.random.default_rng(0).random(50)
    np.testing.assert_allclose(nearest_rotation(P, P @ R.T, weight), R, atol=1e-14)
    # Of a mirror image it still is a rotation.
    found = nearest_rotation(P, P * [1, 1, -1], weight)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(found) > 0


def test_markers_turn_with_the_sphere():
    pole, meridian, side = np.array([[0.1, 0.3, 0.9], [0.2, -1, 0.1], [1, 0.1, 0.2]])
    R = random_rotation(2)
    for given in ((pole, meridian), (pole, meridian, side)):
        np.testing.assert_allclose(by_markers(*(R @ x for x in given)) @ R, by_markers(*given), atol=1e-13)


@pytest.mark.parametrize("away, refused", [(0.9e-6, True), (1.1e-6, False)])
def test_markers_are_a_millionth_of_the_radius_apart_at_least(away, refused):
    """From the pole, and that they have a middle at all."""
    near = np.array([away, 0, 1.0])
    for given in ((np.array([0, 0, 1.0]), near), (np.array([0, 0, 1.0]), np.array([0, -1.0, 0]), near), (away * near,)):
        if refused:
            with pytest.raises(MarkerError):
                by_markers(*given)
        else:
            turn = by_markers(*given)
            np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-9)
